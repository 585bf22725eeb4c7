"""Rendered decks against golden files; ``pytest tests/decks --refresh-golden`` rewrites them."""

from __future__ import annotations

import re
from pathlib import Path

import jinja2
import pytest

from sandmould import ROOT
from sandmould.engines.bed_step import with_bed_step
from sandmould.engines.deck import Deck, DeckBlock, environment, exact
from sandmould.engines.lammps.render import layer_data, render_deck
from sandmould.engines.program import build_program
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.hopper import hopper_scene
from tests.scenes import tube_scene

GOLDEN = Path(__file__).parent / "golden"
HOPPER = "hopper"
STUDIES = ("tube_demo", "tube_3d_small")
VARIANTS: dict[str, dict[str, object]] = {
    "laboratory_viscous_elastic": {
        "frame": "laboratory",
        "background_damping": {
            "form": "viscous",
            "viscous_translation_per_s": 2.0,
            "viscous_rotation_per_s": 3.0,
        },
        "contact": {"no_tension": "elastic"},
        "vibration": [
            {"acceleration_g": 1.0, "duration_s": 0.1, "ramp_s": 0.02, "direction": "horizontal"}
        ],
    },
    "polygon_isotropic": {
        "obstacles": [
            {"kind": "polygon", "vertices_m": [[0.02, 0.02], [0.06, 0.02], [0.05, 0.03]]},
            {"kind": "plate", "name": "shelf", "centre_m": [0.01, 0.03], "size_m": [0.01, 0.004]},
        ],
        "background_damping": {"form": "nonviscous_isotropic"},
    },
    "plate_turned_no_rolling": {
        "obstacles": [
            {"kind": "plate", "centre_m": [0.04, 0.03], "size_m": [0.03, 0.004], "angle_deg": 30}
        ],
        "background_damping": {"form": "none"},
        "contact": {
            "grain_grain": {"rolling_arm_fraction": 0.0},
            "grain_wall": {"rolling_arm_fraction": 0.0},
        },
        "fill": {
            "layers": [{"count": 40, "repeat": 2}],
            "vibration_between_layers": {"displacement_m": 1e-4, "hold": "displacement"},
        },
    },
}


STEP_OF_BED = "lammps_step_of_bed"


def deck_of(name: str) -> Deck:
    """Render the first run of a shipped study, a variant of the small scene or the hopper."""
    if name == HOPPER:
        return render_deck(build_program(hopper_scene("lammps")), {}, "test", "golden")
    if name == STEP_OF_BED:
        scene = with_bed_step(tube_scene(time_step={"bed_fraction": 0.7}), 4e-5)
        return render_deck(build_program(scene), {}, "test", "golden")
    if name in VARIANTS:
        program = build_program(tube_scene(**VARIANTS[name]))
        return render_deck(program, {}, "test", "golden")
    run = expand(open_study(ROOT / "config" / "studies" / f"{name}.yaml"))[0]
    return render_deck(build_program(run.scenario), run.sources, "first", run.study)


@pytest.mark.parametrize("name", [*STUDIES, *VARIANTS, HOPPER, STEP_OF_BED])
def test_deck_equals_its_golden_file(name: str, request: pytest.FixtureRequest) -> None:
    path = GOLDEN / f"{name}.in"
    text = deck_of(name).text
    if request.config.getoption("--refresh-golden"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8"), "pytest tests/decks --refresh-golden, and look"


@pytest.mark.parametrize("name", [*STUDIES, *VARIANTS, HOPPER, STEP_OF_BED])
def test_every_number_has_its_unit_and_source(name: str) -> None:
    for line in deck_of(name).text.splitlines():
        if re.match(r"variable \w+ (index|equal) -?[\d.]", line) and "0.0  #" not in line:
            assert re.search(r"  # [^,]+, \S", line), line


@pytest.mark.parametrize("name", [*STUDIES, *VARIANTS, HOPPER, STEP_OF_BED])
def test_background_damping_comes_after_every_other_force(name: str) -> None:
    for part in re.split(r"^clear$", deck_of(name).text, flags=re.M):
        order = re.findall(r"^fix \w+ all (\S+)", part, re.M)
        damping = [i for i, s in enumerate(order) if s in ("damping/cundall", "viscous")]
        forces = [
            i for i, s in enumerate(order) if s in ("gravity", "wall/gran/region", "enforce2d")
        ]
        assert forces
        assert all(d > max(forces) for d in damping)


def test_a_misspelt_name_in_a_template_is_an_error() -> None:
    template = environment("lammps").from_string("{{ scenario.densty }}")
    with pytest.raises(jinja2.UndefinedError):
        template.render(scenario=Scenario())


def test_numbers_read_back_exactly() -> None:
    for number in (0.1, 1 / 3, 7e4, 2.0, -1e-20, 123456789.123456789):
        assert float(exact(number)) == number
    assert exact(70000.0) == "70000"


def test_a_block_with_two_runs_is_refused() -> None:
    with pytest.raises(ValueError, match="2 long runs"):
        DeckBlock("twice", "run 10\nfix one\nrun 20\n").around_run()


def test_layer_file_holds_every_grain_with_its_diameter() -> None:
    program = build_program(tube_scene())
    layer = program.layers[0]
    lines = layer_data(program.scenario, layer, 1).splitlines()
    rows = [line.split() for line in lines[lines.index("Atoms # sphere") + 2 :]]
    assert len(rows) == len(layer.radius_m) == 60
    assert [float(r[2]) / 2 for r in rows] == pytest.approx(layer.radius_m)
    assert [int(r[0]) for r in rows] == list(range(1, 61))
