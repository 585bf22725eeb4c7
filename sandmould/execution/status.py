"""Where a study stands: runs done, running, failed, time left and cost so far."""

from __future__ import annotations

import contextlib
import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from sandmould.bad_input import BadInputError, display_path
from sandmould.definition.run import Run
from sandmould.execution.cluster.driver import driver_lines
from sandmould.execution.cluster.queue import Job, Outlook, jobs_of, live_jobs, outlook, queue_lines
from sandmould.execution.locks import is_locked
from sandmould.execution.tidy import freed_bytes, orphans
from sandmould.plain_file import UNREADABLE, read_json
from sandmould.runs.claim import owner_of
from sandmould.runs.formatting import size_text
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import change, read_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import noted_s
from sandmould.runs.progress import duration_text
from sandmould.study.plan.announcement import stored_speeds
from sandmould.study.plan.build_plan import Plan
from sandmould.study.plan.lacking import WHOLE, Lack, Need
from sandmould.study.plan.plan_files import SUMMARY, changed_line, read_run
from sandmould.study.plan.price import TimeLeft
from sandmould.study.rounds.round_log import read_rounds

State = Literal["done", "failed", "running", "stopped", "waiting"]
STATES: tuple[State, ...] = ("done", "failed", "running", "stopped", "waiting")
LISTED_RUNS = 12


@dataclass(frozen=True)
class RunStatus:
    """Where one run stands."""

    run: str
    state: State
    said: str = ""
    """How it failed, how far it is, or what of it is lost."""
    cpu_s: float = 0.0
    share: float = 0.0
    """What is done of a run that has begun."""
    wall_s: float = math.nan
    """Of a run that is done."""


def run_status(folder: Path, lack: Lack, live: Collection[str] | None = None) -> RunStatus:
    """See where a run stands from what it has written, and what a start would do for it.

    ``live``: numbers of the jobs of the cluster that have not ended, where that is known.
    """
    name = folder.name
    if lack.need is Need.NOTHING:
        return _ended(folder)
    path = folder / "work" / "progress.json"
    said, share, cpu_s = "", 0.0, 0.0
    with contextlib.suppress(*UNREADABLE):
        now: dict[str, Any] = read_json(path)
        share = float(now["percent"]) / 100
        said = f"{now['percent']:.0f} %, {now['stage']}, {now['time_s']:.3g} s simulated"
        cpu_s = float(now["cpu_s"])
    owner = owner_of(folder)
    ended = owner is not None and owner.job and live is not None and owner.job not in live
    running = is_locked(folder) and not ended
    if not said:
        return RunStatus(name, "running" if running else "waiting", "" if running else lack.why)
    if running:
        where = f", {owner.text()}" if owner else ""
        return RunStatus(name, "running", f"{said}{where}", cpu_s, share=share)
    with contextlib.suppress(*UNREADABLE):
        said = f"{said}; {_why_stopped(folder / 'work' / 'outcome.json', path)}"
    return RunStatus(name, "stopped", said, cpu_s, share=share)


def _why_stopped(outcome: Path, progress: Path) -> str:
    """Why a run was stopped, by the outcome of its last start."""
    stopped = RunOutcome.read(outcome)
    is_of_before = outcome.stat().st_mtime_ns < progress.stat().st_mtime_ns
    if is_of_before or stopped.detail.endswith("the system asked"):
        return "stopped from outside, as by Ctrl-C"
    return stopped.outcome.label


def _ended(folder: Path) -> RunStatus:
    """A run with all that it leaves behind."""
    outcome = RunOutcome.read(folder / "outcome.json")
    cpu_s = wall_s = math.nan
    with contextlib.suppress(*UNREADABLE):
        cost = read_manifest(folder)["cost"]
        cpu_s, wall_s = float(cost["cpu_s"]), float(cost["wall_s"])
    cpu_s = cpu_s if math.isfinite(cpu_s) else 0.0
    if outcome.outcome is Outcome.FINISHED:
        return RunStatus(folder.name, "done", "", cpu_s, wall_s=wall_s)
    said = f"{outcome.outcome.label}. {outcome.detail}".strip()
    return RunStatus(folder.name, "failed", said, cpu_s)


def run_statuses(
    plan: Plan, results: Path, lacks: Mapping[str, Lack], live: Collection[str] | None
) -> dict[str, RunStatus]:
    """Where each run stands, by its name; the fills that runs share come first.

    A fill that no run waits for any more counts where it was computed.
    """
    folder = results / plan.study.name
    fills = [
        fill
        for fill in plan.fills
        if fill.run in lacks or (folder / fill.place / "outcome.json").exists()
    ]
    return {
        run.run: run_status(folder / run.place, lacks.get(run.run, WHOLE), live)
        for run in (*fills, *plan.runs)
    }


def status_text(plan: Plan, results: Path, cores: int, deep: bool = False) -> str:
    """Say where a study stands: done, running, failed, time left, cost so far.

    ``deep``: whether all files of runs that are done or failed are compared with their hashes.
    """
    folder = results / plan.study.name
    lacks, live = plan.lacks(results), live_jobs()
    statuses = run_statuses(plan, results, lacks, live)
    fills = [fill for fill in plan.fills if fill.run in statuses]
    lines = [f"{plan.study.name}: {_count(plan.runs, statuses)} of {len(plan.runs)} runs"]
    if any(statuses[fill.run].state != "done" for fill in fills):
        lines.append(f"{_count(fills, statuses)} of {len(fills)} fills that runs share")
    # Processes that were killed wrote nothing down, nor did those of older versions.
    now_s = sum(status.cpu_s for status in statuses.values() if status.state == "running")
    spent_s = max(noted_s(folder) + now_s, sum(status.cpu_s for status in statuses.values()))
    jobs = [] if live is None else jobs_of(statuses)
    left = _left(plan, statuses, lacks, cores, jobs)
    lines.append(f"processor time so far: {duration_text(spent_s)}; {left}")
    if live is not None:
        lines += [*driver_lines(plan.study.name), *queue_lines(jobs)]
    log = read_rounds(folder, plan.study.study)
    if plan.study.study.refine.rounds:
        ended = log.ended or f"of at most {plan.study.study.refine.rounds}"
        lines.append(f"rounds: {len(log.rounds)}, {ended}")
    for state in ("running", "stopped", "failed", "waiting"):
        # Of those that wait only what they lack is worth a line.
        chosen = [
            s for s in statuses.values() if s.state == state and (s.said or state != "waiting")
        ]
        lines += [f"  {state}: {s.run}  {s.said}".rstrip() for s in chosen[:LISTED_RUNS]]
        if len(chosen) > LISTED_RUNS:
            lines.append(f"  {state}: and {len(chosen) - LISTED_RUNS} more")
    if any(status.state == "failed" for status in statuses.values()):
        lines.append("a failed run is computed once more by: sandmould again RUN")
    if deep:
        whole = [run for run in (*fills, *plan.runs) if run.run not in lacks]
        lines += _deep_lines(whole, folder)
    if (folder / SUMMARY).exists() and (
        said := changed_line(plan.study.study, plan.study.path, folder)
    ):
        lines.append(said)
    return "\n".join([*lines, *_orphans(plan, results)])


def _deep_lines(runs: Sequence[Run], folder: Path) -> list[str]:
    """What the hashes say of files of runs that lack nothing by the sizes."""
    damaged: dict[str, str] = {}
    for run in runs:
        place = folder / run.place
        if why := change(place, read_manifest(place)) or _replanned(run, place / "scenario.yaml"):
            damaged[run.place] = why
    lines = [f"  damaged: {place}  {why}" for place, why in damaged.items()]
    if damaged:
        lines.append("remove a damaged file: the next start makes it again")
    else:
        lines.append(f"{len(runs)} runs and fills checked: no file is damaged")
    return lines


def _replanned(run: Run, path: Path) -> str:
    """Say that a run's file of its scenario says something else; empty where it does not."""
    with contextlib.suppress(BadInputError):
        if scenario_hash(read_run(path).scenario) == scenario_hash(run.scenario):
            return ""
    return f"{path.name} is not as the plan wrote it"


def _count(runs: Sequence[Run], statuses: dict[str, RunStatus]) -> str:
    """How many of some runs are in which state."""
    count = Counter(statuses[run.run].state for run in runs)
    return ", ".join(f"{count[state]} {state}" for state in STATES if count[state])


def _orphans(plan: Plan, results: Path) -> list[str]:
    """Runs whose folders are there and that the study does not list."""
    found = orphans(plan, results)
    if not found:
        return []
    size = size_text(freed_bytes(found))
    lines = [f"{len(found)} run folders of {size} no longer belong to the study; sandmould tidy "
        f"{display_path(plan.study.path)} removes them"]  # fmt: skip
    lines += [f"  {folder.name}" for folder in found[:LISTED_RUNS]]
    return lines + ([f"  and {len(found) - LISTED_RUNS} more"] if len(found) > LISTED_RUNS else [])


def _left(
    plan: Plan,
    statuses: Mapping[str, RunStatus],
    lacks: Mapping[str, Lack],
    cores: int,
    jobs: Sequence[Job],
) -> str:
    """Wall time until the report is written, on the cores of its jobs where there are any."""
    time_left = TimeLeft((*plan.fills, *plan.runs), stored_speeds(plan))
    for status in statuses.values():
        time_left.learn(status.run, status.wall_s)
    begun = {s.run: s.share for s in statuses.values() if s.state in ("running", "stopped")}
    waiting = [
        s.run
        for s in statuses.values()
        if s.state == "waiting" and lacks[s.run].need is Need.COMPUTE
    ]
    ahead = Outlook(cores)
    if any(job.lives for job in jobs):
        computes = any(status.state == "running" for status in statuses.values())
        ahead = outlook(jobs, computes, cores)
    left_s = time_left.seconds(begun, waiting, ahead.cores)
    if not left_s:
        return "nothing left to compute" if lacks else "nothing left"
    left = [run for run in (*plan.fills, *plan.runs) if run.run in {*begun, *waiting}]
    where = f"{ahead.cores} cores {ahead.awaits}".strip()
    return (
        f"time left, report included: about {duration_text(left_s + ahead.begins_s)} on {where}, "
        f"{time_left.prices.basis(left)}"
    )
