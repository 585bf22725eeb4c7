"""How far the pattern is moved towards the displacement that the last loads give.

With x the displacement at the interface in a window and G(x) the one that its loads give, the loop
seeks x = G(x); R(x) = G(x) - x is the residual. Sand that is g times as stiff as the pattern makes
G(x) about -g x: the plain loop x <- G(x) diverges for g > 1, a fixed relaxation factor below
2 / (1 + g) holds. Words as in Degroote, Bathe and Vierendeels 2009, Computers and Structures 87,
793-801 (IQN-ILS), and Küttler and Wall 2008, Computational Mechanics 43, 61-72 (Aitken).
"""

from __future__ import annotations

from collections import deque
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sandmould.scenario.pattern import Loop

Array = NDArray[np.float64]
Change = tuple[Array, Array]
"""Of the displacement at the interface, and of the residual."""
_COLUMNS = 10
"""Changes that the quasi-Newton scheme remembers."""
_FILTER = 1e-2
"""Part of a change that must be new: below it is noise of the sand."""


class Relaxation(Protocol):
    """Chooses the next displacement at the interface; arrays are (k,) float64, m."""

    factor: float
    """Relaxation factor of the last call: part of the residual that was gone, along it."""

    def next(self, displacement: Array, solution: Array) -> Array:
        """Next displacement, from that of an iteration, x, and the one its loads give, G(x)."""

    def state(self) -> dict[str, Array]:
        """Memory, for a checkpoint."""

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up a memory."""


class FixedRelaxation:
    """The same factor for every residual."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def next(self, displacement: Array, solution: Array) -> Array:
        """Go the factor times the residual."""
        return np.asarray(displacement + self.factor * (solution - displacement))

    def state(self) -> dict[str, Array]:
        """Nothing is remembered."""
        return {}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Nothing is remembered."""


class MeasuredRelaxation(FixedRelaxation):
    """A part of the limit 2 / (1 + g) of a fixed factor, for a gain that was measured."""

    def __init__(self, first: float, least: float, most: float, limit_share: float) -> None:
        super().__init__(first)
        self._least, self._most, self._limit_share = least, most, limit_share

    def set_limit(self, limit: float) -> None:
        """Take up the limit that a new gain sets."""
        self.factor = float(np.clip(self._limit_share * limit, self._least, self._most))

    def state(self) -> dict[str, Array]:
        """The factor."""
        return {"factor": np.array([self.factor])}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up the factor."""
        self.factor = float(arrays["factor"][0])


class AitkenRelaxation:
    """One factor for all, from how the last two residuals differ (Küttler and Wall 2008, (44)).

    Its sign and size are kept within bounds: noise of the sand in the residuals would throw it.
    """

    def __init__(self, first: float, least: float, most: float) -> None:
        self.factor = self._first = first
        self._least, self._most = least, most
        self._last: Array | None = None
        self.is_calm = False
        """Whether the factor is the first one: where sand rests, and no window is computed again,
        residuals differ by noise alone, which tells no factor."""

    def next(self, displacement: Array, solution: Array) -> Array:
        """Go with the factor that would have made the last residual vanish."""
        residual = solution - displacement
        if self.is_calm:
            self.factor = self._first
        elif self._last is not None:
            change = residual - self._last
            square = float(change @ change)
            if square > 0.0:
                factor = -self.factor * float(self._last @ change) / square
                self.factor = float(np.clip(factor, self._least, self._most))
        self._last = residual
        return np.asarray(displacement + self.factor * residual)

    def state(self) -> dict[str, Array]:
        """The last residual and factor."""
        last = np.zeros(0) if self._last is None else self._last
        return {"last": last, "factor": np.array([self.factor])}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up the last residual and factor."""
        self._last = arrays["last"] if len(arrays["last"]) else None
        self.factor = float(arrays["factor"][0])


class QuasiNewtonRelaxation:
    """IQN-ILS: the inverse Jacobian of the residual by least squares over the last windows.

    Changes that say hardly anything beside newer ones are left out (QR filter), and what the
    changes cannot span is relaxed with a fixed factor, as in the first window.
    """

    def __init__(self, first: float, columns: int, filter_fraction: float) -> None:
        self.factor = first
        self._first = first
        self._filter = filter_fraction
        # newest first: the filter drops the oldest of columns that say the same
        self._changes: deque[Change] = deque(maxlen=columns)
        self._last: Change | None = None

    def next(self, displacement: Array, solution: Array) -> Array:
        """Go where the residual would vanish if it changed as it did before."""
        residual = solution - displacement
        if self._last is not None:
            last_displacement, last_residual = self._last
            self._changes.appendleft((displacement - last_displacement, residual - last_residual))
        self._last = (displacement.copy(), residual)
        chosen = self._independent()
        step = self._first * residual
        if chosen:
            moves, changes = (np.column_stack(part) for part in zip(*chosen, strict=True))
            weights = np.linalg.lstsq(changes, -residual, rcond=None)[0]
            unseen = residual + changes @ weights
            step = moves @ weights + self._first * unseen
        square = float(residual @ residual)
        self.factor = float(step @ residual) / square if square > 0.0 else self._first
        return np.asarray(displacement + step)

    def _independent(self) -> list[Change]:
        """Changes that add to the newer ones, by Gram and Schmidt on their residuals."""
        basis: list[Array] = []
        chosen = []
        for move, change in self._changes:
            left = change.copy()
            for direction in basis:
                left -= direction * (direction @ left)
            size = float(np.linalg.norm(left))
            if size > self._filter * float(np.linalg.norm(change)):
                basis.append(left / size)
                chosen.append((move, change))
        return chosen

    def state(self) -> dict[str, Array]:
        """All changes."""
        if self._last is None:
            return {}
        return {"last": np.array(self._last), "changes": np.array(self._changes)}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up all changes."""
        if arrays:
            self._last = (arrays["last"][0], arrays["last"][1])
            self._changes.extend((move, change) for move, change in arrays["changes"])


def relaxation_of(loop: Loop) -> Relaxation:
    """A fresh memory of the scheme of a loop that has windows."""
    if loop.scheme == "one_way":
        return FixedRelaxation(0.0)
    if loop.scheme in ("fixed", "per_layer"):
        return FixedRelaxation(loop.factor)
    if loop.scheme == "measured":
        return MeasuredRelaxation(
            loop.factor, loop.least_factor, loop.most_factor, loop.limit_share
        )
    if loop.scheme == "aitken":
        return AitkenRelaxation(loop.factor, loop.least_factor, loop.most_factor)
    return QuasiNewtonRelaxation(loop.factor, _COLUMNS, _FILTER)
