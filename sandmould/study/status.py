"""Where a study stands: runs done, running, failed, time left and cost so far."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.progress import duration_text
from sandmould.study.plan.build_plan import Plan, stored_speeds
from sandmould.study.plan.lacking import WHOLE, Lack, Need
from sandmould.study.process import computed_elsewhere, is_locked
from sandmould.study.rounds.round_log import read_rounds
from sandmould.study.tidy import freed_bytes, orphans, size_text
from sandmould.study.time_left import TimeLeft

State = Literal["done", "failed", "running", "stopped", "waiting"]
STATES: tuple[State, ...] = ("done", "failed", "running", "stopped", "waiting")
LISTED_RUNS = 12
FRESH_S = 60.0
"""A run of another machine, whose lock may not be seen here, has written its progress since."""
_DAMAGED = (OSError, ValueError, KeyError, TypeError, IndexError)
"""What reading a file may raise that was cut short or overwritten."""


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


def run_status(folder: Path, lack: Lack) -> RunStatus:
    """See where a run stands from what it has written.

    Parameters
    ----------
    folder : Path
        ``results/<study>/runs/<run>``.
    lack : Lack
        What a start would do for it.
    """
    name = folder.name
    if lack.need is Need.NOTHING:
        return _ended(folder)
    path = folder / "work" / "progress.json"
    said, share, fresh = "", 0.0, False
    with contextlib.suppress(*_DAMAGED):
        now: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        fresh = time.time() - path.stat().st_mtime < FRESH_S
        share = float(now["percent"]) / 100
        said = f"{now['percent']:.0f} %, {now['stage']}, {now['time_s']:.3g} s simulated"
    running = is_locked(folder) or (fresh and computed_elsewhere(folder))
    if not said:
        return RunStatus(name, "running" if running else "waiting", "" if running else lack.why)
    if running:
        return RunStatus(name, "running", said, share=share)
    return RunStatus(name, "stopped", said, share=share)


def _ended(folder: Path) -> RunStatus:
    """A run with all that it leaves behind."""
    outcome = RunOutcome.read(folder / "outcome.json")
    cpu_s = wall_s = math.nan
    with contextlib.suppress(*_DAMAGED):
        cost = pd.read_csv(folder / "cost.tsv", sep="\t").iloc[-1]
        cpu_s, wall_s = float(cost["cpu_s"]), float(cost["wall_s"])
    cpu_s = cpu_s if math.isfinite(cpu_s) else 0.0
    if outcome.outcome is Outcome.FINISHED:
        return RunStatus(folder.name, "done", "", cpu_s, wall_s=wall_s)
    said = f"{outcome.outcome.label}. {outcome.detail}".strip()
    return RunStatus(folder.name, "failed", said, cpu_s)


def status_text(plan: Plan, results: Path, cores: int) -> str:
    """Say where a study stands: done, running, failed, time left, cost so far.

    Parameters
    ----------
    plan : Plan
    results : Path
    cores : int
        That share what is left.
    """
    folder = results / plan.study.name
    lacks = plan.lacks(results)
    statuses = {
        run.run: run_status(folder / "runs" / run.run, lacks.get(run.run, WHOLE))
        for run in plan.runs
    }
    count = Counter(status.state for status in statuses.values())
    parts = [f"{count[state]} {state}" for state in STATES if count[state]]
    lines = [f"{plan.study.name}: {', '.join(parts)} of {len(plan.runs)} runs"]
    spent_s = sum(status.cpu_s for status in statuses.values())
    lines.append(
        f"processor time so far: {duration_text(spent_s)}; {_left(plan, results, statuses, cores)}"
    )
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
    if count["failed"]:
        lines.append("a failed run is computed once more by: sandmould again RUN")
    return "\n".join([*lines, *_orphans(plan, results)])


def _orphans(plan: Plan, results: Path) -> list[str]:
    """Runs whose folders are there and that the study does not list."""
    found = orphans(plan, results)
    if not found:
        return []
    size = size_text(freed_bytes(found))
    lines = [f"no longer of the study: {len(found)} run folders of {size}, which "
             f"sandmould tidy {plan.study.name} removes"]  # fmt: skip
    lines += [f"  {folder.name}" for folder in found[:LISTED_RUNS]]
    return lines + ([f"  and {len(found) - LISTED_RUNS} more"] if len(found) > LISTED_RUNS else [])


def _left(plan: Plan, results: Path, statuses: Mapping[str, RunStatus], cores: int) -> str:
    """Wall time until the report is written."""
    time_left = TimeLeft(plan.runs, stored_speeds(plan, results))
    for status in statuses.values():
        time_left.learn(status.run, status.wall_s)
    begun = {s.run: s.share for s in statuses.values() if s.state in ("running", "stopped")}
    waiting = [s.run for s in statuses.values() if s.state == "waiting"]
    left_s = time_left.seconds(begun, waiting, cores)
    if not left_s:
        return "nothing left"
    left = [run for run in plan.runs if run.run in {*begun, *waiting}]
    return (
        f"time left: about {duration_text(left_s)} on {cores} cores with the report, "
        f"{time_left.prices.basis(left)}"
    )
