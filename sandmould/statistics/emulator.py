"""A measure as a smooth function of the swept keys: a Gaussian process through the runs."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from sandmould.runs.templates import worded
from sandmould.statistics.config import fewest_points

Array = NDArray[np.float64]
_THREADS = 1
"""For matrices of ten rows: to wait for the other cores takes ten times as long."""


class TooFewRunsError(ValueError):
    """There are not enough runs with a value."""


@dataclass(frozen=True, eq=False)
class Emulator:
    """Mean of a measure anywhere between the runs, and how well it is known."""

    measure: str
    low: Array
    high: Array
    """(d,) float64: bounds of the runs."""
    noise_sd: float
    """Standard deviation of one run about the mean of its point."""
    runs: int
    _process: Any
    _middle: float
    _spread: float

    def at(self, points: Array) -> tuple[Array, Array]:
        """Mean and standard error of the mean at points.

        ``points``: (n, d) float64.

        Returns
        -------
        mean, se : (n,) float64, in the unit of the measure
        """
        with threadpool_limits(_THREADS):
            mean, se = self._process.predict(_scaled(points, self.low, self.high), return_std=True)
        return self._middle + self._spread * mean, self._spread * se

    def draws(self, points: Array, number: int, seed: int) -> Array:
        """Draw surfaces that the runs leave possible.

        ``points``: (n, d) float64.

        Returns
        -------
        (number, n) float64, in the unit of the measure
        """
        with threadpool_limits(_THREADS):
            mean, covariance = self._process.predict(
                _scaled(points, self.low, self.high), return_cov=True
            )
            # Near runs without noise it is singular, and round-off makes it indefinite.
            variances, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.clip(variances, 0.0, None))
        normal = np.random.default_rng(seed).normal(size=(number, len(points)))
        drawn: Array = self._middle + self._spread * (mean + normal @ root.T)
        return drawn


def fit_emulator(measure: str, points: Array, values: Array) -> Emulator:
    """Fit a Gaussian process to runs.

    Replicates of a point tell the noise of a run, pooled over all points; where there are none it
    is fitted with the rest.

    Parameters
    ----------
    points : (n, d) float64
        Values of the swept keys of each run.
    values : (n,) float64
        NaN where a run has none.

    Raises
    ------
    TooFewRunsError
    """
    from sklearn.exceptions import ConvergenceWarning  # most reports have no emulator
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    there = np.isfinite(values)
    points, values = points[there], values[there]
    distinct, place, count = np.unique(points, axis=0, return_inverse=True, return_counts=True)
    fewest = fewest_points(points.shape[1])
    if len(distinct) < fewest:
        known = {"measure": measure, "known": len(distinct), "fewest": fewest}
        raise TooFewRunsError(worded("too_few.j2", **known))
    means = np.bincount(place, values) / count
    freedom = int((count - 1).sum())
    pooled = float(((values - means[place]) ** 2).sum()) / freedom if freedom else math.nan
    low, high = points.min(axis=0), points.max(axis=0)
    middle, spread = float(means.mean()), float(means.std()) or 1.0
    kernel = ConstantKernel(1.0, (1e-2, 1e3)) * Matern(
        [0.5] * points.shape[1], (0.05, 20.0), nu=2.5
    )
    alpha: Any = 1e-10
    if freedom and pooled > 0.0:
        alpha = pooled / count / spread**2
    else:
        kernel += WhiteKernel(1e-2, (1e-8, 1.0))
    process = GaussianProcessRegressor(kernel, alpha=alpha, n_restarts_optimizer=4, random_state=1)
    with warnings.catch_warnings(), threadpool_limits(_THREADS):
        # A length at its bound says that the measure hardly depends on a key.
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(_scaled(distinct, low, high), (means - middle) / spread)
    noise = math.sqrt(pooled) if freedom else math.nan
    if not freedom:
        noise = spread * math.sqrt(float(process.kernel_.k2.noise_level))
        # What is asked for is the mean of a point, not one more run.
        process.kernel_ = process.kernel_.k1
    return Emulator(measure, low, high, noise, len(values), process, middle, spread)


def _scaled(points: Array, low: Array, high: Array) -> Array:
    scaled: Array = (points - low) / np.where(high > low, high - low, 1.0)
    return scaled
