"""Opening a study: bases, materials, and where every value came from."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.scenario.contact import WALL_LAW
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import OpenStudy, _named_from_root, display_path, open_study

Opened = Callable[..., OpenStudy]
SHIPPED = sorted((ROOT / "config" / "studies").glob("*.yaml"))


@pytest.fixture
def opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Opened:
    """Open a study from its text, and others beside it by name."""
    monkeypatch.chdir(tmp_path)

    def open_text(text: str, **others: str) -> OpenStudy:
        for name, other in {"trial": text, **others}.items():
            Path(f"{name}.yaml").write_text(other, encoding="utf-8")
        return open_study(Path("trial.yaml"))

    return open_text


@pytest.mark.parametrize("path", SHIPPED, ids=[p.stem for p in SHIPPED])
def test_shipped_study_opens_and_expands(path: Path) -> None:
    study = open_study(path)
    assert study.name == path.stem
    assert study.study.title
    runs = [run for run in expand(study) if run.part == "sweep"]
    assert len(runs) == study.study.sweep.number_of_points * study.study.replicates


def test_shipped_studies_are_what_they_are_named() -> None:
    names = {p.stem for p in SHIPPED}
    assert {"tube_3d_small", "tube_demo", "tube_frequency", "tube_paper"} <= names
    demo, frequency, paper, small = (
        expand(open_study(ROOT / "config" / "studies" / f"{name}.yaml"))
        for name in ("tube_demo", "tube_frequency", "tube_paper", "tube_3d_small")
    )
    key = "vibration.0.frequency_hz"
    assert len({r.parameters[key] for r in demo}) >= 3
    assert {r.replicate for r in demo} >= {1, 2, 3}
    # The sweep may run on the solver of the house, one point always on LAMMPS too.
    assert {r.part for r in demo if r.scenario.engine.name == "lammps"} == {"cross_check"}
    assert min(r.parameters[key] for r in frequency) <= 15
    assert max(r.parameters[key] for r in frequency) >= 150
    assert {r.replicate for r in frequency} == {1, 2, 3, 4, 5}
    stage = paper[0].scenario.vibration[0]
    assert sum(layer.count or 0 for layer in paper[0].scenario.fill.each_layer()) == 64_000
    assert (stage.frequency_hz, stage.acceleration_g, stage.duration_s) == (50, 1.5, 40)
    assert small[0].scenario.dimension == 3
    assert sum(layer.count or 0 for layer in small[0].scenario.fill.each_layer()) == 2000


def test_demo_is_a_practitioners_study_of_at_most_twelve_lines() -> None:
    text = (ROOT / "config" / "studies" / "tube_demo.yaml").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 12


def test_demo_is_thirty_runs_and_two_of_lammps() -> None:
    opened = open_study(ROOT / "config" / "studies" / "tube_demo.yaml")
    runs = expand(opened)
    engines = [run.scenario.engine.name for run in runs]
    assert engines.count("lammps") == 2
    assert len(runs) - 2 <= 30
    shaken_s = {run.scenario.vibration[0].duration_s for run in runs
                if run.scenario.engine.name == "lammps"}  # fmt: skip
    assert shaken_s == {0.5}


@pytest.mark.parametrize("path", sorted((ROOT / "config").glob("s*/*.yaml")), ids=lambda p: p.stem)
def test_shipped_file_gives_an_editor_its_schema(path: Path) -> None:
    first = path.read_text(encoding="utf-8").splitlines()[0]
    assert first == "# yaml-language-server: $schema=../schema.json"


def test_what_is_not_given_keeps_its_default(opened: Opened) -> None:
    assert opened("{}").study.scenario == Scenario()


def test_part_of_a_section_leaves_the_rest_of_its_default(opened: Opened) -> None:
    study = opened("scenario: {contact: {grain_wall: {friction: 0.5}}}").study
    law = study.scenario.contact.grain_wall
    assert law == WALL_LAW.model_copy(update={"friction": 0.5})


def test_bases_lie_below_and_the_material_below_them_all(opened: Opened) -> None:
    study = opened(
        "based_on: middle\nscenario: {sand: {size_classes: 3}}",
        middle="based_on: bottom\nmaterial: wet\nscenario: {sand: {size_scale: 5}}",
        bottom="material: rojek_2004\nscenario: {sand: {size_scale: 9, size_classes: 2}}",
        wet="sand:\n  density_kg_m3: {value: 2000, unit: kg/m3, source: a sack}\n"
        "  size_scale: 7\n  size_classes: 4",
    )
    sand = study.study.scenario.sand
    assert (sand.density_kg_m3, sand.size_scale, sand.size_classes) == (2000, 5, 3)
    assert study.origin.file_of("scenario.sand.density_kg_m3") == "wet.yaml"
    assert study.origin.source_of("scenario.sand.density_kg_m3") == "a sack"
    assert study.origin.file_of("scenario.sand.size_scale") == "middle.yaml"
    assert study.origin.source_of("scenario.sand.size_scale") == "middle.yaml"
    assert study.origin.file_of("scenario.sand.size_classes") == "trial.yaml"
    assert study.origin.source_of("scenario.sand.disc_thickness_m") is None


def test_material_can_be_taken_off(opened: Opened) -> None:
    study = opened(
        "based_on: bottom\nmaterial: null",
        bottom="material: wet",
        wet="sand: {density_kg_m3: 2000}",
    )
    assert study.study.scenario.sand.density_kg_m3 == Scenario().sand.density_kg_m3


def test_own_sweep_replaces_that_of_the_base(opened: Opened) -> None:
    study = opened(
        "based_on: bottom\nsweep: {keys: {sand.size_classes: [2, 3]}}",
        bottom="sweep: {design: zipped, keys: {sand.size_scale: [4, 5, 6]}}",
    )
    assert study.study.sweep.swept == ["sand.size_classes"]
    assert study.study.sweep.design == "grid"


def test_study_may_have_the_name_of_the_scenario_it_is_based_on(
    tmp_path: Path,
) -> None:
    path = tmp_path / "tube.yaml"
    path.write_text("based_on: tube\nreplicates: 2", encoding="utf-8")
    study = open_study(path)
    assert study.study.replicates == 2
    assert study.study.scenario.obstacles[0].name == "tube"


def test_unit_of_a_swept_value_is_checked_too(opened: Opened) -> None:
    good = opened(
        "based_on: tube\nsweep: {keys: {vibration.0.frequency_hz: "
        "{value: [25, 50], unit: Hz, source: shaker}}}"
    )
    assert good.study.sweep.keys["vibration.0.frequency_hz"] == (25, 50)
    assert good.study.scenario.vibration[0].frequency_hz == 50
    with pytest.raises(BadInputError, match="valid is the unit of the key, Hz"):
        opened(
            "based_on: tube\nsweep: {keys: {vibration.0.frequency_hz: "
            "{value: [25, 50], unit: rpm, source: shaker}}}"
        )


def test_names_in_messages_hide_the_machine(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    demo = ROOT / "config" / "studies" / "tube_demo.yaml"
    assert display_path(demo) == "config/studies/tube_demo.yaml"
    monkeypatch.chdir(tmp_path)
    assert display_path(demo) == "config/studies/tube_demo.yaml"
    assert display_path(tmp_path / "a.yaml") == "a.yaml"
    assert display_path(Path("../a.yaml")) == "../a.yaml"


@pytest.mark.parametrize(
    "text",
    [
        "scenario: {pattern: {shape: {kind: file, file: ../mesh/arch.vtu}}}",
        "scenario: {pattern: {shape: {kind: file, file: {value: ../mesh/arch.vtu}}}}",
        "sweep: {keys: {pattern.shape.file: [../mesh/arch.vtu]}}",
    ],
)
def test_a_pattern_s_mesh_is_seen_from_the_file_that_names_it(tmp_path: Path, text: str) -> None:
    tree = _named_from_root(yaml.safe_load(text), tmp_path / "config", {})
    (file,) = re.findall(r"[^' ]+arch.vtu", str(tree))
    assert (ROOT / file).resolve() == tmp_path / "mesh" / "arch.vtu"
