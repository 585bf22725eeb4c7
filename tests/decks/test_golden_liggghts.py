"""Rendered LIGGGHTS decks against golden files; a deck run by hand against the session."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
import yaml

from sandmould.engines.bed_step import with_bed_step
from sandmould.engines.deck import Deck
from sandmould.engines.liggghts.process import executable
from sandmould.engines.liggghts.render import render_deck, write_deck
from sandmould.engines.program import build_program
from tests.decks.test_golden_decks import deck_of
from tests.hopper import hopper_scene
from tests.liggghts_scenes import liggghts_scene, needs_liggghts, open_liggghts

GOLDEN = Path(__file__).parent / "golden"
HOPPER = "liggghts_hopper"
VARIANTS: dict[str, dict[str, object]] = {
    "liggghts_tube_2d": {},
    "liggghts_plate_3d_laboratory_viscous_elastic": {
        "dimension": 3,
        "box": {"width_m": 0.05, "depth_m": 0.04, "height_m": 0.08},
        "obstacles": [
            {
                "kind": "plate",
                "centre_m": [0.025, 0.02, 0.02],
                "size_m": [0.02, 0.01, 0.004],
                "angle_deg": 30,
            }
        ],
        "frame": "laboratory",
        "background_damping": {"form": "viscous", "viscous_translation_per_s": 2.0},
        "contact": {"no_tension": "elastic", "rolling_axes": "all"},
        "vibration": [
            {"acceleration_g": 1.0, "duration_s": 0.1, "ramp_s": 0.02, "direction": "horizontal"}
        ],
    },
}


STEP_OF_BED = "liggghts_step_of_bed"


def liggghts_deck(name: str) -> Deck:
    """Render a variant of the small scene, or the hopper."""
    if name == HOPPER:
        return render_deck(build_program(hopper_scene("liggghts")), {}, "test", "golden")
    if name == STEP_OF_BED:
        scene = with_bed_step(liggghts_scene(time_step={"bed_fraction": 0.7}), 4e-5)
        return render_deck(build_program(scene), {}, "test", "golden")
    return render_deck(build_program(liggghts_scene(**VARIANTS[name])), {}, "test", "golden")


@pytest.mark.parametrize("name", [*VARIANTS, HOPPER, STEP_OF_BED])
def test_deck_equals_its_golden_file(name: str, request: pytest.FixtureRequest) -> None:
    path = GOLDEN / f"{name}.in"
    text = liggghts_deck(name).text
    if request.config.getoption("--refresh-golden"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8"), "pytest tests/decks --refresh-golden, and look"


@pytest.mark.parametrize("name", [*VARIANTS, HOPPER, STEP_OF_BED])
def test_every_number_has_its_unit_and_source(name: str) -> None:
    for line in liggghts_deck(name).text.splitlines():
        if re.match(r'variable \w+ (index|equal|string) "?-?[\d.]', line) and "0.0  #" not in line:
            assert re.search(r"  # [^,]+, \S", line), line


@pytest.mark.parametrize("name", [*VARIANTS, HOPPER, STEP_OF_BED])
def test_background_damping_comes_after_every_other_force(name: str) -> None:
    fixes = re.findall(r"^fix \w+ all (\S+)", liggghts_deck(name).text, re.M)
    forces = [i for i, s in enumerate(fixes) if s in ("gravity", "wall/gran", "setforce")]
    assert len(forces) >= 2
    assert all(i > max(forces) for i, s in enumerate(fixes) if s == "viscous")


def test_blocks_are_named_as_in_the_dialect_of_lammps() -> None:
    # A vibration of LAMMPS runs in pieces, in a block of its own between two others.
    pieces = re.compile("(run_of|after)_(vibrate|between)|between")
    for ours, lammps in (("liggghts_tube_2d", "plate_turned_no_rolling"), (HOPPER, "hopper")):
        names = [name for name in deck_of(lammps).blocks if not pieces.match(name)]
        assert list(liggghts_deck(ours).blocks) == names


def test_a_deck_without_rolling_names_no_rolling_model() -> None:
    contact = {name: {"rolling_arm_fraction": 0.0} for name in ("grain_grain", "grain_wall")}
    text = render_deck(build_program(liggghts_scene(contact=contact)), {}).text
    assert "rolling_friction" not in text
    assert "coefficientRollingFriction" not in text


@pytest.mark.slow
@needs_liggghts
@pytest.mark.parametrize("frame", ["box", "laboratory"])
def test_deck_by_hand_equals_the_session_to_the_last_digit(frame: str, tmp_path: Path) -> None:
    stage = {"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.02}
    scene = liggghts_scene(
        frame=frame,
        fill={
            "layers": [{"count": 30, "repeat": 2}],
            "vibration_between_layers": stage,
        },
        rest={"rms_speed_m_s": 0.05},
        vibration=[stage],
    )
    program = build_program(scene)
    hand, own = tmp_path / "hand", tmp_path / "a folder of ours"
    own.mkdir()
    write_deck(program, {}, hand, "test", "test")
    command = [executable() or "liggghts", "-in", "deck.in"]
    ran = subprocess.run(command, cwd=hand, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout[-2000:]
    summary = yaml.safe_load((hand / "summary.yaml").read_text())
    assert summary["grains"] == 60

    session = open_liggghts(scene, own)
    for stage_ in program.stages:
        if stage_.layer:
            session.insert_layer(stage_.layer)
        session.start_stage(stage_)
        while not session.stage_over:
            session.advance()
            session.snapshot()
        session.end_stage()
    assert session.steps == summary["steps"]
    top, speed = session.values(["c_top", "v_rms_speed"])
    session.close()
    assert top == summary["largest_height_m"]
    assert speed == summary["rms_speed_m_s"]
    assert (hand / "grains.dump").read_text().count("ITEM: TIMESTEP") > 2
