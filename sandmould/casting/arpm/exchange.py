"""Heat that elements exchange: rates in rows, and rates over the true faces between elements.

Faces are finite volumes on the same layout. Heat that leaves one element through a face enters the
other, so enthalpy is conserved to round-off; the interface's resistance lies on the face. Where one
large face meets several small ones, all of them carry the same flux density, driven by the small
elements' mean temperature (Losasso, Fedkiw and Osher, Computers & Fluids 35 (2006) 995-1010): the
small centres lie beside the large one's, and only their mean lies opposite it. So a linear
temperature gives the exact flux, and the matrix stays symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, eye_array, vstack

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.raster import CASTING, Cut
from sandmould.casting.arpm.varying import Curves, MetFaces, VaryingFaces, varying_faces


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


@dataclass(frozen=True)
class Faces:
    """Where elements touch."""

    first: Ints
    """(f,) int64: the element on the low side of each face."""
    second: Ints
    axis: Ints
    """(f,) int64: across which axis the face lies."""
    area_m2: Floats
    """(f,) float64, m2, or m in 2D: of the grid."""
    drawn_share: Floats
    """(f,) float64: the drawn surface's area over ``area_m2``; within a material what of the face
    lies in it."""
    first_part: Floats
    """(f,) float64: of the line between the cells' centres on both sides, that in the first's
    material."""


def owners(elements: Elements) -> Ints:
    """Number of the element that covers each cell of the finest size.

    Gives (nx, ny) or (nx, ny, nz) int64.

    Raises
    ------
    ValueError
        When elements overlap, leave gaps, or lie on no common grid.
    """
    cell = elements.grid_m
    low = (elements.position_m - 0.5 * elements.size_m[:, None] - elements.low_m) / cell
    span = elements.size_m / cell
    corner, side = np.round(low).astype(np.int64), np.round(span).astype(np.int64)
    if np.abs(low - corner).max() > 1e-6 or np.abs(span - side).max() > 1e-6:
        raise ValueError(
            f"an element's corner or size is no multiple of the smallest, {cell:g} m; faces of "
            "elements at free positions come from a power diagram"
        )
    shape = np.round((elements.high_m - elements.low_m) / cell).astype(np.int64)
    owner = np.full(shape, -1, dtype=np.int64)
    for width in np.unique(side):
        own = np.flatnonzero(side == width)
        for offset in np.ndindex(*[int(width)] * len(shape)):
            owner[tuple((corner[own] + np.array(offset)).T)] = own
    if (owner < 0).any() or int((side ** len(shape)).sum()) != owner.size:
        raise ValueError("elements overlap or leave gaps; squares or cubes must fill the box")
    return owner


def faces_of(elements: Elements) -> Faces:
    """Find all faces between squares or cubes of any sizes on a grid."""
    owner, n, cell = owners(elements), len(elements.size_m), elements.grid_m
    parts = []
    for axis in range(owner.ndim):
        before = np.take(owner, range(owner.shape[axis] - 1), axis=axis).ravel()
        after = np.take(owner, range(1, owner.shape[axis]), axis=axis).ravel()
        apart = before != after
        pair, of, count = np.unique(
            before[apart] * n + after[apart], return_inverse=True, return_counts=True
        )
        area = count * cell ** (owner.ndim - 1)
        share, part = np.ones(len(pair)), np.full(len(pair), 0.5)
        if elements.cut:
            share, part = _drawn(elements.cut, owner.shape, axis, apart, of, count)
        parts.append((pair // n, pair % n, np.full(len(pair), axis), area, share, part))
    first, second, across, areas, shares, first_part = (
        np.concatenate(part) for part in zip(*parts, strict=True)
    )
    return Faces(first, second, across, areas.astype(np.float64), shares, first_part)


def _drawn(cut: Cut, shape: tuple[int, ...], axis: int, apart: Flags, of: Ints, count: Ints
           ) -> tuple[Floats, Floats]:  # fmt: skip
    """Means of the surface's share and the path's part over the cells' faces of each pair."""
    own, within = cut.axis == axis, cut.passage.axis == axis
    inner = tuple(k - (i == axis) for i, k in enumerate(shape))
    place, open_place = (
        np.ravel_multi_index(np.unravel_index(low, shape), inner)
        for low in (cut.low[own], cut.passage.low[within])
    )
    means = []
    for values, plain in ((cut.area_share[own], 1.0), (cut.low_part[own], 0.5)):
        all_faces = np.full(len(apart), plain)
        all_faces[place] = values
        if plain == 1.0:
            all_faces[open_place] = cut.passage.share[within]
        means.append(np.bincount(of, all_faces[apart], len(count)) / count)
    return means[0], means[1]


def face_exchange(
    elements: Elements,
    conductivity_w_m_k: Floats,
    resistance_m2k_w: float | Floats,
    consistent: bool = True,
    curves: Curves | None = None,
) -> Exchange:
    """Rates over true faces.

    Parameters
    ----------
    elements : Elements
        On a grid, as :func:`sandmould.casting.arpm.elements.placed` makes them.
    conductivity_w_m_k : (m,) float64, W/m/K
        Of each material.
    resistance_m2k_w : float or (m, m) float64, m2 K/W
        As of ``resistances``.
    consistent : bool
        Whether small faces on one large face share their flux; without it each has its own.
    curves : Curves, optional
        What conductivities and resistances follow; those given are then the largest and the least.
    """
    between = resistances(resistance_m2k_w, len(conductivity_w_m_k))
    faces = faces_of(elements)
    material, half = elements.material, 0.5 * elements.size_m
    # what the surface is off the face between the two, from the first's side to the second's
    off = (faces.first_part - 0.5) * elements.grid_m
    first, second = faces.first, faces.second
    length = np.stack([half[first] + off, half[second] - off])
    area, share = faces.area_m2, faces.drawn_share
    if elements.cut:
        k, other, through = _links(elements)
        first, second = np.concatenate([first, k]), np.concatenate([second, other])
        length = np.hstack([length, 0.5 * elements.grid_m * np.ones((2, len(k)))])
        area = np.concatenate([area, through])
        share = np.concatenate([share, np.ones(len(k))])
    resists = between[material[first], material[second]]
    within = material[first] == material[second]
    area = area * np.where(within, share, 1.0)
    share = np.where(~within & (resists > 0.0), share, 1.0)
    path = length[0] / conductivity_w_m_k[material[first]]
    path += length[1] / conductivity_w_m_k[material[second]]
    conductance = area * share / (path * share + resists)
    met = MetFaces(first, second, length, area, share, np.empty(0, dtype=np.int64), material)
    into: csr_array = eye_array(len(first), format="csr")
    if consistent:
        k, other, added, sum_of = _shared(elements, faces, conductance)
        first, second = np.concatenate([first, k]), np.concatenate([second, other])
        conductance = np.concatenate([conductance, added])
        into = vstack([into, sum_of], format="csr")
    exchange = over_faces(first, second, conductance, elements.volume_m3)
    if curves is None:
        return exchange
    number = np.full(between.shape, -1)
    for place, pair in enumerate(curves.transfers):
        number[pair] = number[pair[::-1]] = place
    met = met._replace(transfer=number[material[met.first], material[met.second]])
    into = _into_rates(exchange, first, second) @ into
    return replace(exchange, varying=varying_faces(met, into, curves))


def _into_rates(exchange: Exchange, first: Ints, second: Ints) -> csr_array:
    """Which conductances of pairs make which rates, (p, pairs) sparse, 1/m3."""
    n = len(exchange.volume_m3)
    row, column = np.concatenate([first, second]), np.concatenate([second, first])
    own = np.repeat(np.arange(n), np.diff(exchange.start)) * n + exchange.neighbour
    entry = np.searchsorted(own, row * n + column)
    pair = np.tile(np.arange(len(first)), 2)
    return coo_array((1.0 / exchange.volume_m3[row], (entry, pair)), (len(own), len(first))).tocsr()


def _links(elements: Elements) -> tuple[Ints, Ints, Floats]:
    """Elements that heat joins past the surface, and the area (m2) that it has for that."""
    assert elements.cut is not None
    owner, passage = owners(elements).reshape(-1), elements.cut.passage
    first, second = owner[passage.link]
    apart = first != second
    area = passage.link_share[apart] * elements.grid_m ** (elements.dimensions - 1)
    return first[apart], second[apart], area


def over_faces(first: Ints, second: Ints, conductance_w_k: Floats, volume_m3: Floats) -> Exchange:
    """Exchange of conductances between pairs: what the first gains the second loses.

    Parameters
    ----------
    first, second : (p,) int64
    conductance_w_k : (p,) float64, W/K
    volume_m3 : (n,) float64, m3
    """
    row, column = np.concatenate([first, second]), np.concatenate([second, first])
    rate = np.concatenate([conductance_w_k, conductance_w_k]) / volume_m3[row]
    return from_rows(row, column, rate, volume_m3)


def _shared(elements: Elements, faces: Faces, conductance: Floats
            ) -> tuple[Ints, Ints, Floats, csr_array]:  # fmt: skip
    """Pairs of small elements on a large face, what sharing its flux adds, and that by faces."""
    # With shares a_k of the large face, q = h (T_large - sum a_k T_k) on all of it: beside the
    # plain exchange this couples k and l by -a_k a_l times the conductance of the whole face.
    size = elements.size_m
    first_larger = size[faces.first] > size[faces.second] * (1.0 + 1e-9)
    second_larger = size[faces.second] > size[faces.first] * (1.0 + 1e-9)
    jump = np.flatnonzero(first_larger | second_larger)
    large = np.where(first_larger, faces.first, faces.second)[jump]
    small = np.where(first_larger, faces.second, faces.first)[jump]
    side = 2 * faces.axis[jump] + first_larger[jump]
    key = large * (2 * elements.dimensions) + side
    order = np.argsort(key, kind="stable")
    key, small, large = key[order], small[order], large[order]
    area, through = faces.area_m2[jump][order], conductance[jump][order]
    begin = np.flatnonzero(np.append(True, key[1:] != key[:-1]))
    count = np.diff(np.append(begin, len(key)))
    empty = np.empty(0, dtype=np.int64)
    pairs = [(empty, empty, np.empty(0))]
    parts: list[csr_array] = [csr_array((0, len(conductance)))]
    for number in np.unique(count[count > 1]):
        rows = begin[count == number][:, None] + np.arange(number)
        whole = np.isclose(area[rows].sum(axis=1), size[large[rows[:, 0]]] ** (
            elements.dimensions - 1))  # fmt: skip
        alike = np.ptp(through[rows], axis=1) <= 1e-9 * through[rows[:, 0]]
        rows = rows[whole & alike]
        k, other = np.triu_indices(number, 1)
        total = through[rows].sum(axis=1)[:, None]
        added = np.broadcast_to(-total / number**2, (len(rows), len(k)))
        pairs.append((small[rows[:, k]].ravel(), small[rows[:, other]].ravel(), added.ravel()))
        of = np.repeat(jump[order][rows], len(k), axis=0)
        begins = number * np.arange(len(of) + 1)
        value = np.full(of.size, -1.0 / number**2)
        parts.append(csr_array((value, of.ravel(), begins), (len(of), len(conductance))))
    first, second, added = (np.concatenate(part) for part in zip(*pairs, strict=True))
    return first, second, added, vstack(parts, format="csr")
