"""The loop by files against the loop in memory, and what is told of files that cannot be used."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.driver import Driver
from sandmould.kinds.sand.bending import verdict_of
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.exchange import PATTERN, read_loads, read_pattern, read_solution
from sandmould.pattern_fe.coupling.files_body import EXCHANGE
from sandmould.pattern_fe.coupling.from_files import solve_all
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.pattern_fe.coupling.shapes_file import SHAPES, read_shapes
from sandmould.pattern_fe.scene import pattern_of
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.scenario.scenario import Scenario
from tests.patterns import _one_thread  # noqa: F401
from tests.workflow.runs import drive

SCENE: dict[str, Any] = {
    "box": {"width_m": 0.06, "height_m": 0.06},
    "sand": {"size_scale": 8.0, "size_classes": 2, "disc_thickness_m": 0.1},
    # Sand falls for 10 ms, and rests by the rule at the first check after it: eight windows.
    "fill": {
        "layers": [{"count": 30, "repeat": 2}],
        "drop_height_m": 0.0005,
        "settling": {"shortest_s": 0.012},
    },
    "time_step": {"fraction": 0.4},
    "vibration": [],
    "rest": {"check_every_s": 0.008, "rms_speed_m_s": 10.0, "load_tolerance": None, "checks": 1},
    "record": {"series_every_s": 0.008, "checkpoint_every_s": 0.008},
    "engine": {"name": "reference"},
}
PLANK: dict[str, Any] = {
    "shape": {"kind": "bar", "width_m": 0.04, "height_m": 0.005},
    "position_m": [0.01, 0.01],
    "supports": {"clamped": ["left"]},
}


def plank_scene(exchange: str, statics: str = "linear") -> Scenario:
    loop = {"scheme": "aitken", "window_s": 0.004, "repeats": 1, "exchange": exchange}
    pattern = {**PLANK, "loop": loop, "statics": statics}
    return with_surface(Scenario.model_validate({**SCENE, "pattern": pattern}))


def driver(*arguments: Any) -> Driver:
    return Driver(*arguments, open_coupled)


def by_files(folder: Path, statics: str = "linear") -> tuple[RunOutcome, int]:
    """Sand and pattern in turn until the run is over: its outcome, and how often it stopped."""
    for stops in range(200):
        outcome = drive(plank_scene("files", statics), folder, driver)
        if outcome.outcome is not Outcome.AWAITS_PATTERN:
            return outcome, stops
        assert len(solve_all(folder / EXCHANGE)) == 1
    raise AssertionError("it does not end")


@pytest.mark.parametrize("statics", ["linear", "large"])
def test_loop_by_files_is_the_loop_in_memory(statics: str, tmp_path: Path) -> None:
    memory, files = tmp_path / "memory", tmp_path / "files"
    for folder in (memory, files):
        folder.mkdir()
    assert drive(plank_scene("memory", statics), memory, driver).outcome is Outcome.FINISHED
    outcome, stops = by_files(files, statics)
    assert outcome.outcome is Outcome.FINISHED
    one, two = (read_convergence_log(folder / CONVERGENCE_LOG) for folder in (memory, files))
    assert stops == one["passes"].sum()
    assert one.displacement_m.iloc[-1] > 1e-6
    # Mesh, loads and answers are written digit by digit.
    np.testing.assert_array_equal(two.drop(columns="solve_s"), one.drop(columns="solve_s"))
    vertices = len(pattern_of(plank_scene("memory")).surface.outer.vertices_m)
    shapes = [read_shapes(f / SHAPES, vertices, 2)[1] for f in (memory, files)]
    np.testing.assert_array_equal(*shapes)


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run that has stopped at its first window with sand on the plank."""
    folder = tmp_path_factory.mktemp("stopped")
    for _ in range(10):
        outcome = drive(plank_scene("files"), folder, driver)
        assert outcome.outcome is Outcome.AWAITS_PATTERN
        loads = sorted((folder / EXCHANGE).glob("loads_*.tsv"))[-1]
        pattern, _, _ = read_pattern(folder / EXCHANGE)
        if read_loads(loads, pattern.surface.outer)[0].any():
            return folder
        solve_all(folder / EXCHANGE)
    raise AssertionError("no sand fell on the plank")


@pytest.fixture
def asked(stopped: Path, tmp_path: Path) -> Path:
    """Exchange folder of a copy of that run."""
    return shutil.copytree(stopped, tmp_path / "run") / EXCHANGE


def test_command_answers_from_the_folder_alone(asked: Path, tmp_path: Path) -> None:
    alone = tmp_path / "elsewhere"
    asked.rename(alone)
    command = [sys.executable, "-m", "sandmould.pattern_fe.coupling.from_files", str(alone)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "1 answers written" in said
    pattern, _, _ = read_pattern(alone)
    outer = pattern.surface.outer
    answer = read_solution(sorted(alone.glob("answer_*.tsv"))[-1], outer)
    loads = sorted(alone.glob("loads_*.tsv"))[-1]
    load_n, _ = read_loads(loads, outer)
    np.testing.assert_allclose(answer.reaction_n, -load_n.sum(axis=0), rtol=1e-9)
    # Clapeyron: the loads' work is twice the stored energy.
    work_j = (load_n * answer.displacement_m).sum()
    assert answer.energy_j == pytest.approx(0.5 * work_j, rel=1e-9)
    assert "pressure_pa" in loads.read_text()


@pytest.mark.parametrize(
    ("was", "now", "says"),
    [
        (r"\t[^\t\n]+\n$", "\t\n", "is not a whole table of numbers"),
        (r"[^\n]+\n$", "", r"has \d+ vertices; valid are the pattern's"),
        (r"\t[^\t\n]+\n$", "\tnan\n", "number that is not finite at vertex"),
        (r"\n0.01\t", "\n0.02\t", r"has vertex \d+ at \(0.02, .* valid is where it is drawn"),
        ("# time_s: ", "# time: ", "has no line '# time_s: value'"),
        ("force_x_n", "force_x_kn", "has columns .*force_x_kn"),
    ],
)
def test_damaged_loads_are_told(was: str, now: str, says: str, asked: Path) -> None:
    loads = sorted(asked.glob("loads_*.tsv"))[-1]
    told = loads.read_text()
    damaged = re.sub(was, now, told, count=1)
    assert damaged != told
    loads.write_text(damaged)
    with pytest.raises(ValueError, match=says):
        solve_all(asked)


def test_pattern_file_without_a_key_is_told(asked: Path) -> None:
    path = asked / PATTERN
    path.write_text(path.read_text().replace("young_modulus_pa", "young"))
    with pytest.raises(ValueError, match="has no key 'young_modulus_pa'"):
        solve_all(asked)
    path.unlink()
    with pytest.raises(ValueError, match=r"pattern\.yaml: file = 'No such file or directory'"):
        solve_all(asked)


def test_run_goes_on_once_a_damaged_answer_is_replaced(asked: Path) -> None:
    (answer,) = solve_all(asked)
    told = answer.read_text()
    answer.write_text(told.replace("energy_j", "energy"))
    stopped = drive(plank_scene("files"), asked.parent, driver)
    assert stopped.outcome is Outcome.AWAITS_PATTERN
    assert "has no line '# energy_j: value'" in stopped.detail
    answer.write_text(told)
    assert "is not there" in drive(plank_scene("files"), asked.parent, driver).detail


def test_loads_of_another_run_are_asked_anew(asked: Path) -> None:
    (answer,) = solve_all(asked)
    loads = sorted(asked.glob("loads_*.tsv"))[-1]
    fresh = loads.read_text()
    loads.write_text(re.sub(r"\n(\S+\t\S+)\t\S+", r"\n\1\t1.0", fresh, count=2))
    drive(plank_scene("files"), asked.parent, driver)
    assert not answer.exists()
    assert loads.read_text() == fresh


def test_an_answer_through_the_floor_is_told(asked: Path) -> None:
    (answer,) = solve_all(asked)
    head, rows = answer.read_text().rsplit("contact_y_n\n", 1)
    lower = [line.split("\t") for line in rows.splitlines()]
    for row in lower:
        row[3] = "-0.02"
    answer.write_text(head + "contact_y_n\n" + "\n".join("\t".join(r) for r in lower) + "\n")
    stopped = drive(plank_scene("files"), asked.parent, driver)
    assert stopped.outcome is Outcome.AWAITS_PATTERN
    assert "leads 0.01 m into floor, walls or obstacles" in stopped.detail


def test_another_program_may_leave_out_forces_of_contact(asked: Path) -> None:
    (answer,) = solve_all(asked)
    outer = read_pattern(asked)[0].surface.outer
    found = read_solution(answer, outer)
    answer.write_text(re.sub(r"(\t[^\t\n]+){2}$", "", answer.read_text(), flags=re.MULTILINE))
    np.testing.assert_array_equal(read_solution(answer, outer).displacement_m, found.displacement_m)


def test_foam_too_soft_for_its_load_ends_the_run_in_a_sentence(tmp_path: Path) -> None:
    tree = plank_scene("memory", "large").model_dump(mode="json")
    tree["pattern"] |= {"young_modulus_pa": 30.0}
    outcome = drive(with_surface(Scenario.model_validate(tree)), tmp_path, driver)
    assert outcome.outcome is Outcome.NO_EQUILIBRIUM
    assert re.match(r"after .* s the pattern finds no equilibrium beyond", outcome.detail)
    found = verdict_of(tmp_path)
    assert found is None or found.state == "diverged"
