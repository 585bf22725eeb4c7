"""The choices of a run: how elements exchange heat and how time goes forward.

Elements at free positions in 2D have the faces of a power diagram (Laguerre-Voronoi): where the
power distances |x - x_i|^2 - w_i of two are equal. A face stands across the line between them, so
that a linear temperature gives the exact flux. Aurenhammer, SIAM Journal on Computing 16 (1987)
78-96: the diagram is the lower hull of points lifted to |x|^2 - w.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import ConvexHull

from sandmould.arrays import Floats, Ints
from sandmould.casting.arpm.difference import DifferenceSteps
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.exchange import Exchange, face_exchange, over_faces, resistances
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.kernel import kernel_exchange, with_images
from sandmould.casting.arpm.local_steps import LocalSteps
from sandmould.casting.arpm.marching import (
    STEP_SHARE,
    ExplicitSteps,
    Marching,
    Substance,
    SuperSteps,
)
from sandmould.casting.arpm.raster import Raster

Exchanging = Literal["printed", "corrected", "symmetric", "faces", "power", "difference"]
Stepping = Literal["explicit", "super", "local"]
STEPS = {"explicit": ExplicitSteps, "super": SuperSteps, "local": LocalSteps}
REACH = 3.0
"""Sizes within which images stand behind the walls."""


@dataclass(frozen=True)
class HeatMethod:
    """One way to compute a casting."""

    exchange: Exchanging = "faces"
    """Three readings of eqs. (4) and (5), true faces on a grid, faces of a power diagram for free
    positions, or finite differences on a plain grid."""
    stepping: Stepping = "local"
    kernel_size: float = 2.1
    """c_k of the paper; of no use to faces."""
    refuse_ratio: bool = True
    """Whether sizes that break the paper's rule of 1/c_k are refused."""
    step_share: float = STEP_SHARE
    threads: int = 1

    def exchange_of(self, elements: Elements, filling: Filling) -> Exchange:
        """Rates between elements.

        Raises
        ------
        ValueError
            When the sizes do not suit the exchange, or it is that of a plain grid.
        """
        conductivity, resistance = filling.conductivity_w_m_k, filling.least_m2k_w
        if self.exchange == "faces":
            return face_exchange(elements, conductivity, resistance, curves=filling.curves)
        if filling.curves is not None:
            raise ValueError("conductances that vary need an exchange over faces")
        if self.exchange == "power":
            return power_exchange(elements, conductivity, resistance)
        if self.exchange == "difference":
            raise ValueError("finite differences have no exchange of elements: give their raster")
        return kernel_exchange(
            elements, conductivity, resistance, self.kernel_size, self.exchange, self.refuse_ratio
        )

    def marching(self, elements: Elements, filling: Filling, raster: Raster) -> Marching:
        """Make ready to go forward in time.

        ``elements``: placed on the raster; of one size for finite differences.

        Raises
        ------
        ValueError
            When finite differences are asked for with elements of several sizes.
        """
        if self.exchange == "difference":
            if len(elements.size_m) != raster.material.size:
                raise ValueError("finite differences need elements of one size: no layers")
            if filling.curves is not None:
                raise ValueError("conductances that vary need an exchange over faces")
            return DifferenceSteps(
                raster, filling.table, filling.conductivity_w_m_k, filling.least_m2k_w,
                self.step_share, self.threads,
            )  # fmt: skip
        return self.stepping_of(elements, filling)

    def stepping_of(self, elements: Elements, filling: Filling) -> Marching:
        """Make elements ready to go forward in time; errors as those of ``exchange_of``."""
        substance = Substance(elements.material, filling.table)
        steps = STEPS[self.stepping]
        return steps(self.exchange_of(elements, filling), substance, share=self.step_share,
                     threads=self.threads)  # fmt: skip


def power_exchange(
    elements: Elements, conductivity_w_m_k: Floats, resistance_m2k_w: float | Floats
) -> Exchange:
    """Rates over the faces of a power diagram with weights (r0/2)^2.

    Its volumes are those of the diagram's cells, not of squares.

    Parameters
    ----------
    elements : Elements
        Of 2D, at any positions in their box; its walls are insulated.
    conductivity_w_m_k : (m,) float64, W/m/K
    resistance_m2k_w : float or (m, m) float64, m2 K/W

    Raises
    ------
    ValueError
        When the elements are in 3D, or one has no cell because a larger one covers it.
    """
    between = resistances(resistance_m2k_w, len(conductivity_w_m_k))
    if elements.dimensions != 2:
        raise ValueError("elements at free positions are in 3D; power diagrams are drawn in 2D")
    first, second, length, near_m, distance = _edges(elements)
    n = len(elements.size_m)
    real = second < n
    volume = np.bincount(first, 0.5 * length * near_m, n).astype(np.float64)
    least_m = np.full(n, -1.0)
    least_m[first] = np.inf
    np.minimum.at(least_m, first, near_m)
    if not (least_m > 0.0).all():
        place = elements.position_m[np.argmin(least_m)].tolist()
        raise ValueError(f"the element at {place} m lies in no cell of its own; it must stand "
                         "farther from larger ones")  # fmt: skip
    first, second, length = first[real], second[real], length[real]
    near_m, far_m = near_m[real], (distance - near_m)[real]
    material, other = elements.material[first], elements.material[second]
    path = near_m / conductivity_w_m_k[material] + far_m / conductivity_w_m_k[other]
    path += between[material, other]
    once = first < second
    return over_faces(first[once], second[once], np.asarray(length / path)[once], volume)


def _edges(elements: Elements) -> tuple[Ints, Ints, Floats, Floats, Floats]:
    """Faces: own, other (from n on an image behind a wall), length, distance of own, of centres."""
    place, number = with_images(elements, REACH * float(elements.size_m.max()))
    scale = float(elements.size_m.max())
    centre = 0.5 * (elements.low_m + elements.high_m)
    at = (place - centre) / scale
    power = (0.5 * elements.size_m[number] / scale) ** 2
    hull = ConvexHull(np.column_stack([at, (at**2).sum(axis=1) - power]))
    low = hull.equations[:, 2] < -1e-12
    corners = hull.simplices[low].astype(np.int64)
    # the plane under a facet is that of the power of its triangle's centre
    equation = hull.equations[low]
    vertex = -0.5 * equation[:, :2] / equation[:, 2:3]
    ends = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]))
    triangle = np.tile(np.arange(len(corners)), 3)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, triangle = ends[order], triangle[order]
    paired = np.flatnonzero((ends[1:] == ends[:-1]).all(axis=1))
    first, second = ends[paired].T
    length = np.linalg.norm(vertex[triangle[paired]] - vertex[triangle[paired + 1]], axis=1)
    own, other = np.concatenate([first, second]), np.concatenate([second, first])
    keep = (own < len(elements.size_m)) & (np.tile(length, 2) > 1e-9)
    own, other, length = own[keep], other[keep], np.tile(length, 2)[keep]
    distance = np.linalg.norm(at[own] - at[other], axis=1)
    near = 0.5 * (distance**2 + power[own] - power[other]) / distance
    return own, other, length * scale, near * scale, distance * scale
