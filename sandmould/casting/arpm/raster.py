"""Materials on a grid of cells, painted from outlines, meshes or pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandmould.arrays import Flags, Floats, Ints
from sandmould.scenario.casting.shapes import Body, held_by

MOULD, CASTING = 0, 1
"""Materials of all that is not painted, and of what is poured; others are inserts and air."""


class BesideFaces(NamedTuple):
    """What passes heat beside a surface other than whole faces."""

    low: Ints
    """(f,) int64: cells on the low side of faces within a material."""
    axis: Ints
    share: Floats
    """(f,) float64: of each face that lies in the material."""
    link: Ints
    """(2, l) int64: cells of a material that do not touch in it."""
    link_share: Floats
    """(l,) float64: over what a whole face between two cells passes."""


@dataclass(frozen=True)
class Cut:
    """What a drawn surface that is not on the grid makes of the cells beside it."""

    cell: Ints
    """(c,) int64: cells in C order that hold more or less than their square or cube."""
    volume_share: Floats
    """(c,) float64: what each holds over it."""
    low: Ints
    """(f,) int64: cells on the low side of faces between unlike materials."""
    axis: Ints
    """(f,) int64: across which axis each of these faces lies."""
    area_share: Floats
    """(f,) float64: the drawn surface's area there over a full face's."""
    low_part: Floats
    """(f,) float64: of the line between the two centres, what lies in the low cell's material."""
    passage: BesideFaces
    """How heat passes along the surface."""


@dataclass(frozen=True)
class Raster:
    """Material of each cell of a regular grid.

    Raises
    ------
    ValueError
        When it is neither 2D nor 3D, empty, or its cells have no size.
    """

    material: Ints
    """(nx, ny) or (nx, ny, nz) int64."""
    cell_m: float
    low_m: Floats
    """(d,) float64, m: the grid's corner."""
    cut: Cut | None = None
    """None where materials meet at faces of the grid."""

    def __post_init__(self) -> None:
        if self.material.ndim not in (2, 3) or not self.material.size:
            raise ValueError(
                f"the grid of materials has the shape {self.material.shape}; it must be 2D or 3D "
                "and have cells"
            )
        if not self.cell_m > 0.0:
            raise ValueError(f"cell_m is {self.cell_m}; it must be above 0")
        if len(self.low_m) != self.material.ndim:
            raise ValueError(f"low_m is {self.low_m}; a {self.material.ndim}D grid needs as many")

    @property
    def centre_m(self) -> Floats:
        """Centres of the cells in C order, (n, d) float64, m."""
        axes = [
            low + (np.arange(n) + 0.5) * self.cell_m
            for low, n in zip(self.low_m, self.material.shape, strict=True)
        ]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def painted(low_m: Floats, high_m: Floats, cell_m: float, solids: Mapping[int, Body]) -> Raster:
    """Paint solids into a box of mould; a cell is a solid's where its centre is inside.

    Where solids overlap, the last one has the place. A side of the box that is no multiple of the
    cells grows to the next one: at its high end, or at the low one where a solid touches the high.
    ``low_m``, ``high_m``, (d,) float64, m: corners of the box. ``solids``: outlines in 2D, meshes
    in 3D; material 0 is the mould round them.

    Raises
    ------
    ValueError
        When a solid touches both ends of a side that is no multiple of the cells, or holds no cell.
    """
    size_m = high_m - low_m
    cells = np.round(size_m / cell_m).astype(np.int64)
    off = ~np.isclose(cells * cell_m, size_m, rtol=1e-9)
    cells[off] = np.ceil(size_m[off] / cell_m)
    ends_m = np.concatenate(
        [solid.corners() for solid in solids.values()] or [0.5 * (low_m + high_m)[None]]
    )
    near = 1e-6 * size_m
    low_met, high_met = ends_m.min(axis=0) < low_m + near, ends_m.max(axis=0) > high_m - near
    if (off & low_met & high_met).any():
        raise ValueError(
            f"the box measures {size_m.tolist()} m; a side that the casting fills must be a "
            f"multiple of cell_m = {cell_m}"
        )
    low_m = np.where(off & high_met, high_m - cells * cell_m, low_m)
    raster = Raster(np.zeros(cells, dtype=np.int64), cell_m, low_m)
    centre, flat = raster.centre_m, raster.material.reshape(-1)
    for material, solid in solids.items():
        if material == MOULD:
            raise ValueError(f"{solid.name} has material {MOULD}, which is the mould's")
        inside = inside_solid(solid, centre)
        if not inside.any():
            raise ValueError(f"{solid.name} holds no cell of {cell_m} m; it must lie in the box")
        flat[inside] = material
    return raster


def inside_solid(solid: Body, position_m: Floats) -> Flags:
    """Which points a solid holds; only those among its corners are measured, which costs."""
    corners = solid.corners()
    low_m, high_m = corners.min(axis=0), corners.max(axis=0)
    inside = ((position_m >= low_m) & (position_m <= high_m)).all(axis=1)
    inside[inside] = held_by(solid, position_m[inside])
    return inside
