"""Faults of a drawing that have one cure, mended before its shells are told apart.

Ends of open edges move by less than ``MOVES``, and holes are closed where they are small and their
rims say what belongs there. Whatever else is wrong stays, for the checks to refuse.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh_shells import SAME, at, extent, flat_triangles, meeting_sides, sides_of
from sandmould.geometry.outline import Outline, outline_fault
from sandmould.geometry.plane_triangulation import triangulated

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
MOVES = 1e-4
"""Share of the extent by which ends of open edges may move to close them: 0.01 mm of 100 mm."""
LARGEST_HOLES = 0.1
"""Share of the surface that holes may be, together: beyond it an open box may be meant. A hole in
a flat face does not count."""
_FLAT_RAD = 1e-3
"""A face goes on flat in the patch of a hole where it meets it at less than this."""
_SMOOTH_RAD = np.radians(40.0)
"""A face goes on behind the rim of a hole where it meets the patch at less than this."""
_MOST_ROUNDS = 40
"""Of splits of an edge at the points on it, and of triangles dropped beside dropped ones."""


@dataclass(frozen=True)
class Mended:
    """A surface after its repair, and what was done to it."""

    triangles: Ints
    """(nt, 3) int64."""
    as_drawn: Ints
    """(nt, 3) int64: the same before any of them was turned."""
    dropped: int
    """Triangles without area, drawn twice or that bound nothing."""
    joined: int
    """Vertices of open edges that were moved to others, and points that edges were split at."""
    moves: float
    """How far they may have moved, in the file's unit, as what follows."""
    holes: int
    patch_area: float
    unknown_volume: float
    """What the closed holes leave open: how far their surface may lie off, times its area."""


def mended(vertices: Array, triangles: Ints) -> Mended:
    """Mend what has one cure.

    Parameters
    ----------
    vertices : (nv, 3) float64
    triangles : (nt, 3) int64

    Raises
    ------
    MeshFileError
        When the holes are too large to be closed, or nothing is left.
    """
    kept = _without_needless(vertices, triangles, lone=False)
    dropped = len(triangles) - len(kept)
    joined, near = 0, MOVES * extent(vertices)
    if _is_open(kept):
        moved = _together(vertices, kept, near)
        joined = int((moved != np.arange(len(vertices))).sum())
        closer = _without_needless(vertices, moved[kept], lone=True)
        dropped += len(kept) - len(closer)
        kept = _split_at_points(vertices, closer, near)
        joined += len(kept) - len(closer)
    if not len(kept):
        raise MeshFileError("triangles with an area; here are none")
    turn = _turned(kept)
    faced = np.where(turn[:, None], kept[:, ::-1], kept)
    loops = _rims(faced)
    patches, area, unknown = _patches(vertices, faced, loops)
    return Mended(
        triangles=np.concatenate([faced, patches]),
        as_drawn=np.concatenate([kept, patches]),
        dropped=dropped,
        joined=joined,
        moves=near,
        holes=len(loops),
        patch_area=area,
        unknown_volume=unknown,
    )


def _is_open(triangles: Ints) -> bool:
    return bool((sides_of(triangles).shared == 1).any())


def _without_needless(vertices: Array, triangles: Ints, lone: bool) -> Ints:
    """Leave away triangles without area, those drawn twice, and those that bound nothing.

    Triangles that touch no other do not either, where ``lone`` says so.
    """
    left = triangles[~flat_triangles(vertices, triangles)]
    # from the lowest vertex on: shells that touch may have one triangle in both ways
    start = left.argmin(axis=1)[:, None]
    way = np.take_along_axis(left, (start + np.arange(3)) % 3, axis=1)
    once = left[np.sort(np.unique(way, axis=0, return_index=True)[1])]
    if _odd(once) <= _odd(left):
        left = once
    for _ in range(_MOST_ROUNDS):
        sides = sides_of(left)
        count = sides.shared[sides.edge]
        _, both, drawn = np.unique(
            np.sort(left, axis=1), axis=0, return_inverse=True, return_counts=True
        )
        fin = (drawn[both.ravel()] == 2) & (count == 2).any(axis=1)
        uses = np.bincount(left.ravel(), minlength=len(vertices))
        flap = (count % 2 == 1).all(axis=1)
        flap &= (count > 1).any(axis=1) | (lone & (uses[left] == 1).all(axis=1))
        if not (fin | flap).any():
            break
        left = left[~(fin | flap)]
    return left


def _odd(triangles: Ints) -> int:
    return int((sides_of(triangles).shared % 2 == 1).sum())


def _together(vertices: Array, triangles: Ints, near: float) -> Ints:
    """Which vertex each one moves to: one of those of open edges that lie together."""
    sides = sides_of(triangles)
    rim = np.unique(sides.edges[sides.shared == 1])
    pairs = rim[cKDTree(vertices[rim]).query_pairs(near, output_type="ndarray")]
    n = len(vertices)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(links, directed=False)
    return np.asarray(np.unique(group, return_index=True)[1][group], dtype=np.int64)


def _split_at_points(vertices: Array, triangles: Ints, near: float) -> Ints:
    """Split triangles where the end of another open edge lies on one of theirs."""
    for _ in range(_MOST_ROUNDS):
        sides = sides_of(triangles)
        rim = np.unique(sides.edges[sides.shared == 1])
        if not len(rim):
            break
        is_open = np.flatnonzero(sides.shared[sides.edge.ravel()] == 1)
        p, q = vertices[sides.ends[is_open]].transpose(1, 0, 2)
        half = 0.5 * np.linalg.norm(q - p, axis=1)
        found = cKDTree(vertices[rim]).query_ball_point(0.5 * (p + q), half)
        at_point: dict[int, tuple[int, int]] = {}
        for number, beside in enumerate(found):
            triangle, k = divmod(int(is_open[number]), 3)
            along = (q[number] - p[number]) / (2.0 * half[number])
            away = vertices[rim[beside]] - 0.5 * (p + q)[number]
            middle = np.abs(away @ along)
            on = np.linalg.norm(away - np.outer(away @ along, along), axis=1) <= near
            on &= (middle < half[number] - near) & ~np.isin(rim[beside], triangles[triangle])
            if on.any() and triangle not in at_point:
                nearest = np.where(on, middle, np.inf).argmin()
                at_point[triangle] = k, int(rim[beside[nearest]])
        if not at_point:
            break
        parts = [
            (t[k], n, t[k - 1], n, t[(k + 1) % 3], t[k - 1])
            for t, (k, n) in ((triangles[number], at) for number, at in at_point.items())
        ]
        new = np.array(parts, dtype=np.int64).reshape(-1, 3)
        triangles = np.concatenate([np.delete(triangles, list(at_point), axis=0), new])
    return triangles


def _turned(triangles: Ints) -> Flags:
    """Which triangles face another way than most of those that hang together with them.

    Each is there twice, as drawn and turned, and joined to those of its neighbours that face as
    it does: of the two sets that a shell falls into, that of more triangles as drawn stays.
    """
    n = len(triangles)
    sides = sides_of(triangles)
    a, b = meeting_sides(sides).T
    unlike = sides.up[a] == sides.up[b]
    if not unlike.any():
        return np.zeros(n, dtype=np.bool_)
    a, b = a // 3, b // 3
    here, there = np.concatenate([a, a + n]), np.concatenate([b + n * unlike, b + n * ~unlike])
    links = coo_array((np.ones(len(here)), (here, there)), shape=(2 * n, 2 * n))
    label = connected_components(links, directed=False)[1]
    drawn, turned = label[:n], label[n:]
    size = np.bincount(drawn, minlength=label.max() + 1)
    fewer = size[drawn] < size[turned]
    return np.asarray(fewer | ((size[drawn] == size[turned]) & (drawn > turned)))


def _rims(triangles: Ints) -> list[list[int]]:
    """Open sides round each hole, in the order in which a patch runs along them."""
    sides = sides_of(triangles)
    ends_at = defaultdict(list)
    for side in np.flatnonzero(sides.shared[sides.edge.ravel()] == 1).tolist():
        ends_at[int(sides.ends[side, 1])].append(side)
    rims = []
    while ends_at:
        start = at_vertex = next(iter(ends_at))
        rim: list[int] = []
        while at_vertex in ends_at and not (rim and at_vertex == start):
            rim.append(ends_at[at_vertex].pop())
            if not ends_at[at_vertex]:
                del ends_at[at_vertex]
            at_vertex = int(sides.ends[rim[-1], 0])
        rims.append(rim)
    return rims


def _patches(vertices: Array, triangles: Ints, rims: list[list[int]]) -> tuple[Ints, float, float]:
    """Flat patches of holes, their area and the volume that they leave unknown."""
    sides = sides_of(triangles)
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(np.float64).tiny)
    new: list[tuple[int, ...]] = []
    area = unknown = unframed = 0.0
    for rim in rims:
        number = sides.ends[rim, 1]
        place = vertices[number] - vertices[number].mean(axis=0)
        over = 0.5 * np.cross(place, np.roll(place, -1, axis=0)).sum(axis=0)
        own = float(np.linalg.norm(over))
        if own <= (SAME * extent(vertices)) ** 2:
            continue
        beside = normal[np.array(rim) // 3] / length[np.array(rim) // 3, None]
        tilt = np.arccos(np.clip(beside @ over / own, -1.0, 1.0))
        slope = np.tan(tilt[tilt < _SMOOTH_RAD]).max(initial=0.0)
        depth = np.abs(place @ over).max() / own + 0.25 * slope * np.sqrt(own / np.pi)
        unframed += own if tilt.min() > _FLAT_RAD else 0.0
        area, unknown = area + own, unknown + own * float(depth)
        new.extend(tuple(number[list(t)]) for t in _filled(place, over / own))
    share = unframed / (0.5 * float(length.sum()) + area)
    if share > LARGEST_HOLES:
        holes = "1 hole in this one is" if len(rims) == 1 else f"{len(rims)} holes in this one are"
        place = at(vertices[sides.ends[rims[0][0], 0]])
        raise MeshFileError(
            f"a closed surface; {holes} {share:.0%} of it, {place}. "
            f"Up to {LARGEST_HOLES:.0%} are closed here: close the rest in the program that drew it"
        )
    return np.array(new, dtype=np.int64).reshape(-1, 3), area, unknown


def _filled(place: Array, normal: Array) -> list[tuple[int, int, int]]:
    """Triangles in a flat outline, counter-clockwise seen against its normal."""
    level = place - np.outer(place @ normal, normal)
    first = level[np.linalg.norm(level, axis=1).argmax()]
    flat = level @ np.stack([first, np.cross(normal, first)]).T / np.linalg.norm(first)
    n = len(flat)
    if outline_fault(flat):
        return []
    every = triangulated(flat, [(k, (k + 1) % n) for k in range(n)])
    middle = flat[np.array(every)].mean(axis=1)
    inside = Outline("rim", flat).distance_m(middle) < 0.0
    return [t for t, is_in in zip(every, inside, strict=True) if is_in]
