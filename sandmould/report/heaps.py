"""Heaps of sand beside each other, with the lines fitted to their slopes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from sandmould.kinds.sand.moments import list_moments
from sandmould.report.repose_figures import draw_heap
from sandmould.runs.columns import RUN
from sandmould.runs.formatting import number
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.verdict import Verdict

PICTURED_HEAPS = 3


@dataclass(frozen=True)
class Heap:
    """A picture of the sand at rest with the fitted lines."""

    heading: str
    picture: str
    alt: str


def steepest_heaps(
    study_folder: Path, summary: pd.DataFrame, verdict: Verdict, scenario: Scenario
) -> tuple[Heap, ...]:
    """Draw runs with the least, the middle and the steepest slope; none without a level gate.

    Parameters
    ----------
    study_folder : Path
    summary : DataFrame
        Of the sweep.
    verdict : Verdict
    scenario : Scenario
        Of any run.
    """
    if scenario.gate is None or not scenario.gate.is_level:
        return ()
    values = usable_values(summary, verdict.measure).dropna().sort_values()
    places = np.unique(np.linspace(0, len(values) - 1, PICTURED_HEAPS).round().astype(int))
    heaps = []
    for index in [values.index[i] for i in places] if len(values) else []:
        run = str(summary.loc[index, RUN])
        moments = list_moments(study_folder / "runs" / run)
        if not moments:
            continue
        sand = moments[-1].load()
        heading = f"{number(values[index])}°: {run}"
        picture = draw_heap(sand, scenario, 1.02 * scenario.scene.top_m)
        heaps.append(Heap(heading, picture, f"Heap and hopper of run {run} with fitted lines"))
    return tuple(heaps)
