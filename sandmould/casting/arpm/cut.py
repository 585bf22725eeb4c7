"""Cells that a drawn surface cuts: the volume of each, and the surface between two of them.

A cell is of one material, that of its centre, and its temperature is that of its centre. What a
cut cell holds of the other material belongs to the cells beyond the surface, so that each material
has the drawing's volume. Between the centres of two cells of unlike material along axis a, the
heat that flows along the surface's normal n passes by the part |n_a|: the resistance acts on |n_a|
of a full face. Over all faces this adds up to the drawing's area, for n_x^2 + n_y^2 + n_z^2 = 1.
Each material conducts over its own part of the line between the centres (Liu, Fedkiw and Kang,
Journal of Computational Physics 160 (2000) 151-178, here with a resistance). Where the drawing
follows the grid, all of this is the plain grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm.cut_links import passage_of
from sandmould.casting.arpm.cut_volume import held_of, inside_any, volumes
from sandmould.casting.arpm.drawn_surface import Pieces, pieces_of
from sandmould.casting.arpm.raster import CASTING, Cut, Raster
from sandmould.scenario.casting.shapes import Body

_OFF = 1e-3
"""Sizes of a cell beside a piece of surface where it is asked what lies there."""
_ALONG = 0.3
"""Distances along its axis count so much for a face that looks for its pieces of surface: those
on its own line of centres come before nearer ones beside."""
_FAR = 2.0
"""Sizes of a cell beyond which a piece of surface has no face: a wall too thin to hold centres."""


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
