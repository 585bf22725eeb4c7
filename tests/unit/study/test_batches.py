"""Runs that share a job: which, and that none is computed again."""

from __future__ import annotations

import errno
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from sandmould.definition.run import LAST_MEASURED, Run
from sandmould.engines.registry import deck_hash
from sandmould.execution import jobs
from sandmould.execution.jobs import JobError
from sandmould.execution.pool import End
from sandmould.execution.simulate import RESTARTABLE_EXIT
from sandmould.kinds.registry import kind_of
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import read_manifest, save_manifest, write_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.batches import START_S, alone, is_done, plan_batches, planned_wall_s
from sandmould.study.plan.build_plan import Plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.lacking import WHOLE, Lack, Need, lack_of
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import read_run
from tests.planned import write_plan
from tests.workflow.runs import compute_all

FREQUENCY = "vibration.0.frequency_hz"
STUDY: dict[str, Any] = {
    "based_on": "tube",
    "scenario": {"engine": {"name": "reference"}},
    "sweep": {"keys": {FREQUENCY: [25, 50, 100]}},
    "replicates": 3,
}


def runs_of(folder: Path, **changes: Any) -> list[Run]:
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(STUDY | changes), encoding="utf-8")
    return expand(open_study(path))


def test_short_runs_share_a_job_until_it_lasts_long_enough(tmp_path: Path) -> None:
    runs = runs_of(tmp_path)
    found = plan_batches(runs, 3.5 * planned_wall_s(runs[0]))
    assert [len(batch.runs) for batch in found] == [4, 4, 1]
    assert [run for batch in found for run in batch.runs] == runs
    assert [batch.name for batch in found] == [runs[0].run, runs[4].run, runs[8].run]
    # A long run has a job of its own.
    assert len(plan_batches(runs, 0.5 * planned_wall_s(runs[0]))) == 9


def test_appended_runs_leave_full_jobs_as_they_were(tmp_path: Path) -> None:
    runs = runs_of(tmp_path)
    wall_s = 3.5 * planned_wall_s(runs[0])
    before, after = plan_batches(runs[:6], wall_s), plan_batches(runs, wall_s)
    assert after[0] == before[0]


def test_runs_of_other_engines_or_more_cores_have_jobs_of_their_own(tmp_path: Path) -> None:
    keys = {"engine.name": ["lammps", "reference"], "engine.ranks": [1, 2]}
    found = plan_batches(runs_of(tmp_path, sweep={"keys": keys}), 1e9)
    kinds = [{(r.scenario.engine.name, r.scenario.engine.ranks) for r in b.runs} for b in found]
    assert all(len(kind) == 1 for kind in kinds)
    assert len(found) == 4


def test_the_shortest_run_takes_its_start(tmp_path: Path) -> None:
    runs = runs_of(
        tmp_path, scenario={"sand": {"disc_thickness_m": 0.1}, "fill": {"layers": [{"count": 1}]}}
    )
    assert START_S < planned_wall_s(runs[0]) < START_S + 0.5


def test_a_job_of_several_cores_lasts_as_long_with_more_runs(tmp_path: Path) -> None:
    runs = runs_of(tmp_path)
    found = plan_batches(runs, 1.7 * planned_wall_s(runs[0]), cores=2)
    assert [(len(b.runs), b.side_by_side) for b in found] == [(4, 2), (4, 2), (1, 1)]
    # Runs of two threads leave room for one beside them, one of two MPI ranks for none.
    for engine, beside in (("reference", 2), ("lammps", 1)):
        runs = runs_of(tmp_path, scenario={"engine": {"name": engine, "ranks": 2}})
        assert plan_batches(runs, 1e9, cores=4)[0].side_by_side == beside


def test_batches_of_too_few_runs_are_left_to_jobs_of_their_own(tmp_path: Path) -> None:
    runs = tuple(runs_of(tmp_path))
    plan = Plan(open_study(tmp_path / "trial.yaml"), runs)
    batches = plan.batches(3.5 * planned_wall_s(runs[0]), least=2)
    assert [len(batch.runs) for batch in batches] == [4, 4]
    assert alone(runs, batches) == [runs[8].run]
    assert plan.batches(0.5 * planned_wall_s(runs[0]), least=2) == []


def test_where_cores_are_free_all_end_together(tmp_path: Path) -> None:
    runs = runs_of(tmp_path)
    one_s = planned_wall_s(runs[0])
    found = plan_batches(runs, 3.5 * one_s, free_cores=2)
    # Three jobs would leave one core idle while the other has two.
    assert [len(batch.runs) for batch in found] == [2, 2, 3, 2]
    assert [run for batch in found for run in batch.runs] == runs
    # Fewer runs than would fill one job are shared out as well, but not into jobs of their own.
    assert [len(b.runs) for b in plan_batches(runs[:4], 100 * one_s, free_cores=2)] == [2, 2]
    few = plan_batches(runs[:5], 100 * one_s, free_cores=4, least=2)
    assert [len(batch.runs) for batch in few] == [2, 3]
    # Long runs have jobs of their own, and runs of two threads take two cores.
    assert len(plan_batches(runs, 0.5 * one_s, free_cores=2)) == 9
    wide = runs_of(tmp_path, scenario={"engine": {"name": "reference", "ranks": 2}})
    assert len(plan_batches(wide, 1e9, free_cores=4)) == 2


def test_what_is_left_of_a_study_is_shared_out_by_itself(tmp_path: Path) -> None:
    runs = tuple(runs_of(tmp_path))
    plan = Plan(open_study(tmp_path / "trial.yaml"), runs)
    lacking = {run.run for run in runs[2:6]}
    batches = plan.batches(100 * planned_wall_s(runs[0]), 2, free_cores=2, lacking=lacking)
    names = [[runs.index(run) for run in batch.runs] for batch in batches]
    assert names == [[0, 1, 6, 7, 8], [2, 3], [4, 5]]


class Jobs:
    """What a batch did, in place of an engine and in this process."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, stops: str = "") -> None:
        self.computed: list[str] = []
        self.measured: list[str] = []
        self.stops = stops
        monkeypatch.setattr(jobs, "do", self.do)
        monkeypatch.setattr(jobs, "start_server", lambda scenarios: None)
        monkeypatch.setattr(jobs, "render_run", self.render)
        monkeypatch.setattr(jobs, "_simulate", self.compute)
        monkeypatch.setattr(jobs, "measure_run", self.measure)

    def do(self, work: Callable[..., int | None], *given: Any, log: Path, name: str) -> End:
        try:
            return End(work(*given) or 0, "")
        except OSError as error:
            return End(1, str(error))

    def render(self, folder: Path, run: Run) -> None:
        (folder / "deck.in").write_text("run 1\n")

    def compute(self, folder: Path, ranks: int, mpi: str, run: Run) -> int:
        if folder.name == self.stops:
            return RESTARTABLE_EXIT
        self.computed.append(folder.name)
        origin = {"scenario_sha256": scenario_hash(run.scenario),
                  "template_sha256": deck_hash(run.scenario)}  # fmt: skip
        write_manifest(folder, "computed", {}, origin)
        RunOutcome(Outcome.FINISHED, "", 1.0, 1.0).write(folder / "outcome.json")
        return 0

    def measure(self, folder: Path, run: Run) -> None:
        self.measured.append(folder.name)
        (folder / LAST_MEASURED).touch()
        code = kind_of(run.scenario).planning.measured_by(run.scenario)
        write_manifest(folder, "measured", {LAST_MEASURED: 0}, code=code)


def planned(folder: Path, **changes: Any) -> list[Path]:
    runs = runs_of(folder, **changes)[:3]
    write_plan(runs, folder)
    return [folder / "runs" / run.run for run in runs]


def test_a_batch_goes_on_past_a_run_that_stopped_and_redoes_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folders = planned(tmp_path)
    names = [folder.name for folder in folders]
    first = Jobs(monkeypatch, stops=names[1])
    with pytest.raises(JobError, match=f"1 of 3 stopped or broke: {names[1]}"):
        compute_all(folders, tmp_path / "log")
    assert "stopped early" in capfd.readouterr().err
    assert first.computed == first.measured == [names[0], names[2]]
    again = Jobs(monkeypatch)
    compute_all(folders, tmp_path / "log")
    assert again.computed == again.measured == [names[1]]
    # What was computed and not measured is measured alone.
    (folders[0] / LAST_MEASURED).unlink()
    last = Jobs(monkeypatch)
    compute_all(folders, tmp_path / "log")
    assert (last.computed, last.measured) == ([], [names[0]])


def test_a_run_that_breaks_does_not_stop_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folders = planned(tmp_path)
    done = Jobs(monkeypatch)

    def measure(folder: Path, run: Run) -> None:
        if folder == folders[0]:
            raise OSError("no space left")
        done.measure(folder, run)

    monkeypatch.setattr(jobs, "measure_run", measure)
    with pytest.raises(JobError, match=f"1 of 3 stopped or broke: {folders[0].name}"):
        compute_all(folders, tmp_path / "log")
    assert f"{folders[0].name}: no space left" in capfd.readouterr().err
    assert done.measured == [folder.name for folder in folders[1:]]


def test_a_run_that_the_disk_refused_has_not_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = planned(tmp_path)[0]
    run = read_run(folder / "scenario.yaml")

    def full(folder: Path, run: Run) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "checkpoint.bin")

    monkeypatch.setattr(jobs, "simulate", full)
    assert jobs._simulate(folder, 1, "", run) == RESTARTABLE_EXIT
    said = f"{run.run}: the disk refused. [Errno 28] No space left on device: 'checkpoint.bin'\n"
    assert capfd.readouterr().err == said
    assert not (folder / "outcome.json").exists()


@pytest.mark.parametrize("status", [jobs.ASKED_EXIT, -signal.SIGTERM])
def test_a_job_that_is_asked_to_end_begins_no_other_run(
    status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders, begun = planned(tmp_path), []
    Jobs(monkeypatch)
    monkeypatch.setattr(jobs, "_simulate", lambda folder, *given: begun.append(folder) or status)
    with pytest.raises(JobError, match="3 of 3 stopped or broke"):
        compute_all(folders, tmp_path / "log")
    assert begun == folders[:1]


def test_runs_side_by_side_are_computed_once_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = planned(tmp_path)
    Jobs(monkeypatch, stops=folders[1].name)
    with pytest.raises(JobError, match=f"1 of 3 stopped or broke: {folders[1].name}"):
        compute_all(folders, tmp_path / "log", side_by_side=2)
    assert [is_done(folder) for folder in folders] == [True, False, True]
    Jobs(monkeypatch)
    compute_all(folders, tmp_path / "log", side_by_side=2)
    assert all(is_done(folder) for folder in folders)


def test_a_changed_scenario_or_solver_is_computed_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = planned(tmp_path)[0]
    run = read_run(folder / "scenario.yaml")
    assert lack_of(run, folder) == Lack(Need.COMPUTE)
    done = Jobs(monkeypatch)
    compute_all([folder], tmp_path / "log")
    assert lack_of(run, folder) == WHOLE
    manifest = read_manifest(folder)
    for key in ("scenario_sha256", "template_sha256"):
        save_manifest(folder, manifest | {"origin": manifest["origin"] | {key: "another"}})
        assert lack_of(run, folder).need is Need.COMPUTE
    compute_all([folder], tmp_path / "log")
    assert done.computed == done.measured == [folder.name] * 2
