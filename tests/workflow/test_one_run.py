"""One run by LAMMPS from its folder: settling, loads, guards, engine errors, ranks."""

from __future__ import annotations

import fcntl
import math
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould.engines.guard import grain_masses_kg
from sandmould.engines.program import build_program
from sandmould.engines.session import RefusedError, StepMover
from sandmould.engines.snapshot import stored_snapshots
from sandmould.execution.jobs import compute_run
from sandmould.execution.locks import computing
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import read_costs
from sandmould.scenario.scenario import Scenario
from tests.scenes import open_lammps, tube_scene
from tests.workflow.runs import computed, drive, last_snapshot, run_folder


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute the small scene without a stop."""
    return computed(tube_scene(), tmp_path_factory.mktemp("straight"))


def test_run_leaves_all_its_products_and_no_work(straight: Path) -> None:
    names = {p.name for p in straight.iterdir()}
    assert {"outcome.json", "products.json", "series.tsv", "loads.tsv",
            "snapshots.npz", "engine.log", "deck.in"} <= names  # fmt: skip
    assert "work" not in names
    outcome = RunOutcome.read(straight / "outcome.json")
    assert outcome.outcome is Outcome.FINISHED
    cost = read_costs([straight]).rows.iloc[0]
    assert cost.grains == 120
    assert 60 * cost.steps < cost.grain_steps < 120 * cost.steps
    assert 0 < cost.engine_wall_s < cost.wall_s
    assert cost.time_step_fraction == pytest.approx(tube_scene().time_step.fraction)


def test_next_layer_enters_only_when_speed_and_loads_say_that_the_last_one_rests(
    straight: Path,
) -> None:
    series = pd.read_csv(straight / "series.tsv", sep="\t")
    loads = pd.read_csv(straight / "loads.tsv", sep="\t")
    scene = tube_scene()
    program = build_program(scene)
    for layer, grains in ((1, 60), (2, 120)):
        rows = series[series.stage == f"settle_{layer}"]
        assert set(rows.grains) == {grains}
        assert rows.rms_speed_m_s.iloc[-1] < scene.rest.rms_speed_m_s
        # It ends there, and not when it must.
        assert rows.time_s.iloc[-1] - rows.time_s.iloc[0] < 0.5 * scene.fill.settling.longest_s
        support_n = -loads[loads.time_s == rows.time_s.iloc[-1]].force_y_n.sum()
        weight_n = program.mass_kg(layer) * scene.gravity_m_s2
        # rest.load_tolerance
        assert support_n == pytest.approx(weight_n, rel=0.01)


def test_vibration_has_snapshots_at_both_its_ends(straight: Path) -> None:
    times = [stored.load().vibration_time_s for stored in stored_snapshots(straight)]
    assert 0.0 in times
    assert times[-1] == pytest.approx(0.06, abs=5 * tube_scene().step_s)


def test_weight_of_a_bed_at_rest_is_the_load_on_floor_walls_and_tube(tmp_path: Path) -> None:
    scene = tube_scene(
        fill={"layers": [{"count": 100}], "settling": {"longest_s": 4.0}},
        rest={"rms_speed_m_s": 1e-5},
        vibration=[],
    )
    session = open_lammps(scene, tmp_path)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    while not session.stage_over:
        session.advance()
    loads = session.surface_loads()
    weight = grain_masses_kg(scene, session.snapshot()).sum() * scene.gravity_m_s2
    session.close()
    assert session.at_rest
    assert loads is not None
    vertical = sum(force[1] for force in loads.values())
    assert vertical == pytest.approx(-weight, rel=1e-3)
    assert loads["tube_upper"][1] < 0  # the tube carries a part, pressed down
    sideways = sum(force[0] for force in loads.values())
    assert abs(sideways) < 1e-3 * weight
    assert loads["left"][0] < 0 < loads["right"][0]  # the sand pushes both walls outwards


@pytest.mark.parametrize(
    ("changes", "outcome", "says"),
    [
        ({"guard": {"largest_overlap_fraction": 0.01}}, Outcome.OVERLAP_TOO_LARGE, "0.01"),
        ({"fill": {"layers": [{"count": 60}], "settling": {"longest_s": 0.06}}},
         Outcome.NOT_SETTLED, "layer 1"),
        ({"contact": {"grain_wall": {"normal_stiffness_n_m": 5.0}}, "guard":
          {"largest_overlap_fraction": 2.0}}, Outcome.LOST_GRAINS, "centre in or behind a wall"),
    ],
)  # fmt: skip
def test_guards_end_a_run_with_the_outcome_that_fits(
    changes: dict[str, Any], outcome: Outcome, says: str, tmp_path: Path
) -> None:
    ended = drive(tube_scene(**changes), tmp_path)
    assert ended.outcome is outcome
    assert says in ended.detail
    assert (tmp_path / "outcome.json").exists()
    assert (tmp_path / "series.tsv").exists()


def test_time_step_past_the_critical_one_is_called_unstable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A step that the checks would refuse, so that the guard has something to catch.
    monkeypatch.setattr(Scenario, "step_s", property(lambda s: 4 * s.critical_step.step_s))
    ended = drive(tube_scene(guard={"largest_overlap_fraction": 2.0}), tmp_path)
    assert ended.outcome in (Outcome.UNSTABLE, Outcome.LOST_GRAINS, Outcome.OVERLAP_TOO_LARGE)


def test_two_ranks_fill_the_same_bed(straight: Path, tmp_path: Path) -> None:
    scene = tube_scene(engine={"ranks": 2})
    folder = run_folder(scene, tmp_path)
    compute_run(folder, str(tmp_path / "log"), 2, "mpiexec")
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.FINISHED, outcome.detail
    # Sums run in another order, so grains part after a few collisions. Mean heights of so few
    # grains are 0.0173 to 0.0202 m with four seeds.
    one, two = last_snapshot(straight), last_snapshot(folder)
    assert len(two.id) == 120
    assert two.position_m[:, 1].mean() == pytest.approx(one.position_m[:, 1].mean(), rel=0.25)


@pytest.mark.parametrize(
    ("command", "says"),
    [("no_such_command", "no_such_command"), ('shell "kill -SEGV $PPID"', "status -11")],
)
def test_engine_error_and_crash_leave_an_outcome(command: str, says: str, tmp_path: Path) -> None:
    folder = run_folder(tube_scene(), tmp_path)
    broken = f"#--- block: header --- broken\n{command}\n#--- end: header ---\n"
    (folder / "deck.in").write_text(broken)
    compute_run(folder, str(tmp_path / "log"), 1, "mpiexec")
    ended = RunOutcome.read(folder / "outcome.json")
    assert ended.outcome is Outcome.ENGINE_FAILED
    assert says in ended.detail
    assert (folder / "series.tsv").exists()


def test_a_second_process_waits_for_the_first_and_takes_its_outcome(tmp_path: Path) -> None:
    folder = run_folder(tube_scene(), tmp_path)
    kept = RunOutcome(Outcome.FINISHED, "by the first", 1.0, 1.0)
    with (folder / "lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)

        def finish_and_release() -> None:
            kept.write(folder / "outcome.json")
            file.close()

        threading.Timer(0.5, finish_and_release).start()
        with computing(folder):
            assert RunOutcome.read(folder / "outcome.json").detail == "by the first"
    compute_run(folder, str(tmp_path / "log"), 1, "mpiexec")
    assert RunOutcome.read(folder / "outcome.json").detail == "by the first"


def test_session_advances_by_a_duration_in_a_folder_with_spaces(tmp_path: Path) -> None:
    folder = tmp_path / "a study of ours"
    folder.mkdir()
    scene = tube_scene(fill={"layers": [{"count": 20}]})
    session = open_lammps(scene, folder)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    session.advance(0.0123)
    steps = session.steps
    session.advance()
    session.write_checkpoint(folder)
    restored = open_lammps(scene, folder, checkpoint=folder)
    assert steps == math.ceil(0.0123 / scene.step_s)
    assert session.steps == restored.steps > steps
    with pytest.raises(RefusedError, match="a polygon or a mesh on engine lammps"):
        session.move_surface("floor", np.zeros((2, 2)), 0.01)
    with pytest.raises(RefusedError, match="a polygon or a mesh on engine lammps"):
        session.attach_mover("floor", StepMover(0, 0, np.zeros((2, 2)), np.zeros((2, 2))))
    session.close()
    restored.close()
