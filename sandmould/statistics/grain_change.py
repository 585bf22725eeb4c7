"""What coarser grains change at a setting, and what that foretells for finer ones."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
import scipy
from numpy.typing import NDArray

from sandmould.runs.columns import PART, SWEEP
from sandmould.runs.formatting import setting_text
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.grain_check import FACTOR
from sandmould.statistics.mean_tests import CONFIDENCE
from sandmould.statistics.settings import group_settings

ORDERS = (0.5, 2.0)
"""Powers of the grains' size that a change may go with: two sizes do not tell which."""
FORETOLD = 0.9
"""Confidence of what is foretold for finer grains."""


@dataclass(frozen=True)
class GrainChange:
    """A measure at one setting with the grains of the study and with coarser ones."""

    values: dict[str, Any]
    """Of the setting."""
    measure: str
    own: NDArray[np.float64]
    """Of each run that counts."""
    coarser: NDArray[np.float64]
    """The same with grains ``FACTOR`` times as large."""

    @property
    def label(self) -> str:
        """Of the setting."""
        return setting_text(self.values)

    @property
    def change(self) -> float:
        """Mean with coarser grains less the mean with the study's."""
        return float(self.coarser.mean() - self.own.mean())

    @property
    def ci(self) -> tuple[float, float]:
        """95 % interval of the change."""
        half = self._half_width(1.0, 1.0, CONFIDENCE)
        return self.change - half, self.change + half

    @property
    def is_seen(self) -> bool:
        """Whether coarser grains change the measure beyond its scatter."""
        low, high = self.ci
        return low > 0.0 or high < 0.0

    @property
    def finer(self) -> tuple[float, float]:
        """Band in which the mean with grains ``FACTOR`` times finer should lie.

        A change that goes as the size to the power p is f^-p times as large from the study's size
        to the finer one as it is from the coarser to the study's. Shares and largest distances are
        never below 0.
        """
        ends = []
        for order in ORDERS:
            less = FACTOR**-order
            mean = float(self.own.mean()) - less * self.change
            half = self._half_width(1.0 + less, less, FORETOLD)
            ends += [mean - half, mean + half]
        is_amount = self.measure.endswith("_fraction") or "_largest" in self.measure
        return max(min(ends), 0.0) if is_amount else min(ends), max(ends)

    def _half_width(self, of_own: float, of_coarser: float, confidence: float) -> float:
        """Half width of the interval of a combination of both means, with one spread for both."""
        n, m = len(self.own), len(self.coarser)
        freedom = n + m - 2
        squares = self.own.var() * n + self.coarser.var() * m
        error = math.sqrt(squares / freedom * (of_own**2 / n + of_coarser**2 / m))
        return float(scipy.special.stdtrit(freedom, 0.5 + confidence / 2)) * error


def grain_changes(
    summary: pd.DataFrame, keys: Sequence[str], measures: Sequence[str], part: str
) -> Iterator[GrainChange]:
    """Compare runs with coarser grains to those of the sweep at the same setting.

    ``part``: what the runs with coarser grains are called in the summary.
    """
    if PART not in summary or not (summary[PART] == part).any():
        return
    swept = group_settings(summary[summary[PART] == SWEEP], keys)
    for values, coarser in group_settings(summary[summary[PART] == part], keys):
        own = next((rows for at, rows in swept if at == values), coarser[:0])
        for measure in measures:
            pair = [usable_values(rows, measure).dropna() for rows in (own, coarser)]
            if min(map(len, pair)) > 1:
                yield GrainChange(values, measure, *(np.array(v, np.float64) for v in pair))


def order_of(best: GrainChange, rival: GrainChange, better: str) -> Literal["same", "other", ""]:
    """Whether the best setting stays ahead with coarser grains; empty if that is not told."""
    ahead = GrainChange({}, best.measure, rival.coarser, best.coarser)
    if not ahead.is_seen:
        return ""
    return "same" if (ahead.change > 0.0) == (better == "larger") else "other"
