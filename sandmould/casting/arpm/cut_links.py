"""How heat passes along a drawn surface: through parts of faces, and through parts of cells.

A cell is of one material. Heat that flows along a surface off the grid would have to follow the
steps that the cells make, and a wall would conduct less along it than it is thick. So a face within
a material counts by its part that lies in the material. And the part of the material that lies in
cells of the other one conducts too: it holds no heat of its own, so what flows in flows out, and
the cells of the material round it are linked directly. Then heat along a plane surface finds no
steps, wherever the plane lies.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, triu

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm.cut_volume import CHUNK, Held, inside_any
from sandmould.casting.arpm.raster import CASTING, BesideFaces, Raster
from sandmould.scenario.casting.shapes import Body

ALONG = {2: 64, 3: 6}
"""Points of a face along each side, at which it is asked what lies there."""
PASSED = 8
"""Parts of cells that heat passes at most between two cells of its own material."""
LEAST = 1e-3
"""Of a whole face: weaker links are left out."""


def passage_of(raster: Raster, solids: Sequence[Body], held: Held) -> BesideFaces:
    """Faces that a surface cuts within a material, and links past it.

    ``raster``: painted with the solids. ``held``: what its cells hold.
    """
    casting = raster.material.reshape(-1) == CASTING
    low, high, axis = _cut_faces(raster, held)
    share = _share_in(raster, solids, low, axis)
    found = [_through(casting, low, high, share), _through(~casting, low, high, 1.0 - share)]
    within = casting[low] == casting[high]
    own = np.where(casting[low], share, 1.0 - share)
    link = np.concatenate([pair for pair, _ in found], axis=1)
    return BesideFaces(
        low[within], axis[within], own[within], link, np.concatenate([of for _, of in found])
    )


def _cut_faces(raster: Raster, held: Held) -> tuple[Ints, Ints, Ints]:
    """Faces of cells that the surface cuts: low cell, high cell, axis."""
    shape = raster.material.shape
    number, is_cut = np.arange(raster.material.size).reshape(shape), held.share % 1.0 > 0.0
    parts = []
    for axis in range(len(shape)):
        low, high = (np.take(number, range(k, shape[axis] - 1 + k), axis=axis).ravel()
                     for k in (0, 1))  # fmt: skip
        near = is_cut[low] | is_cut[high]
        parts.append((low[near], high[near], np.full(int(near.sum()), axis)))
    low, high, across = (np.concatenate(part) for part in zip(*parts, strict=True))
    return low, high, across


def _share_in(raster: Raster, solids: Sequence[Body], low: Ints, axis: Ints) -> Floats:
    """Share of faces that lies in the casting, (f,) float64."""
    d, centre = raster.material.ndim, raster.centre_m
    even = (np.arange(ALONG[d]) + 0.5) / ALONG[d] - 0.5
    across = np.stack(np.meshgrid(*[even] * (d - 1)), axis=-1).reshape(-1, d - 1)
    share = np.empty(len(low))
    for own in range(d):
        off = np.insert(across, own, 0.5, axis=1) * raster.cell_m
        which = np.flatnonzero(axis == own)
        for part in np.array_split(which, max(1, -(-len(which) * len(off) // CHUNK))):
            place = centre[low[part]][:, None] + off
            inside = inside_any(solids, place.reshape(-1, d))
            share[part] = inside.reshape(len(part), len(off)).mean(axis=1)
    return share


def _through(own: Flags, low: Ints, high: Ints, share: Floats) -> tuple[Ints, Floats]:
    """Links between cells of a material, by the heat balance of its parts in cells of another."""
    used = (share > 0.0) & ~(own[low] & own[high])
    row = np.concatenate([low[used], high[used]])
    column = np.concatenate([high[used], low[used]])
    share, part = np.tile(share[used], 2), ~own[row]
    row, column, share = row[part], column[part], share[part]
    n = len(own)
    whole = np.bincount(row, share, n)
    stays = ~own[column]

    def matrix(which: Flags) -> csr_array:
        return coo_array((share[which], (row[which], column[which])), (n, n)).tocsr()

    inverse = diags_array(np.divide(1.0, whole, out=np.zeros(n), where=whole > 0.0))
    into, on = matrix(~stays), inverse @ matrix(stays)
    term = inverse @ into
    total = term
    for _ in range(PASSED):
        term = on @ term
        term.data[term.data < LEAST] = 0.0
        term.eliminate_zeros()
        total = total + term
    links = triu(into.T @ total, 1).tocoo()
    strong = links.data > LEAST
    return np.stack([links.row, links.col])[:, strong].astype(np.int64), links.data[strong]
