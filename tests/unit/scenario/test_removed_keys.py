"""Keys that are no more: dropped where they state what holds anyway, else one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from sandmould.bad_input import BadInputError
from sandmould.scenario.standing_keys import holds_anyway, instead_of, removed_keys
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import OpenStudy, open_study

TUBE = {
    "kind": "tube", "diameter_m": 0.054, "length_m": 0.09, "wall_thickness_m": 0.006,
    "left_end_x_m": 0.09, "axis_height_m": 0.054, "facets": 4,
}  # fmt: skip
BAR = {"kind": "bar", "width_m": 0.08, "height_m": 0.01}
CASES: list[tuple[str, str, Any, Any]] = [
    ("tube_quick", "scenario.guard.kinetic_energy_factor", 5, 9),
    ("tube_quick", "scenario.fill.nominal_solid_fraction", None, 0.7),
    ("tube_quick", "scenario.record.export", "moments", "all"),
    ("tube_quick", "scenario.time_step.coordination", None, 4),
    ("tube_quick", "objective.at_vibration_s", None, 0.2),
    ("tube_quick", "equivalence.confidence", 0.9, 0.95),
    ("tube_certified", "certificate.ratio", 1.41, 2),
    ("repose_scale", "scenario.discharge.settling", {"longest_s": 20}, {"longest_s": 9}),
    ("tank_small", "certificate", {"controls": []}, {"controls": ["hold"]}),
    ("tank_small", "material", None, "rojek_2004"),
    ("tank_small", "replicates", 1, 2),
    ("tank_small", "scenario.gradient", "least", "sum"),
    ("tank_small", "scenario.probes", [], [{"name": "a", "at_m": [0.01, 0.01]}]),
    ("l_pattern", "scenario.pattern.loop.exchange", "memory", "files"),
    ("l_pattern", "scenario.pattern.loop.limit_share", 0.5, 0.9),
    ("shoulder_pour", "scenario.case.starts", "empty", "full"),
    ("plates_small", "scenario.stepping", "local", "super"),
    ("plates_small", "scenario.refuse_ratio", True, False),
]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages name files as seen from here."""
    monkeypatch.chdir(tmp_path)


def opened(folder: Path, based_on: str, path: str = "", value: Any = None) -> OpenStudy:
    """Open a study that changes one key of another one."""
    tree: Any = {}
    if path:
        tree = value
        for part in reversed(path.split(".")):
            tree = {part: tree}
    file = folder / "trial.yaml"
    file.write_text(yaml.safe_dump({"based_on": based_on} | tree))
    return open_study(file)


def refusal(folder: Path, based_on: str, path: str, value: Any) -> str:
    """The one line that a study is refused with."""
    with pytest.raises(BadInputError) as refused:
        opened(folder, based_on, path, value)
    (problem,) = refused.value.problems
    return str(problem)


@pytest.mark.parametrize(("based_on", "path", "holds", "other"), CASES, ids=[c[1] for c in CASES])
def test_what_holds_anyway_is_dropped_and_anything_else_told(
    tmp_path: Path, based_on: str, path: str, holds: Any, other: Any
) -> None:
    plain = opened(tmp_path, based_on)
    stated = opened(tmp_path, based_on, path, holds)
    assert stated.study == plain.study
    assert [run.run for run in expand(stated)] == [run.run for run in expand(plain)]
    line = refusal(tmp_path, based_on, path, other)
    assert line.startswith(f"trial.yaml: {path} = ")
    assert line.endswith(f" cannot be used: valid is {removed_keys()[path][1]}.")


def test_keys_in_lists_are_found_by_their_path_without_the_place(tmp_path: Path) -> None:
    key = "scenario.obstacles"
    assert opened(tmp_path, "tube_3d_small", key, [TUBE | {"axis_y_m": None}]).study == (
        opened(tmp_path, "tube_3d_small", key, [TUBE]).study
    )
    line = refusal(tmp_path, "tube_3d_small", key, [TUBE | {"axis_y_m": 0.05}])
    assert line.startswith("trial.yaml: scenario.obstacles.0.axis_y_m = 0.05 cannot be used: valid")
    assert removed_keys()["scenario.obstacles.axis_y_m"][1] in line


def test_kinds_that_are_no_more_are_told(tmp_path: Path) -> None:
    shape = BAR | {"kind": "t_shape"}
    line = refusal(tmp_path, "plank", "scenario.pattern.shape", shape)
    assert line.endswith(" cannot be used: valid is kind: file, with a T of a mesh file.")


def test_a_removed_key_cannot_be_swept(tmp_path: Path) -> None:
    keys = {"discharge.settling.longest_s": [5, 9]}
    line = refusal(tmp_path, "repose_scale", "sweep.keys", {"sand.size_scale": [1]} | keys)
    assert "sweep.keys.discharge.settling.longest_s = [5, 9]" in line
    assert removed_keys()["scenario.discharge.settling"][1] in line


def test_a_part_of_a_section_holds_and_a_key_of_the_same_end_is_another() -> None:
    settling = ["scenario", "discharge", "settling"]
    assert holds_anyway(settling, {"shortest_s": 0.2})
    assert not holds_anyway(settling, {"shortest_s": 0.2, "checks": 3})
    assert instead_of(settling)
    assert not instead_of(["scenario", "fill", "settling", "longest_s"])
    assert not instead_of(["refine", "replicates"])
