"""Elements of several sizes: where they are, how large, and of which material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm.raster import Cut, Raster


@dataclass(frozen=True)
class Elements:
    """Squares or cubes, given by their centres and sides.

    Raises
    ------
    ValueError
        When a size is not above 0 or the arrays' lengths differ.
    """

    position_m: Floats
    """(n, d) float64, m."""
    size_m: Floats
    """(n,) float64, m: r0 of the paper."""
    material: Ints
    """(n,) int64."""
    low_m: Floats
    """(d,) float64, m: corners of the box that they fill."""
    high_m: Floats
    cut: Cut | None = None
    """Of the grid whose cells the elements cover, where a drawn surface cuts them."""
    cell_m: float | None = None
    """Of the cut grid."""
    cut_volume_m3: Floats | None = None
    """(n,) float64: what elements hold that a drawn surface cuts or that stand beside one."""

    def __post_init__(self) -> None:
        lengths = {len(self.position_m), len(self.size_m), len(self.material)}
        if lengths != {len(self.size_m)} or not len(self.size_m):
            raise ValueError(f"positions, sizes and materials number {sorted(lengths)}; as many "
                             "of each are needed, and at least one")  # fmt: skip
        if not (self.size_m > 0.0).all():
            raise ValueError(f"an element has size_m {self.size_m.min()}; it must be above 0")

    @property
    def dimensions(self) -> int:
        """2 or 3."""
        return self.position_m.shape[1]

    @property
    def grid_m(self) -> float:
        """Side of the cells on which elements lie: of the smallest, or those of the cut grid."""
        return self.cell_m or float(self.size_m.min())

    @property
    def volume_m3(self) -> Floats:
        """(n,) float64, m3, or m2 in 2D."""
        if self.cut_volume_m3 is not None:
            return self.cut_volume_m3
        return np.asarray(self.size_m**self.dimensions)

    def counts(self) -> dict[float, int]:
        """How many there are of each size (m)."""
        size, count = np.unique(np.round(self.size_m, 12), return_counts=True)
        return dict(zip(size.tolist(), count.tolist(), strict=True))


def placed(raster: Raster, layers: Sequence[int] = ()) -> Elements:
    """Replace cells by elements of twice, four times ... their size away from interfaces.

    In C order of their low corners. ``raster``: its cells are the small elements. ``layers``: one
    for each doubling: how many layers of the smaller size stay between the doubled elements and the
    interface of materials or, from the second on, the next smaller size. Empty for elements of one
    size; 0 doubles wherever a block is of one material.

    Raises
    ------
    ValueError
        When a number of layers is negative.
    """
    if any(n < 0 for n in layers):
        raise ValueError(f"layers are {list(layers)}; none may be negative")
    span = np.ones(raster.material.shape, dtype=np.int64)
    distance = _from_interface(raster.material)
    for level, layer_count in enumerate(layers, start=1):
        half = 2 ** (level - 1)
        if level > 1:
            distance = _distance_to(span < half)
        mergeable = _all_in_block((distance > layer_count * half) & (span == half), 2 * half)
        if layer_count == 0:
            mergeable &= _one_material(raster.material, 2 * half)
        span[mergeable] = 2 * half
    return _elements(raster, span)


def _from_interface(material: Ints) -> Floats:
    """Distance, in cells, of each cell's centre to the nearest of another material."""
    distance = np.full(material.shape, np.inf)
    for number in np.unique(material):
        own = material == number
        distance[own] = _distance_to(~own)[own]
    return distance


def _distance_to(there: Flags) -> Floats:
    if not there.any():
        return np.full(there.shape, np.inf)
    return np.asarray(distance_transform_edt(~there), dtype=np.float64)


def _blocks(values: NDArray[np.generic], side: int) -> NDArray[np.generic]:
    """A view of whole blocks, axes (block, within) in turn for each dimension."""
    whole = tuple(slice(0, n // side * side) for n in values.shape)
    shape = [k for n in values.shape for k in (n // side, side)]
    return values[whole].reshape(shape)


def _spread(of_block: Flags, side: int, shape: tuple[int, ...]) -> Flags:
    of_cell = np.zeros(shape, dtype=np.bool_)
    for axis in range(len(shape)):
        of_block = np.repeat(of_block, side, axis=axis)
    of_cell[tuple(slice(0, n) for n in of_block.shape)] = of_block
    return of_cell


def _all_in_block(good: Flags, side: int) -> Flags:
    """Cells whose whole block is good; those of blocks cut off at the edge are not."""
    within = tuple(range(1, 2 * good.ndim, 2))
    return _spread(np.all(_blocks(good, side), axis=within), side, good.shape)


def _one_material(material: Ints, side: int) -> Flags:
    within = tuple(range(1, 2 * material.ndim, 2))
    apart = np.ptp(np.asarray(_blocks(material, side)), axis=within)
    return _spread(np.equal(apart, 0), side, material.shape)


def _elements(raster: Raster, span: Ints) -> Elements:
    place = np.indices(span.shape)
    corner = np.all(place % span == 0, axis=0)
    low = place[:, corner].T
    size_m = (span[corner] * raster.cell_m).astype(np.float64)
    elements = Elements(
        (raster.low_m + low * raster.cell_m + 0.5 * size_m[:, None]).astype(np.float64),
        size_m,
        raster.material[corner],
        raster.low_m,
        (raster.low_m + np.array(span.shape) * raster.cell_m).astype(np.float64),
    )
    if raster.cut is None:
        return elements
    cut = raster.cut
    number = np.cumsum(corner.reshape(-1)) - 1
    at = np.stack(np.unravel_index(cut.cell, span.shape))
    first = at // span[tuple(at)] * span[tuple(at)]
    owner = number[np.ravel_multi_index(tuple(first), span.shape)]
    volume_m3 = elements.volume_m3
    np.add.at(volume_m3, owner, (cut.volume_share - 1.0) * raster.cell_m**elements.dimensions)
    return replace(elements, cut=cut, cell_m=raster.cell_m, cut_volume_m3=volume_m3)
