"""Where a study stands: runs done, running, failed, time left and cost so far."""

from __future__ import annotations

import contextlib
import fcntl
import json
import math
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.progress import duration_text
from sandmould.study.kinds.kind import SpeedClass
from sandmould.study.plan.build_plan import Plan
from sandmould.study.rounds.round_log import read_rounds

State = Literal["done", "failed", "running", "stopped", "waiting"]
STATES: tuple[State, ...] = ("done", "failed", "running", "stopped", "waiting")
LISTED_RUNS = 12
FRESH_S = 60.0
"""A run on another machine, whose lock is not seen here, has written its progress since."""
_DAMAGED = (OSError, ValueError, KeyError, TypeError, IndexError)
"""What reading a file may raise that was cut short or overwritten."""


@dataclass(frozen=True)
class RunStatus:
    """Where one run stands."""

    run: str
    state: State
    said: str = ""
    """How it failed, or how far it is."""
    cpu_s: float = 0.0
    left_s: float = math.nan
    """Of a run that is being computed."""
    wall_s: float = math.nan
    """Of a run that is done."""


def run_status(folder: Path) -> RunStatus:
    """See where a run stands from what it has written.

    Parameters
    ----------
    folder : Path
        ``results/<study>/runs/<run>``.
    """
    name = folder.name
    with contextlib.suppress(*_DAMAGED):
        outcome = RunOutcome.read(folder / "outcome.json")
        cost = pd.read_csv(folder / "cost.tsv", sep="\t").iloc[-1]
        state: State = "done" if outcome.outcome is Outcome.FINISHED else "failed"
        said = "" if state == "done" else f"{outcome.outcome.label}. {outcome.detail}".strip()
        wall_s = float(cost["wall_s"]) if state == "done" else math.nan
        return RunStatus(name, state, said, float(cost["cpu_s"]), 0.0, wall_s)
    path = folder / "work" / "progress.json"
    said, left_s, fresh = "", math.nan, False
    with contextlib.suppress(*_DAMAGED):
        now: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        fresh = time.time() - path.stat().st_mtime < FRESH_S
        left_s = float(now["left_s"])
        said = f"{now['percent']:.0f} %, {now['stage']}, {now['time_s']:.3g} s simulated"
    if not said:
        return RunStatus(name, "running" if _locked(folder) else "waiting")
    if _locked(folder) or fresh:
        return RunStatus(name, "running", said, left_s=left_s)
    return RunStatus(name, "stopped", said)


def _locked(folder: Path) -> bool:
    """Whether a process of this machine computes in a run's folder."""
    try:
        with (folder / "lock").open() as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False


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
    statuses = {run.run: run_status(folder / "runs" / run.run) for run in plan.runs}
    count = Counter(status.state for status in statuses.values())
    parts = [f"{count[state]} {state}" for state in STATES if count[state]]
    lines = [f"{plan.study.name}: {', '.join(parts)} of {len(plan.runs)} runs"]
    spent_s = sum(status.cpu_s for status in statuses.values())
    lines.append(f"processor time so far: {duration_text(spent_s)}; {_left(plan, statuses, cores)}")
    log = read_rounds(folder, plan.study.study)
    if plan.study.study.refine.rounds:
        ended = log.ended or f"of at most {plan.study.study.refine.rounds}"
        lines.append(f"rounds: {len(log.rounds)}, {ended}")
    for state in ("running", "stopped", "failed"):
        chosen = [status for status in statuses.values() if status.state == state]
        lines += [f"  {state}: {s.run}  {s.said}".rstrip() for s in chosen[:LISTED_RUNS]]
        if len(chosen) > LISTED_RUNS:
            lines.append(f"  {state}: and {len(chosen) - LISTED_RUNS} more")
    return "\n".join(lines)


def _left(plan: Plan, statuses: dict[str, RunStatus], cores: int) -> str:
    """Wall time of what is left, at the speed of the runs like it that are done."""
    planning = plan.kind.planning
    speeds: dict[SpeedClass, list[float]] = {}
    for run in plan.runs:
        wall_s = statuses[run.run].wall_s
        if math.isfinite(wall_s):
            core_s = wall_s * planning.threads(run.scenario)
            each = core_s / planning.planned_work(run.scenario)
            speeds.setdefault(planning.speed_class(run.scenario), []).append(each)
    left_s, unknown = 0.0, 0
    for run in plan.runs:
        status = statuses[run.run]
        if status.state == "running" and math.isfinite(status.left_s):
            left_s += status.left_s
        elif status.state in ("running", "stopped", "waiting"):
            costs = speeds.get(planning.speed_class(run.scenario))
            if costs is None:
                unknown += 1
            else:
                typical = sorted(costs)[len(costs) // 2]
                left_s += planning.planned_work(run.scenario) * typical
    if unknown:
        return f"time left unknown: no run like {unknown} of them is done"
    return (
        f"time left: about {duration_text(left_s / cores)} on {cores} cores"
        if left_s
        else ("nothing left")
    )
