"""What fills cost that runs share: each run bears its part, so that sums count a fill once."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from sandmould.definition.run import FILLS
from sandmould.runs.columns import CPU_S, FILL_CPU_S, FILL_WALL_S, WALL_S
from sandmould.runs.run_tables import PLACE, read_costs


def shares_of_fills(fills: pd.Series[str], study_folder: Path) -> dict[str, pd.Series[float]]:
    """What each run's fill took, over the runs that share it.

    Parameters
    ----------
    fills : Series of str
        Name of each run's fill; missing for a run that shares none.
    study_folder : Path

    Returns
    -------
    dict of str to Series
        Columns for the summary, s.
    """
    names = fills.dropna().unique()
    costs = read_costs([study_folder / FILLS / name for name in names])
    last = costs.rows.drop_duplicates(PLACE, keep="last").set_index(PLACE)
    cost = last.reindex(index=range(len(names)), columns=[WALL_S, CPU_S])
    sharing = fills.map(fills.value_counts())
    return {
        share: fills.map(dict(zip(names, cost[whole], strict=True))) / sharing
        for share, whole in ((FILL_WALL_S, WALL_S), (FILL_CPU_S, CPU_S))
    }
