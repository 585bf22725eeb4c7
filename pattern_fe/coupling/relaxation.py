"""How far the pattern is moved towards the displacement that the last loads give.

With x the displacement at the interface in a window and G(x) the one that its loads give, the loop
seeks x = G(x); R(x) = G(x) - x is the residual. Sand that is g times as stiff as the pattern makes
G(x) about -g x: the plain loop x <- G(x) diverges for g > 1, a fixed relaxation factor below
2 / (1 + g) holds. Words as in Degroote, Bathe and Vierendeels 2009, Computers and Structures 87,
793-801 (IQN-ILS), and Küttler and Wall 2008, Computational Mechanics 43, 61-72 (Aitken).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque

import numpy as np
from numpy.typing import NDArray

from sandmould.scenario.pattern import Loop

Array = NDArray[np.float64]
Change = tuple[Array, Array]
"""Of the displacement at the interface, and of the residual."""
_COLUMNS = 10
"""Changes that the quasi-Newton scheme remembers."""
STRUCK = 2.0
"""Ratio of residuals from which on an iteration is rejected. Below it secants may lead on: they are
fast just because their residuals need not fall at every step. A surface that creeps to its place in
sand at rest has larger residuals than one that stands still, too: dashpots resist it."""
_PARTS = (0.1, 0.5)
"""Least and greatest part of a way that led farther off, as line searches have them."""
_LIMIT_SHARE = 0.5
"""Of the limit 2 / (1 + gain), in the measured scheme."""
_FILTER = 1e-2
"""Part of a change that must be new: below it is noise of the sand."""


class Relaxation(ABC):
    """Chooses the next displacement at the interface; arrays are (k,) float64, m."""

    keeps_nearest = False
    """Whether a window that ends far off is the iteration of it with the least residual. Shares
    that are prescribed keep the last one, so that a share too large is seen to diverge."""

    def __init__(self, factor: float) -> None:
        self.factor = factor
        """Relaxation factor of the last call: part of the residual that was gone, along it."""

    def begin_window(self, is_iterated: bool) -> None:  # noqa: B027
        """Hear that a new window begins, and whether it may be computed more than once."""

    @abstractmethod
    def next(self, displacement: Array, solution: Array) -> Array:
        """Next displacement, from that of an iteration, x, and the one its loads give, G(x)."""

    def state(self) -> dict[str, Array]:
        """Memory, for a checkpoint."""
        return {}

    def restore(self, arrays: dict[str, Array]) -> None:  # noqa: B027
        """Take up a memory."""


class FixedRelaxation(Relaxation):
    """The same factor for every residual."""

    def next(self, displacement: Array, solution: Array) -> Array:
        """Go the factor times the residual."""
        return np.asarray(displacement + self.factor * (solution - displacement))


class MeasuredRelaxation(FixedRelaxation):
    """A part of the limit 2 / (1 + g) of a fixed factor, for a gain that was measured."""

    def __init__(self, first: float, least: float, most: float) -> None:
        super().__init__(first)
        self._least, self._most = least, most

    def set_limit(self, limit: float) -> None:
        """Take up the limit that a new gain sets."""
        self.factor = float(np.clip(_LIMIT_SHARE * limit, self._least, self._most))

    def state(self) -> dict[str, Array]:
        """The factor."""
        return {"factor": np.array([self.factor])}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up the factor."""
        self.factor = float(arrays["factor"][0])


class AitkenRelaxation(Relaxation):
    """One factor for all, from how the last two residuals differ (Küttler and Wall 2008, (44)).

    Its sign and size are kept within bounds: noise of the sand in the residuals would throw it.
    Where sand lets go of a surface and strikes it, secants lead to and fro between the two. So an
    iteration that is much farther off than the one before it in its window is rejected: the next
    starts from that one again and goes a part of the way.
    """

    keeps_nearest = True

    def __init__(self, first: float, least: float, most: float) -> None:
        super().__init__(first)
        self._first = first
        self._least, self._most = least, most
        self._last: Array | None = None
        self._is_iterated = False
        self._iterations = 0
        """Of this window up to now."""
        self._from: Change | None = None
        """Displacement and residual that the last step of this window went from, if iterated."""
        self._too_far: Array | None = None
        """Displacement of the last iteration that was rejected in this window."""
        self._led = first
        """Factor of the last step that was not rejected."""
        self.is_calm = False
        """Whether the factor is the first one: where sand rests, and no window is computed again,
        residuals differ by noise alone, which tells no factor."""

    def begin_window(self, is_iterated: bool) -> None:
        """After a window that was iterated, go on with the factor that led to its end alone.

        Loads of two windows differ for other reasons than the displacement. Where windows are
        computed once, there is nothing else to learn from.
        """
        self._is_iterated = is_iterated
        self._from = self._too_far = None
        if self._iterations > 1:
            self._last = None
            self.factor = float(np.clip(self._led, self._least, self._most))
        self._iterations = 0

    def next(self, displacement: Array, solution: Array) -> Array:
        """Go with the factor that would have made the last residual vanish."""
        residual = solution - displacement
        self._iterations += self._is_iterated
        if self._from is not None:
            start, before = self._from
            if residual @ residual > STRUCK**2 * float(before @ before):
                self.factor *= float(np.clip(self._secant(before, residual), *_PARTS))
                self._too_far = displacement.copy()
                return np.asarray(start + self.factor * before)
        self._led = self.factor
        if self.is_calm:
            self.factor = self._first
        elif self._last is not None:
            factor = self.factor * self._secant(self._last, residual)
            self.factor = float(np.clip(factor, self._least, self._most))
        if self._too_far is not None and residual.any():
            way = np.linalg.norm(self._too_far - displacement) / np.linalg.norm(residual)
            self.factor = min(self.factor, _PARTS[1] * float(way))
        self._last = residual
        if self._is_iterated:
            self._from = displacement.copy(), residual
        return np.asarray(displacement + self.factor * residual)

    @staticmethod
    def _secant(before: Array, after: Array) -> float:
        """Part of the way between residuals at which it vanishes; all where they hardly differ."""
        change = after - before
        square = float(change @ change)
        return -float(before @ change) / square if square > 0.0 else 1.0

    def state(self) -> dict[str, Array]:
        """The last residual and factors."""
        last = np.zeros(0) if self._last is None else self._last
        more = {"led": np.array([self._led]), "iterations": np.array([self._iterations])}
        return {"last": last, "factor": np.array([self.factor])} | more

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up the last residual and factors."""
        self._last = arrays["last"] if len(arrays["last"]) else None
        self.factor = float(arrays["factor"][0])
        self._led, self._iterations = float(arrays["led"][0]), int(arrays["iterations"][0])


class QuasiNewtonRelaxation(Relaxation):
    """IQN-ILS: the inverse Jacobian of the residual by least squares over the last windows.

    Changes that say hardly anything beside newer ones are left out (QR filter), and what the
    changes cannot span is relaxed with a fixed factor, as in the first window.
    """

    keeps_nearest = True

    def __init__(self, first: float, columns: int, filter_fraction: float) -> None:
        super().__init__(first)
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
        return MeasuredRelaxation(loop.factor, loop.least_factor, loop.most_factor)
    if loop.scheme == "aitken":
        return AitkenRelaxation(loop.factor, loop.least_factor, loop.most_factor)
    return QuasiNewtonRelaxation(loop.factor, _COLUMNS, _FILTER)
