"""How far the pattern is moved towards the displacement that the last loads give.

With x the displacement that the sand saw in a window and G(x) the one that its loads give, the
loop seeks x = G(x); R(x) = G(x) - x is the residual. Sand that is g times as stiff as the pattern
makes G(x) about -g x: the plain loop x <- G(x) diverges for g > 1, a fixed factor below 2 / (1 + g)
holds. Words as in Degroote, Bathe and Vierendeels 2009, Computers and Structures 87, 793-801
(IQN-ILS), and Küttler and Wall 2008, Computational Mechanics 43, 61-72 (Aitken).
"""

from __future__ import annotations

from collections import deque
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Change = tuple[Array, Array]
"""Of what was shown, and of the residual."""


class Relaxation(Protocol):
    """Chooses the next displacement; arrays are (k,) float64, m."""

    factor: float
    """Share of the residual that was last gone, along the residual."""

    def next(self, shown: Array, answered: Array) -> Array:
        """Displacement to show next, from the one shown and the one that its loads give."""

    def state(self) -> dict[str, Array]:
        """Memory, for a checkpoint."""

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up a memory."""


class Fixed:
    """The same share of every residual."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def next(self, shown: Array, answered: Array) -> Array:
        """Go the share."""
        return np.asarray(shown + self.factor * (answered - shown))

    def state(self) -> dict[str, Array]:
        """Nothing is remembered."""
        return {}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Nothing is remembered."""


class Measured(Fixed):
    """A share of the limit 2 / (1 + g) of a fixed factor, for a gain that was measured."""

    def __init__(self, first: float, least: float, most: float, share: float) -> None:
        super().__init__(first)
        self._least, self._most, self._share = least, most, share

    def learn(self, limit: float) -> None:
        """Take up the limit that a new gain sets."""
        self.factor = float(np.clip(self._share * limit, self._least, self._most))

    def state(self) -> dict[str, Array]:
        """The factor."""
        return {"factor": np.array([self.factor])}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up the factor."""
        self.factor = float(arrays["factor"][0])


class Aitken:
    """One share for all, from how the last two residuals differ (Küttler and Wall 2008, (44)).

    Its sign and size are kept within bounds: noise of the sand in the residuals would throw it.
    """

    def __init__(self, first: float, least: float, most: float) -> None:
        self.factor = first
        self._least, self._most = least, most
        self._last: Array | None = None

    def next(self, shown: Array, answered: Array) -> Array:
        """Go a share that would have made the last residual vanish."""
        residual = answered - shown
        if self._last is not None:
            change = residual - self._last
            square = float(change @ change)
            if square > 0.0:
                share = -self.factor * float(self._last @ change) / square
                self.factor = float(np.clip(share, self._least, self._most))
        self._last = residual
        return np.asarray(shown + self.factor * residual)

    def state(self) -> dict[str, Array]:
        """The last residual and share."""
        last = np.zeros(0) if self._last is None else self._last
        return {"last": last, "factor": np.array([self.factor])}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up the last residual and share."""
        self._last = arrays["last"] if len(arrays["last"]) else None
        self.factor = float(arrays["factor"][0])


class QuasiNewton:
    """IQN-ILS: the inverse Jacobian of the residual by least squares over the last windows.

    Changes that say hardly anything beside newer ones are left out (QR filter), and what the
    changes cannot span goes a fixed share, as in the first window.
    """

    def __init__(self, first: float, columns: int, filter_fraction: float) -> None:
        self.factor = first
        self._first = first
        self._filter = filter_fraction
        # newest first: the filter drops the oldest of columns that say the same
        self._changes: deque[Change] = deque(maxlen=columns)
        self._last: Change | None = None

    def next(self, shown: Array, answered: Array) -> Array:
        """Go where the residual would vanish if it changed as it did before."""
        residual = answered - shown
        if self._last is not None:
            last_shown, last_residual = self._last
            self._changes.appendleft((shown - last_shown, residual - last_residual))
        self._last = (shown.copy(), residual)
        chosen = self._independent()
        step = self._first * residual
        if chosen:
            moves, changes = (np.column_stack(part) for part in zip(*chosen, strict=True))
            weights = np.linalg.lstsq(changes, -residual, rcond=None)[0]
            unseen = residual + changes @ weights
            step = moves @ weights + self._first * unseen
        square = float(residual @ residual)
        self.factor = float(step @ residual) / square if square > 0.0 else self._first
        return np.asarray(shown + step)

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
