"""Heat exchange between elements as a sparse matrix, and the steps that it allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from sandmould.arrays import Floats, Ints
from sandmould.casting.arpm.raster import CASTING
from sandmould.casting.arpm.varying import VaryingFaces


@dataclass(frozen=True)
class Exchange:
    """Heat that each element takes up: dH_i/dt = sum over j of rate_ij (T_j - T_i)."""

    start: Ints
    """(n + 1,) int64: where the neighbours of each element begin."""
    neighbour: NDArray[np.int32]
    """(p,) int32, in rising order for each element."""
    rate_w_m3_k: Floats
    """(p,) float64, W/m3/K."""
    volume_m3: Floats
    """(n,) float64, m3, or m2 in 2D."""
    varying: VaryingFaces | None = None
    """Faces whose conductance is not always the same; the rates are then the largest ones."""

    def limit_s(self, capacity_j_m3_k: Floats) -> Floats:
        """Longest stable explicit step of each element, (n,) float64, s.

        Half the row sum of Gershgorin's circle; where all rates are positive, temperatures then
        stay between those of the neighbours before the step. ``capacity_j_m3_k``, (n,) float64,
        J/m3/K: without latent heat, which only slows an element down.
        """
        size = np.add.reduceat(np.abs(self._padded()), self.start[:-1])
        total = np.add.reduceat(self._padded(), self.start[:-1])
        alone = np.diff(self.start) == 0
        row = np.where(alone, 0.0, 0.5 * (size + np.abs(total)))
        with np.errstate(divide="ignore"):
            return np.asarray(capacity_j_m3_k / row)

    def _padded(self) -> Floats:
        """Rates with one more: reduceat takes no start behind the last entry."""
        return np.append(self.rate_w_m3_k, 0.0)


def from_rows(row: Ints, column: Ints, rate_w_m3_k: Floats, volume_m3: Floats) -> Exchange:
    """Sort rates into rows; those of pairs named twice are summed.

    Parameters
    ----------
    row, column : (p,) int64
        The element that takes heat up, and the one that it comes from.
    rate_w_m3_k : (p,) float64, W/m3/K
    volume_m3 : (n,) float64, m3
    """
    n = len(volume_m3)
    matrix = coo_array((rate_w_m3_k, (row, column)), (n, n)).tocsr()
    matrix.sort_indices()
    return Exchange(
        matrix.indptr.astype(np.int64),
        matrix.indices.astype(np.int32),
        np.asarray(matrix.data, dtype=np.float64),
        volume_m3,
    )


def resistances(resistance_m2k_w: float | Floats, count: int) -> Floats:
    """Resistance between each two of some materials, (count, count) float64, m2 K/W.

    ``resistance_m2k_w``, float or (count, count) float64, m2 K/W: a number acts where the casting
    meets another material: two moulds lie in one another.

    Raises
    ------
    ValueError
        When one is negative or not finite.
    """
    found = np.asarray(resistance_m2k_w, dtype=np.float64)
    if not (np.isfinite(found).all() and (found >= 0.0).all()):
        raise ValueError(
            f"resistance_m2k_w is {resistance_m2k_w}; it must be finite and at least 0"
        )
    if found.ndim:
        return found
    cast = np.arange(count) == CASTING
    return np.where(cast[:, None] != cast, found, 0.0)
