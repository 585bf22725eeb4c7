"""Where a study stands: ``python -m sandmould.study.status STUDY.yaml``; ``make status``."""

from __future__ import annotations

import contextlib
import fcntl
import json
import math
import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.progress import duration_text
from sandmould.scenario.bad_input import BadInputError
from sandmould.study.build_plan import DEFAULT_STUDY, RESULTS, Plan, open_plan
from sandmould.study.kinds.kind import SpeedClass
from sandmould.study.rounds.round_log import read_rounds

State = Literal["done", "failed", "running", "stopped", "waiting"]
STATES: tuple[State, ...] = ("done", "failed", "running", "stopped", "waiting")
SHOWN = 12
FRESH_S = 60.0
"""A run on another machine, whose lock is not seen here, has written its progress since."""


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
    with contextlib.suppress(OSError, ValueError, KeyError):
        outcome = RunOutcome.read(folder / "outcome.json")
        cost = pd.read_csv(folder / "cost.tsv", sep="\t").iloc[-1]
        state: State = "done" if outcome.outcome is Outcome.FINISHED else "failed"
        said = "" if state == "done" else f"{outcome.outcome.label}. {outcome.detail}".strip()
        wall_s = float(cost["wall_s"]) if state == "done" else math.nan
        return RunStatus(name, state, said, float(cost["cpu_s"]), 0.0, wall_s)
    path = folder / "work" / "progress.json"
    progress: dict[str, Any] = {}
    fresh = False
    with contextlib.suppress(OSError, ValueError):
        progress = json.loads(path.read_text(encoding="utf-8"))
        fresh = time.time() - path.stat().st_mtime < FRESH_S
    if not progress:
        return RunStatus(name, "running" if _locked(folder) else "waiting")
    said = f"{progress['percent']:.0f} %, {progress['stage']}, {progress['time_s']:.3g} s simulated"
    if _locked(folder) or fresh:
        return RunStatus(name, "running", said, left_s=float(progress["left_s"]))
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
    found = {run.run: run_status(folder / "runs" / run.run) for run in plan.runs}
    count = Counter(status.state for status in found.values())
    parts = [f"{count[state]} {state}" for state in STATES if count[state]]
    lines = [f"{plan.study.name}: {', '.join(parts)} of {len(plan.runs)} runs"]
    spent_s = sum(status.cpu_s for status in found.values())
    lines.append(f"processor time so far: {duration_text(spent_s)}; {_left(plan, found, cores)}")
    ledger = read_rounds(folder, plan.study.study)
    if plan.study.study.refine.rounds:
        ended = ledger.ended or f"of at most {plan.study.study.refine.rounds}"
        lines.append(f"rounds: {len(ledger.rounds)}, {ended}")
    for state in ("running", "stopped", "failed"):
        chosen = [status for status in found.values() if status.state == state]
        lines += [f"  {state}: {s.run}  {s.said}".rstrip() for s in chosen[:SHOWN]]
        if len(chosen) > SHOWN:
            lines.append(f"  {state}: and {len(chosen) - SHOWN} more")
    return "\n".join(lines)


def _left(plan: Plan, found: dict[str, RunStatus], cores: int) -> str:
    """Wall time of what is left, at the speed of the runs like it that are done."""
    kind = plan.kind
    speeds: dict[SpeedClass, list[float]] = {}
    for run in plan.runs:
        wall_s = found[run.run].wall_s
        if math.isfinite(wall_s):
            core_s = wall_s * kind.threads(run.scenario)
            each = core_s / kind.planned_work(run.scenario)
            speeds.setdefault(kind.speed_class(run.scenario), []).append(each)
    left_s, unknown = 0.0, 0
    for run in plan.runs:
        status = found[run.run]
        if status.state == "running" and math.isfinite(status.left_s):
            left_s += status.left_s
        elif status.state in ("running", "stopped", "waiting"):
            known = speeds.get(kind.speed_class(run.scenario))
            if known is None:
                unknown += 1
            else:
                typical = sorted(known)[len(known) // 2]
                left_s += kind.planned_work(run.scenario) * typical
    if unknown:
        return f"time left unknown: no run like {unknown} of them is done"
    return (
        f"time left: about {duration_text(left_s / cores)} on {cores} cores"
        if left_s
        else ("nothing left")
    )


def main(arguments: Sequence[str]) -> int:
    """Print where a study stands; nothing starts."""
    try:
        plan = open_plan(Path(arguments[0]) if arguments else DEFAULT_STUDY)
    except BadInputError as error:
        print(error, file=sys.stderr)
        return 1
    print(status_text(plan, RESULTS, os.cpu_count() or 1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
