"""The shells that the triangles of a mesh make, and which way each of them faces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import signed_volumes_m3
from sandmould.geometry.mesh_search import MeshSearch

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
SAME = 1e-6
"""Points nearer than this share of the mesh's extent are one; STL holds seven digits. Shells apart
by less touch, and what is thinner is no solid."""
BESIDE = 8.0 * SAME
"""Share of the extent by which points beside a surface lie off it: clear of all that touches it."""
LEAST_VOLUME = 1e-9
"""A surface around less than this share of its extent cubed encloses nothing."""
_LARGEST_ANGLE = 0.1
"""Of triangles round an edge (rad) that may still lie in one plane, however small they are."""

MOST_SHELLS = 1000
"""Shells of one file: what each triangle lies in is asked of all of them."""
_HELD = 5_000_000
"""Winding numbers held in memory together."""


def extent(points: Array) -> float:
    """Longest side of the box round points."""
    return float(np.ptp(points, axis=0).max())


def at(place: Array) -> str:
    """Where one of several faults lies, for messages."""
    return "one at ({}) in the file's unit".format(", ".join(f"{x:.4g}" for x in place))


class Sides(NamedTuple):
    """Sides of triangles, ``3 t + k`` from corner ``k`` of triangle ``t`` to the next."""

    ends: Ints
    """(3 nt, 2) int64."""
    up: NDArray[np.bool_]
    """(3 nt,) bool: whether each goes from the lower vertex to the higher."""
    edges: Ints
    """(ne, 2) int64: every edge once, in order."""
    edge: Ints
    """(nt, 3) int64: the edge of each side."""
    shared: Ints
    """(ne,) int64: triangles at each edge."""


def sides_of(triangles: Ints) -> Sides:
    """Sides of triangles and the edges that they share."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    low, high = ends.min(axis=1), ends.max(axis=1)
    # one number an edge: far quicker to sort than two
    n = int(triangles.max(initial=0)) + 1
    code, edge, count = np.unique(low * n + high, return_inverse=True, return_counts=True)
    edges = np.stack([code // n, code % n], axis=1)
    return Sides(ends, ends[:, 0] < ends[:, 1], edges, edge.reshape(-1, 3), count)


def meeting_sides(sides: Sides) -> Ints:
    """Pairs of sides at edges of two triangles, (m, 2) int64, in order of the edges."""
    at_edge = np.argsort(sides.edge.ravel(), kind="stable")
    first = (np.cumsum(sides.shared) - sides.shared)[sides.shared == 2]
    return np.stack([at_edge[first], at_edge[first + 1]], axis=1)


def flat_triangles(vertices: Array, triangles: Ints) -> NDArray[np.bool_]:
    """Which triangles have no area: they are narrower than round-off of the file."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    area2 = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    return np.asarray(area2 <= SAME * extent(vertices) * longest)


def joined_sides(vertices: Array, triangles: Ints, most: int | None = None) -> Ints:
    """Pairs of sides of triangles that make one edge, in opposite ways.

    Where shells touch along an edge, four triangles or more end at it. Those are joined that
    bound a solid between them, which takes touching shells for two.

    Parameters
    ----------
    vertices : (nv, 3) float64
    triangles : (nt, 3) int64
    most : int, optional
        Triangles that may end at an edge; any even number unless given.

    Returns
    -------
    (1.5 nt, 2) int64
        Side ``3 t + k`` of triangle ``t`` goes from its corner ``k`` to the next.

    Raises
    ------
    MeshFileError
        When the surface is open or its triangles do not face one way.
    """
    sides = sides_of(triangles)
    edges, count = sides.edges, sides.shared
    way = np.bincount(sides.edge.ravel(), weights=np.where(sides.up, 1.0, -1.0))
    faults = (
        (count == 1, "a closed surface", "belong to one triangle only", "belongs"),
        (count > (most or len(sides.ends)), "edges of two triangles", "belong to more", "belongs"),
        ((way != 0.0) & (count > 2) & (count % 2 == 1), "a closed surface",
         "belong to an odd number of triangles", "belongs"),
        (way != 0.0, "triangles that all face one way", "lie between two that do not", "lies"),
    )  # fmt: skip
    for bad, valid, plural, singular in faults:
        if bad.any():
            words = plural if bad.sum() > 1 else " ".join([singular, *plural.split()[1:]])
            number = f"{bad.sum()} edge{'s' if bad.sum() > 1 else ''}"
            raise MeshFileError(
                f"{valid}; {number} {words}, {at(vertices[edges[bad][0]].mean(axis=0))}"
            )
    pairs = [meeting_sides(sides)]
    if (count > 2).any():
        order = np.argsort(sides.edge.ravel(), kind="stable")
        first = np.concatenate([[0], np.cumsum(count)])
        for edge in np.flatnonzero(count > 2):
            own = order[first[edge] : first[edge + 1]]
            pairs.append(_round_an_edge(vertices, triangles, edges[edge], own, sides.up))
    return np.concatenate(pairs)


def _round_an_edge(
    vertices: Array, triangles: Ints, edge: Ints, sides: Ints, up: NDArray[np.bool_]
) -> Ints:
    """Join the sides at one edge so that each pair bounds a wedge of solid."""
    along = vertices[edge[1]] - vertices[edge[0]]
    along /= np.linalg.norm(along)
    away = vertices[triangles[sides // 3, (sides + 2) % 3]] - vertices[edge[0]]
    away -= np.outer(away @ along, along)
    angle = np.arctan2(np.cross(away[0], away) @ along, away @ away[0])
    reach = float(np.linalg.norm(away, axis=1).min())
    one_plane = min(4.0 * SAME * extent(vertices) / reach, _LARGEST_ANGLE)
    order = np.argsort(angle)
    # the first may lie at either end of the circle
    group = np.concatenate([[0], np.cumsum(np.diff(angle[order]) > one_plane)])
    if angle[order[-1]] - angle[order[0]] > 2.0 * np.pi - one_plane:
        group[group == group[-1]] = 0
    # round the edge a side upwards ends a solid and one downwards begins it; of those in one
    # plane the ends come first, so that solids which touch are apart
    turn = order[np.lexsort((~up[sides[order]], group))]
    open_sides: list[int] = []
    pairs: list[tuple[int, int]] = []
    for side in (*sides[turn].tolist(), *sides[turn].tolist()):
        if len(pairs) == len(sides) // 2:
            break
        if any(side in pair for pair in pairs):
            continue
        if not up[side]:
            if side not in open_sides:
                open_sides.append(side)
        elif open_sides:
            pairs.append((open_sides.pop(), side))
    return np.array(pairs, dtype=np.int64)


def shells_of(joined: Ints, count: int) -> Ints:
    """Number of the connected shell of each of some triangles, (count,) int64.

    Raises
    ------
    MeshFileError
        When there are too many.
    """
    beside = joined // 3
    links = coo_array((np.ones(len(beside)), (beside[:, 0], beside[:, 1])), shape=(count, count))
    number, shell = connected_components(links, directed=False)
    if number > MOST_SHELLS:
        raise MeshFileError(f"at most {MOST_SHELLS} shells in one file; here are {number}")
    return np.asarray(shell, dtype=np.int64)


def with_own_vertices(vertices: Array, triangles: Ints, joined: Ints) -> tuple[Array, Ints]:
    """Give surfaces that meet in a vertex one each, or its normal would mix theirs."""
    n = 3 * len(triangles)
    here, other = joined.T
    turned = np.stack([here // 3 * 3 + (here + 1) % 3, other // 3 * 3 + (other + 1) % 3])
    links = np.concatenate([np.stack([here, turned[1]]), np.stack([turned[0], other])], axis=1)
    graph = coo_array((np.ones(links.shape[1]), tuple(links)), shape=(n, n))
    _, fan = connected_components(graph, directed=False)
    own, corner = np.unique(triangles.ravel() * n + fan, return_inverse=True)
    return vertices[own // n], corner.reshape(-1, 3).astype(np.int64)


def facing(vertices: Array, triangles: Ints, shell: Ints) -> tuple[Ints, Sequence[int]]:
    """Turn shells that were drawn inside out.

    A shell that faces outwards is solid, and one that faces inwards takes away from the solid
    round it: a cavity. Where all outermost shells face inwards, the whole file is turned round;
    a shell that faces inwards with no solid round it is turned alone.

    Parameters
    ----------
    vertices : (nv, 3) float64
    triangles : (nt, 3) int64
    shell : (nt,) int64

    Returns
    -------
    triangles : (nt, 3) int64
    filled : sequence of int
        Shells that face outwards inside another: they change nothing.

    Raises
    ------
    MeshFileError
        When a shell encloses nothing, or one that faces inwards sticks out of the solid round it.
    """
    count = int(shell.max()) + 1
    volume = np.bincount(shell, weights=signed_volumes_m3(vertices, triangles), minlength=count)
    for number in range(count):
        own = vertices[triangles[shell == number].ravel()]
        if abs(volume[number]) <= LEAST_VOLUME * extent(own) ** 3:
            raise MeshFileError("a surface that encloses a volume")
    way = np.sign(volume).astype(np.int64)
    if count == 1:
        return triangles[:, ::-1] if way[0] < 0 else triangles, []
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal *= (way[shell] / np.linalg.norm(normal, axis=1))[:, None]
    # just inside each triangle's own shell
    place = corners.mean(axis=1) - BESIDE * extent(vertices) * normal
    search = MeshSearch(vertices, triangles)
    lies_in = np.ones(count, dtype=np.bool_)
    np.logical_and.at(lies_in, shell, _of_others(search, place, shell, None) != 0)
    turn = np.ones(count, dtype=np.int64)
    if (way[~lies_in] < 0).all():
        turn[:] = -1
    around = _of_others(search, place, shell, turn)
    for number in np.flatnonzero(way * turn < 0).tolist():
        solid = around[shell == number] > 0
        if not solid.any():
            turn[number] *= -1
        elif not solid.all():
            raise MeshFileError(
                "shells that face inwards only where they are cavities. One faces inwards and "
                f"sticks out of the shells round it, {at(place[shell == number][~solid][0])}"
            )
    facing_out = np.flatnonzero(way * turn > 0)
    filled = [int(n) for n in facing_out if (around[shell == n] > 0).all()]
    return np.where((turn[shell] < 0)[:, None], triangles[:, ::-1], triangles), filled


def _of_others(search: MeshSearch, place: Array, shell: Ints, turn: Ints | None) -> Ints:
    """Winding number of all shells but its own at a place on each triangle, (nt,) int64.

    Each shell's counts as often as ``turn`` says, and without it by its size.
    """
    found = np.empty(len(place), dtype=np.int64)
    blocks = -(-len(place) * (int(shell.max()) + 1) // _HELD)
    for part in np.array_split(np.arange(len(place)), blocks):
        counts = search.windings(place[part], shell)
        counts[np.arange(len(part)), shell[part]] = 0
        found[part] = np.abs(counts).sum(axis=1) if turn is None else counts @ turn
    return found
