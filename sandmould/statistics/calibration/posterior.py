"""What measured values say of two parameters, by Bayes' rule on a grid, and which is worth most."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sandmould.runs.templates import worded
from sandmould.statistics.config import Target
from sandmould.statistics.emulator import Emulator

Array = NDArray[np.float64]
GRID = 121
"""Points along each axis: a posterior a tenth of the range wide still has a dozen across."""
CREDIBLE = 0.95
TRUTHS = 5
"""Planted truths along each axis, the edges of the map left out."""


class OffTheMapError(ValueError):
    """A measured value lies beyond all that the runs cover."""


@dataclass(frozen=True)
class Posterior:
    """Probability of the two parameters, flat before anything was measured."""

    first: Array
    second: Array
    """(g,) float64: values of the parameters along the grid."""
    share: Array
    """(g, g) float64: probability of each cell; first parameter down, second across."""

    @property
    def mode(self) -> tuple[float, float]:
        """Most probable cell."""
        i, j = np.unravel_index(int(self.share.argmax()), self.share.shape)
        return float(self.first[i]), float(self.second[j])

    @property
    def mean(self) -> tuple[float, float]:
        """Mean of each parameter."""
        return (
            float(self.share.sum(axis=1) @ self.first),
            float(self.share.sum(axis=0) @ self.second),
        )

    @property
    def sd(self) -> tuple[float, float]:
        """Standard deviation of each parameter."""
        first_mean, second_mean = self.mean
        return (
            math.sqrt(float(self.share.sum(axis=1) @ (self.first - first_mean) ** 2)),
            math.sqrt(float(self.share.sum(axis=0) @ (self.second - second_mean) ** 2)),
        )

    @property
    def correlation(self) -> float:
        """Of the two parameters."""
        (first_mean, second_mean), (s, t) = self.mean, self.sd
        product = float((self.first - first_mean) @ self.share @ (self.second - second_mean))
        return product / (s * t) if s * t > 0.0 else math.nan

    @property
    def bits(self) -> float:
        """Information over the flat prior, bits: Kullback and Leibler's divergence."""
        p = self.share[self.share > 0.0]
        return float((p * np.log2(p * self.share.size)).sum())

    def region(self, credible: float = CREDIBLE) -> NDArray[np.bool_]:
        """Cells of highest probability that together hold a share of it, (g, g) bool."""
        order = np.argsort(self.share, axis=None)[::-1]
        held = np.cumsum(self.share.ravel()[order])
        last = int(np.searchsorted(held, credible))
        inside = np.zeros(self.share.size, dtype=bool)
        inside[order[: last + 1]] = True
        return inside.reshape(self.share.shape)


def axes_of(emulator: Emulator) -> tuple[Array, Array]:
    """Grid over the range of the runs."""
    first, second = (
        np.linspace(low, high, GRID) for low, high in zip(emulator.low, emulator.high, strict=True)
    )
    return first, second


@lru_cache(maxsize=64)
def surface(emulator: Emulator) -> tuple[Array, Array]:
    """Mean and standard error of a measure on its grid, (g, g) float64 each."""
    first, second = axes_of(emulator)
    grid = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    mean, se = emulator.at(grid)
    return mean.reshape(GRID, GRID), se.reshape(GRID, GRID)


def posterior(
    emulators: Mapping[str, Emulator],
    targets: Mapping[str, Target],
    assumed: Sequence[Target | None] = (),
) -> Posterior:
    """Combine measured values, taken as independent, by Bayes' rule.

    Each says that the mean of its measure is its value, within its own deviation and the standard
    error of the emulator together.

    ``assumed``: what is assumed of the two parameters themselves.

    Raises
    ------
    OffTheMapError
        When a value lies further beyond the map than three of these deviations.
    """
    first, second = axes_of(emulators[next(iter(targets))])
    logarithm = np.zeros((len(first), len(second)))
    for axis, prior in zip((first[:, None], second[None]), assumed, strict=False):
        if prior is not None:
            logarithm = logarithm - 0.5 * ((axis - prior.value) / prior.sd) ** 2
    for measure, target in targets.items():
        mean, se = surface(emulators[measure])
        variance = se**2 + target.sd**2
        apart = np.abs(target.value - mean) / np.sqrt(variance)
        if float(apart.min()) > 3.0:
            it = {"measure": measure, "value": target.value, "given": []}
            raise OffTheMapError(worded("off_the_map.j2", **it, low=mean.min(), high=mean.max()))
        logarithm -= 0.5 * (apart**2 + np.log(variance))
    share = np.exp(logarithm - logarithm.max())
    return Posterior(first, second, share / share.sum())


@dataclass(frozen=True)
class IsoLine:
    """First parameter against the second where a measure has a value, with its band."""

    second: Array
    """(g,) float64."""
    first: Array
    """(g,) float64: on the line; NaN where it leaves the map."""
    low: Array
    high: Array
    """(g,) float64: ends of what is within two deviations of the value; NaN where nothing is."""


def iso_line(emulator: Emulator, target: Target) -> IsoLine:
    """Find the line on which a measure has its measured value.

    Where it has it more than once for one value of the second parameter, the lowest is taken.
    """
    first, second = axes_of(emulator)
    mean, se = surface(emulator)
    above = mean - target.value
    crossing = np.diff(np.signbit(above), axis=0)
    line, low, high = (np.full(len(second), np.nan) for _ in range(3))
    near = np.abs(above) <= 2.0 * np.sqrt(se**2 + target.sd**2)
    for j in range(len(second)):
        at = np.flatnonzero(crossing[:, j])
        if len(at):
            i = int(at[0])
            share = above[i, j] / (above[i, j] - above[i + 1, j])
            line[j] = first[i] + share * (first[i + 1] - first[i])
        inside = np.flatnonzero(near[:, j])
        if len(inside):
            low[j], high[j] = first[inside[0]], first[inside[-1]]
    return IsoLine(second, line, low, high)


@dataclass(frozen=True)
class Worth:
    """What measuring something once tells of the two parameters, on average over the map."""

    measure: str
    bits_alone: float
    bits_added: float
    """Beside the first measure."""
    cpu_s: float
    """Of one run that gives it, beyond the run that gives the first."""


def worths(
    emulators: Mapping[str, Emulator], first: str, cpu_s: Mapping[str, float]
) -> list[Worth]:
    """Average information of each measure over planted truths, the richest addition first.

    A truth's value is the emulator's, known as well as one run knows it.

    Parameters
    ----------
    first : str
        The measure that is there already.
    cpu_s : mapping of measure to float, s
        Extra processor time of each.
    """
    base = emulators[first]
    share = (np.arange(TRUTHS) + 0.5) / TRUTHS
    truths = [base.low + (base.high - base.low) * np.array([a, b]) for a in share for b in share]
    alone = {m: _mean_bits(emulators, [m], truths) for m in emulators}
    worth_of_each = [
        Worth(
            m, alone[m], _mean_bits(emulators, [first, m], truths) - alone[first], cpu_s.get(m, 0.0)
        )
        for m in emulators
        if m != first
    ]
    return sorted(worth_of_each, key=lambda worth: -worth.bits_added)


def _mean_bits(
    emulators: Mapping[str, Emulator], measures: Sequence[str], truths: Sequence[np.ndarray]
) -> float:
    bits = []
    for truth in truths:
        targets = {
            m: Target(
                value=float(emulators[m].at(truth[None])[0][0]),
                sd=max(emulators[m].noise_sd, 1e-12),
            )
            for m in measures
        }
        bits.append(posterior(emulators, targets).bits)
    return float(np.mean(bits))
