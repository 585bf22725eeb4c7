"""Cells that a drawn surface cuts: the volume of each, the surface between two, and heat along it.

A cell is of one material, that of its centre, and its temperature is that of its centre. What a
cut cell holds of the other material belongs to the cells beyond the surface, so that each material
has the drawing's volume. Between the centres of two cells of unlike material along axis a, the
heat that flows along the surface's normal n passes by the part |n_a|: the resistance acts on |n_a|
of a full face. Over all faces this adds up to the drawing's area, for n_x^2 + n_y^2 + n_z^2 = 1.
Each material conducts over its own part of the line between the centres (Liu, Fedkiw and Kang,
Journal of Computational Physics 160 (2000) 151-178, here with a resistance). Where the drawing
follows the grid, all of this is the plain grid.

Heat that flows along a surface off the grid would have to follow the steps that the cells make, and
a wall would conduct less along it than it is thick. So a face within a material counts by its part
that lies in the material. And the part of the material that lies in cells of the other one conducts
too: it holds no heat of its own, so what flows in flows out, and the cells of the material round it
are linked directly. Then heat along a plane surface finds no steps, wherever the plane lies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, triu
from scipy.spatial import cKDTree

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm.cut_volume import CHUNK, Held, held_of, inside_any, volumes
from sandmould.casting.arpm.drawn_surface import Pieces, pieces_of
from sandmould.casting.arpm.raster import CASTING, BesideFaces, Cut, Raster
from sandmould.scenario.casting.shapes import Body

_OFF = 1e-3
"""Sizes of a cell beside a piece of surface where it is asked what lies there."""
_ALONG = 0.3
"""Distances along its axis count so much for a face that looks for its pieces of surface: those
on its own line of centres come before nearer ones beside."""
_FAR = 2.0
"""Sizes of a cell beyond which a piece of surface has no face: a wall too thin to hold centres."""
ALONG = {2: 64, 3: 6}
"""Points of a face along each side, at which it is asked what lies there."""
PASSED = 8
"""Parts of cells that heat passes at most between two cells of its own material."""
LEAST = 1e-3
"""Of a whole face: weaker links are left out."""


@dataclass(frozen=True)
class _Faces:
    """Faces between a cell of the casting and one of the mould."""

    low: Ints
    """(f,) int64: cell on the low side."""
    high: Ints
    axis: Ints
    outward: Floats
    """(f,) float64: 1 where the casting is on the low side, else -1."""


def with_cut(raster: Raster, solids: Sequence[Body]) -> Raster:
    """Give a painted raster the drawing's volumes and areas.

    ``raster``: painted with the same solids. They may touch: there is no surface between them.
    """
    casting = raster.material == CASTING
    faces = _faces(casting)
    if not len(faces.low):
        return raster
    held = held_of(raster, solids)
    area, low_part = _surface(raster, faces, _bare(raster, solids))
    plain = np.abs(held.share[faces.low] - held.share[faces.high]) == 1.0
    area[plain], low_part[plain] = 1.0, 0.5
    volume = volumes(casting, held, (faces.low, faces.high), area)
    cell = np.flatnonzero(volume != 1.0)
    if not len(cell) and plain.all():
        return raster
    passage = passage_of(raster, solids, held)
    cut = Cut(cell, volume[cell], faces.low, faces.axis, area, low_part, passage)
    return replace(raster, cut=cut)


def _faces(casting: Flags) -> _Faces:
    number = np.arange(casting.size).reshape(casting.shape)
    flat, parts = casting.reshape(-1), []
    for axis in range(casting.ndim):
        low, high = (
            np.take(number, range(k, casting.shape[axis] - 1 + k), axis=axis).ravel()
            for k in (0, 1)
        )
        apart = flat[low] != flat[high]
        outward = np.where(flat[low[apart]], 1.0, -1.0)
        parts.append((low[apart], high[apart], np.full(len(outward), axis), outward))
    return _Faces(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _bare(raster: Raster, solids: Sequence[Body]) -> Pieces:
    """The casting's surface in the mould, looking out of the casting."""
    step_m, found = _OFF * raster.cell_m, list[Pieces]()
    for number, solid in enumerate(solids):
        some = pieces_of(solid, raster.low_m, raster.cell_m)
        shared = np.zeros(len(some.area_m2), dtype=np.bool_)
        for other in solids[:number]:
            # where two overlap with flush sides, the surface is there once
            inner = some.place_m - step_m * some.normal
            shared |= inside_any([other], inner) & ~inside_any(
                [other], some.place_m + step_m * some.normal
            )
        found.append(some.only(~shared))
    pieces = Pieces(
        np.concatenate([some.place_m for some in found]),
        np.concatenate([some.normal for some in found]),
        np.concatenate([some.area_m2 for some in found]),
    )
    step = step_m * pieces.normal
    ahead, behind = (inside_any(solids, pieces.place_m + side * step) for side in (1.0, -1.0))
    normal = np.where(ahead[:, None], -pieces.normal, pieces.normal)
    outer = pieces.place_m + np.where(ahead[:, None], -step, step)
    high_m = raster.low_m + np.array(raster.material.shape) * raster.cell_m
    # no heat passes the box: what lies on it meets no mould
    in_box = ((outer > raster.low_m) & (outer < high_m)).all(axis=1)
    return Pieces(pieces.place_m, normal, pieces.area_m2).only((ahead != behind) & in_box)


def _surface(raster: Raster, faces: _Faces, pieces: Pieces) -> tuple[Floats, Floats]:
    """Area of the surface at each face over a full face, and what the low cell has of the path."""
    d, cell_m = raster.material.ndim, raster.cell_m
    centre = raster.centre_m
    low_at, high_at = centre[faces.low], centre[faces.high]
    middle = 0.5 * (low_at + high_at)
    anywhere = cKDTree(middle)
    area, inner, outer = (np.zeros(len(faces.low)) for _ in range(3))
    for axis in range(d):
        for outward in (1.0, -1.0):
            own = np.flatnonzero((faces.axis == axis) & (faces.outward == outward))
            some = pieces.only(pieces.normal[:, axis] * outward > 1e-9)
            weight = some.area_m2 * some.normal[:, axis] ** 2
            face, close = _nearest(middle[own], some.place_m, axis, cell_m)
            face = own[face] if len(own) else face
            inside_at = low_at if outward > 0.0 else high_at
            outside_at = high_at if outward > 0.0 else low_at
            at, n, w, f = some.place_m[close], some.normal[close], weight[close], face[close]
            np.add.at(area, f, w)
            np.add.at(inner, f, w * np.maximum(np.sum((at - inside_at[f]) * n, axis=1), 0.0))
            np.add.at(outer, f, w * np.maximum(np.sum((outside_at[f] - at) * n, axis=1), 0.0))
            # along this axis no face is near: the area counts at one of another
            away, other = (np.asarray(it) for it in anywhere.query(some.place_m[~close]))
            there = away <= _FAR * cell_m
            np.add.at(area, other[there], weight[~close][there])
    known = inner + outer > 0.0
    part = np.full(len(area), 0.5)
    part[known] = inner[known] / (inner + outer)[known]
    return area / cell_m ** (d - 1), np.where(faces.outward > 0.0, part, 1.0 - part)


def _nearest(middle_m: Floats, place_m: Floats, axis: int, cell_m: float) -> tuple[Ints, Flags]:
    """Face of each piece, and whether it lies beside the piece along the axis."""
    if not len(middle_m):
        return np.zeros(len(place_m), dtype=np.int64), np.zeros(len(place_m), dtype=np.bool_)
    scale = np.ones(middle_m.shape[1])
    scale[axis] = _ALONG
    face = np.asarray(cKDTree(middle_m * scale).query(place_m * scale)[1], dtype=np.int64)
    off = np.abs(place_m - middle_m[face]) / cell_m
    along = off[:, axis].copy()
    off[:, axis] = 0.0
    return face, (off.max(axis=1) <= 0.5 + 1e-6) & (along <= _FAR)


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
