"""Which runs of a study are drawn, and what a drawn heap is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from sandmould.kinds.sand.moments import list_moments
from sandmould.report.curves import runs_of
from sandmould.runs.columns import RUN
from sandmould.statistics.verdict import Verdict, rank_runs


@dataclass(frozen=True)
class Heap:
    """A picture of the sand at rest with the fitted lines."""

    heading: str
    picture: str
    alt: str


def pictured_runs(study_folder: Path, summary: pd.DataFrame, verdict: Verdict) -> dict[str, str]:
    """Runs to be looked at, by role: of the best setting, median and worst, or what there is.

    Of the best setting it is the run in the middle, not the luckiest. Where one run can be used it
    is the only one. Where none can, that with most snapshots stands alone: to see how it failed.
    """
    ranks = rank_runs(summary, verdict.measure, verdict.better)
    if "best" in ranks and verdict.best is not None:
        own = rank_runs(runs_of(summary, verdict.best), verdict.measure, verdict.better)
        best = own.get("median", own["best"])
        others = {role: run for role, run in ranks.items() if role != "best" and run != best}
        ranks = {"best": best, **others}
    with_snapshots = {
        r: run for r, run in ranks.items() if list_moments(study_folder / "runs" / run)
    }
    if with_snapshots:
        return with_snapshots if len(ranks) > 1 else {"only": next(iter(with_snapshots.values()))}
    count = {str(r): len(list_moments(study_folder / "runs" / str(r))) for r in summary[RUN]}
    longest = max(count, key=lambda r: count[r], default="")
    return {"longest": longest} if count.get(longest) else {}
