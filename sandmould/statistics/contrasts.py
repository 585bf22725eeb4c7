"""Differences of settings, taken within blocks: replicates that share their seeds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.statistics.mean_tests import MeanTest, alike_pvalue, compare_means

Array = NDArray[np.float64]
_ROUND_OFF = 1e-10
_UNLIKE = 0.01
"""Chance of spreads so unlike, below which settings do not share one."""


class Contrasts:
    """Means of settings whose runs come in blocks, by generalized least squares.

    A block shifts all settings alike. The variance of these shifts is Henderson's third estimate
    (1953): the larger it is beside that of a run, the more the differences are those within blocks.
    With the same blocks in all settings they are those of the plain means.

    Parameters
    ----------
    setting, block : (n,) int
        Of each run, numbered from zero on without a gap.
    value : (n,) float64
    """

    means: Array
    """(settings,) float64: of each setting, over all blocks alike."""
    sd: float
    """Standard deviation of a run within its block; NaN without a degree of freedom."""
    df: int
    """Degrees of freedom of it."""
    block_sd: float
    """Standard deviation of what a block shifts in all settings; NaN where the runs do not tell."""
    are_linked: bool
    """Whether blocks in common link every setting with every other one."""

    def __init__(self, setting: NDArray[np.intp], block: NDArray[np.intp], value: Array) -> None:
        runs = np.zeros((setting.max() + 1, block.max() + 1))
        np.add.at(runs, (setting, block), 1.0)
        self._runs = runs.sum(axis=1)
        # Where each setting has its runs. What is left of the normal equations is of the blocks.
        self._shares = runs / self._runs[:, None]
        self._equations = np.diag(runs.sum(axis=0)) - runs.T @ self._shares
        self._inverse = np.linalg.pinv(self._equations, rcond=_ROUND_OFF, hermitian=True)
        rank = int(np.linalg.matrix_rank(self._inverse, hermitian=True))
        self.are_linked = rank == len(self._equations) - 1
        raw = np.bincount(setting, value) / self._runs
        right = np.bincount(block, value) - runs.T @ raw
        shift = self._inverse @ right
        left = value - (raw - self._shares @ shift)[setting] - shift[block]
        self.df = len(value) - len(raw) - rank
        self.sd = math.sqrt(float(left @ left) / self.df) if self.df > 0 else math.nan
        self.block_sd = math.nan
        self._solved = self._inverse
        if self.df > 0 and rank:
            between = (float(right @ shift) - rank * self.sd**2) / float(np.trace(self._equations))
            self.block_sd = math.sqrt(max(between, 0.0))
            self._solved = np.zeros_like(self._inverse)
            if between > 0.0:
                ridge = self.sd**2 / between * np.eye(len(shift))
                self._solved = np.linalg.pinv(
                    self._equations + ridge, rcond=_ROUND_OFF, hermitian=True
                )
        self.means = raw - self._shares @ (self._solved @ right)

    def difference(self, first: int, second: int) -> tuple[float, float]:
        """Mean of a setting minus that of another, and its standard error over ``sd``.

        Both are NaN where the two have no blocks in common, nor others that link them.
        """
        weights = np.zeros(len(self.means))
        weights[first] += 1.0
        weights[second] -= 1.0
        return self.weighed(weights)

    def weighed(self, weights: Array) -> tuple[float, float]:
        """Sum of the means, each by its weight, and its error: as ``difference``.

        ``weights``: (settings,) float64, together zero.
        """
        apart = weights @ self._shares
        if np.abs(self._equations @ (self._inverse @ apart) - apart).max() > _ROUND_OFF:
            return math.nan, math.nan
        variance = float((weights**2 / self._runs).sum() + apart @ self._solved @ apart)
        return float(weights @ self.means), math.sqrt(variance)


@dataclass(frozen=True)
class Spread:
    """Standard deviation of a run that all settings share, and their differences by it."""

    values: Mapping[str, pd.Series[float]]
    """Of each setting that has some, by block."""
    contrasts: Contrasts
    in_blocks: bool
    """Whether blocks count in the differences."""
    are_unlike: bool
    """Whether settings scatter so unlike each other that they share no spread."""
    is_exact: bool = False
    """Whether the values do not scatter though their runs do: what differs is then told."""

    @staticmethod
    def of(values: Mapping[str, pd.Series[float]], is_exact: bool = False) -> Spread:
        """Fit settings and blocks to all values.

        Replicates that share their seeds are one block. Blocks count unless they do not link all
        settings, or take more than half of the degrees of freedom.

        ``values``: of each setting, by block; one of them at least is not empty.
        """
        used = {label: v for label, v in values.items() if len(v)}
        run_value = np.concatenate([v.to_numpy(dtype=np.float64) for v in used.values()])
        setting = np.repeat(np.arange(len(used)), [len(v) for v in used.values()])
        apart = Contrasts(setting, np.zeros_like(setting), run_value)
        unlike = alike_pvalue([run_value[setting == n] for n in range(len(used))]) < _UNLIKE
        block = pd.factorize(np.concatenate([v.index.to_numpy() for v in used.values()]))[0]
        # Blocks of one run each tell nothing, and their equations are many.
        if block.max() + 1 < len(block) and all(v.index.is_unique for v in used.values()):
            within = Contrasts(setting, block, run_value)
            if within.are_linked and 0 < apart.df <= 2 * within.df:
                return Spread(used, within, True, unlike, is_exact)
        return Spread(used, apart, False, unlike, is_exact)

    def mean(self, label: str) -> float:
        """Mean of a setting, over all blocks alike where they count."""
        return float(self.contrasts.means[self._place(label)])

    def compare(self, first: str, second: str) -> tuple[float, MeanTest | None]:
        """Test the difference of two means, for all pairs of settings together (Tukey, Kramer).

        Where the settings scatter beyond chance unlike each other, the spread of the two and its
        degrees of freedom count alone (Games and Howell 1976): a wild setting would else hide what
        calm ones differ by. Elsewhere the two count where they scatter more than all settings do.

        Gives the first minus the second, and the test; None where no spread is left to test by.
        """
        contrasts = self.contrasts
        difference, scale = contrasts.difference(self._place(first), self._place(second))
        if contrasts.df <= 0:
            return difference, None
        error, df = contrasts.sd * scale, float(contrasts.df)
        if (own := self._own(first, second, scale)) is not None:
            error, df = own if self.are_unlike else (max(error, own[0]), df)
        largest = max(float(self.values[label].abs().max()) for label in (first, second))
        if not error > 1e-12 * largest:
            # all replicates differ by the same: told, unless none of them differs from another
            scatters = self.in_blocks and all(np.ptp(self.values[x]) > 0 for x in (first, second))
            if not ((scatters or self.is_exact) and abs(difference) > _ROUND_OFF * largest):
                return difference, None
            error = 1e-12 * largest
        return difference, MeanTest(difference, error, df, len(self.values))

    def weigh(self, weights: Array) -> tuple[float, float, float]:
        """A weighted sum of the means, its standard error and the degrees of freedom of that.

        Where settings scatter unlike each other, by their own spreads (Satterthwaite 1946).

        ``weights``: (settings,) float64, together zero, in the order of ``values``.
        """
        total, scale = self.contrasts.weighed(weights)
        of = [(w**2 * float(v.var()) / len(v), len(v) - 1) for w, v in
              zip(weights, self.values.values(), strict=True) if w]  # fmt: skip
        if not self.are_unlike or min(df for _, df in of) < 1:
            return total, self.contrasts.sd * scale, float(self.contrasts.df)
        variance = sum(part for part, _ in of)
        squares = sum(part**2 / df for part, df in of)
        return total, math.sqrt(variance), variance**2 / squares if squares else math.inf

    def _place(self, label: str) -> int:
        return list(self.values).index(label)

    def _own(self, first: str, second: str, scale: float) -> tuple[float, float] | None:
        """Standard error by the spread of the two alone, and its degrees of freedom."""
        x, y = self.values[first], self.values[second]
        if self.in_blocks:
            shared = x.index.intersection(y.index)
            x, y = x.loc[shared], y.loc[shared]
        if (tested := compare_means(x, y)) is None:
            return None
        own = tested[0]
        # Pairs tell the standard deviation of a difference: that of a run times the root of two.
        return own.error * (math.sqrt(len(x) / 2.0) * scale if self.in_blocks else 1.0), own.df
