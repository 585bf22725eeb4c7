"""One run by LAMMPS killed or stopped and taken up again: it ends as if nothing had happened."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould import ROOT
from sandmould.engines.driver import Driver
from sandmould.engines.program import build_program
from sandmould.engines.snapshot import stored_snapshots
from sandmould.execution.simulate import RESTARTABLE_EXIT
from sandmould.runs.checkpoint_folders import newest_checkpoint
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import read_costs
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.scenes import open_lammps, tube_scene
from tests.workflow.runs import (
    SOON,
    computed,
    kill_after_a_checkpoint,
    last_snapshot,
    run_folder,
    simulate,
)


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute the small scene without a stop."""
    return computed(tube_scene(rest=SOON), tmp_path_factory.mktemp("straight"))


def _state(folder: Path) -> dict[str, Any]:
    snapshot = last_snapshot(folder)
    return {"position": snapshot.position_m, "velocity": snapshot.velocity_m_s,
            "spin": snapshot.spin_rad_s}  # fmt: skip


def test_killed_run_resumes_and_ends_as_if_never_stopped(straight: Path, tmp_path: Path) -> None:
    folder = run_folder(tube_scene(rest=SOON), tmp_path)
    kill_after_a_checkpoint(folder)
    assert simulate(folder) == 0
    for name, values in _state(straight).items():
        np.testing.assert_array_equal(values, _state(folder)[name])
    for table in ("series.tsv", "loads.tsv"):
        assert (folder / table).read_text() == (straight / table).read_text()
    assert len(stored_snapshots(folder)) == len(stored_snapshots(straight))
    costs = [read_costs([f]).rows.iloc[0] for f in (straight, folder)]
    assert costs[0].grain_steps == costs[1].grain_steps


def test_damaged_checkpoint_is_told_and_the_run_starts_from_the_one_before(
    tmp_path: Path,
) -> None:
    scene = tube_scene(rest=SOON, guard={"wall_limit_s": 0.5})
    folder = run_folder(scene, tmp_path)
    assert simulate(folder) == RESTARTABLE_EXIT
    assert RunOutcome.read(folder / "work" / "outcome.json").outcome is Outcome.OUT_OF_WALL_TIME
    newest = max(folder.glob("work/checkpoint_*/lammps.restart"), key=lambda p: p.stat().st_mtime)
    newest.write_bytes(newest.read_bytes()[:1000])
    program = build_program(tube_scene(rest=SOON))
    outcome = Driver(program, folder, "test", scenario_hash(scene)).run()
    assert outcome.outcome is Outcome.FINISHED
    assert "cannot be used" in outcome.detail


def test_checkpoint_of_another_scenario_is_left_alone(tmp_path: Path) -> None:
    folder = run_folder(tube_scene(rest=SOON, guard={"wall_limit_s": 0.5}), tmp_path)
    assert simulate(folder) == RESTARTABLE_EXIT
    newest, _ = newest_checkpoint(folder / "work")
    assert newest is not None
    kept = {p.name: p.read_bytes() for p in newest[0].iterdir()}
    other = Driver(build_program(tube_scene(rest=SOON)), folder, "test", "another").run()
    assert other.outcome is Outcome.FINISHED
    assert "checkpoints of another scenario were set aside" in other.detail
    (aside,) = folder.glob("checkpoints_of_*")
    assert {p.name: p.read_bytes() for p in (aside / newest[0].name).iterdir()} == kept


def test_paper_size_tube_starts_stops_and_resumes(tmp_path: Path) -> None:
    run = expand(open_study(ROOT / "config" / "studies" / "tube_paper.yaml"))[0]
    assert sum(build_program(run.scenario).counts) == 64_000
    guard = run.scenario.guard.model_copy(update={"wall_limit_s": 0.1})
    folder = run_folder(run.scenario.model_copy(update={"guard": guard}), tmp_path)
    steps = []
    for _ in range(2):
        assert simulate(folder) == RESTARTABLE_EXIT
        newest, damaged = newest_checkpoint(folder / "work")
        assert newest is not None
        assert not damaged
        steps.append(newest[1].steps)
    assert 0 < steps[0] < steps[1]
    assert newest[1].cost["grains"] == 8000


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"frame": "laboratory"},
        {
            "dimension": 3,
            "box": {"depth_m": 0.06},
            "time_step": {"fraction": 0.9},
            "fill": {"layers": [{"count": 60}]},
            "rest": {"rms_speed_m_s": 0.3},
        },
    ],
    ids=["box", "laboratory", "3D with turned facets"],
)
@pytest.mark.parametrize("place", [-2, -1], ids=["vibrating", "stopping"])
def test_restored_session_equals_the_one_that_wrote_the_checkpoint(
    place: int, changes: dict[str, Any], tmp_path: Path
) -> None:
    scene = tube_scene(**changes)
    session = open_lammps(scene, tmp_path)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    while not session.stage_over:
        session.advance()
    session.end_stage()
    session.start_stage(session._program.stages[place])
    while not session.can_checkpoint:
        session.advance()
    session.write_checkpoint(tmp_path)
    restored = open_lammps(scene, tmp_path, checkpoint=tmp_path)
    steps = session.steps
    while session.steps < steps + 1000 and not session.stage_over:
        session.advance()
        restored.advance()
    one, two = session.snapshot(), restored.snapshot()
    loads = session.surface_loads(), restored.surface_loads()
    session.close()
    restored.close()
    assert one.time_s == two.time_s
    np.testing.assert_equal(one.vibration_time_s, two.vibration_time_s)
    for name in ("position_m", "velocity_m_s", "spin_rad_s"):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=0, atol=1e-9)
    for surface, force in (loads[0] or {}).items():
        np.testing.assert_allclose(force, (loads[1] or {})[surface], atol=1e-6)
