"""Closed surfaces from drawings, mended and checked before they stand in a scene."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sandmould.geometry.drawing_file import (
    MeshFileError,
    check_numbers,
    file_hash,
    is_step,
    tells_unit,
)
from sandmould.geometry.mesh import TriangleMesh, signed_volumes_m3
from sandmould.geometry.mesh_coarser import MANY, WITHIN, coarser
from sandmould.geometry.mesh_crossing import check_crossings
from sandmould.geometry.mesh_repair import Mended, mended
from sandmould.geometry.mesh_shells import (
    SAME,
    at,
    extent,
    facing,
    flat_triangles,
    joined_sides,
    shells_of,
    with_own_vertices,
)
from sandmould.geometry.mesh_union import united
from sandmould.geometry.mesher import step_surface
from sandmould.geometry.stl_file import read_stl
from sandmould.limits import TRIANGLES

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]


OTHERS = (".obj", ".ply", ".3mf")
"""Endings of files that trimesh reads; those that are not here nor of STEP are STL."""
MOST_UNKNOWN = 0.01
"""Share of the volume that closed holes may leave unknown."""


class Reading(NamedTuple):
    """A surface as it is computed with, and what was changed in its drawing."""

    vertices: Array
    """(nv, 3) float64: in the file's unit; metres where the file tells its unit."""
    triangles: Triangles
    """(nt, 3) int64: the surface of the union alone, nothing inside it is left."""
    mended: Mended
    filled_shells: int
    """Shells that change nothing: they lie in another and face outwards."""
    turned_triangles: int
    """Triangles that were drawn inside out."""
    as_drawn: TriangleMesh
    """The file's triangles as they are."""
    whole: TriangleMesh
    """The surface before triangles were merged."""
    within: float
    """How far those that were merged may lie off it."""


def read_surface(path: Path) -> tuple[Array, Triangles]:
    """Vertices and triangles of a drawing: the first two of :func:`read_drawing`."""
    return read_drawing(path)[:2]


def read_drawing(path: Path) -> Reading:
    """Read an STL, OBJ, PLY, 3MF or STEP file as a closed surface seen from outside.

    Vertices are merged within a millionth of the extent. Inside is where the winding number of all
    shells is above 1/2: shells that touch or overlap are one solid, and one that faces inwards
    takes away from the solid round it. A shell that faces inwards with no solid round it was drawn
    inside out and is turned. Faults with one cure are mended, and very many triangles merged.

    Raises
    ------
    MeshFileError
        When the file is missing or of another kind, or its triangles bound no solid.
    """
    return _read(path, file_hash(path))


@lru_cache(maxsize=8)
def _read(path: Path, sha256: str) -> Reading:
    """Read a file once for each state of it: a sweep asks for the same one at every point."""
    points, cells = _parsed(path)
    if len(cells) > TRIANGLES.most:
        raise MeshFileError(f"a file {TRIANGLES.sentence(len(cells))}")
    vertices, triangles = _merged(points, cells)
    whole = mended(vertices, triangles)
    joined = joined_sides(vertices, whole.triangles)
    shell = shells_of(joined, len(whole.triangles))
    check_crossings(vertices, whole.triangles, shell)
    faced, filled = facing(vertices, whole.triangles, shell)
    if shell.any():
        solid = TriangleMesh("drawn", *united(vertices, faced, shell))
    else:
        own = with_own_vertices(vertices, faced, joined_sides(vertices, faced))
        solid = TriangleMesh("drawn", *own)
    if whole.unknown_volume > MOST_UNKNOWN * solid.measure:
        raise MeshFileError(
            f"a closed surface; the holes of this one leave "
            f"{whole.unknown_volume / solid.measure:.1%} of its volume unknown, and up to "
            f"{MOST_UNKNOWN:.0%} is closed here: close them in the program that drew it"
        )
    coarse = coarser(solid) if len(solid.triangles) > MANY else solid
    turned = int((faced != whole.as_drawn).any(axis=1).sum())
    parts = coarse.vertices_m, coarse.triangles
    as_drawn = TriangleMesh("drawn", vertices, triangles)
    return Reading(*parts, whole, len(filled), turned, as_drawn, solid, WITHIN * extent(vertices))


def check_surface(vertices: Array, triangles: Triangles) -> None:
    """Refuse triangles that bound no solid or do not face outwards.

    Parameters
    ----------
    vertices : (nv, 3) float64
    triangles : (nt, 3) int64

    Raises
    ------
    MeshFileError
    """
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise MeshFileError(f"triangles between its {len(vertices)} vertices, counted from 0")
    flat = flat_triangles(vertices, triangles)
    _refuse(flat, "triangles with an area", "degenerate", vertices, triangles)
    _, index, count = np.unique(
        np.sort(triangles, axis=1), axis=0, return_index=True, return_counts=True
    )
    doubles = np.isin(np.arange(len(triangles)), index[count > 1])
    _refuse(doubles, "triangles that differ", "given more than once", vertices, triangles)
    joined_sides(vertices, triangles, most=2)
    if not signed_volumes_m3(vertices, triangles).sum() > 0.0:
        raise MeshFileError("triangles that run counter-clockwise seen from outside")


def _parsed(path: Path) -> tuple[Array, Triangles]:
    """Each place once, in the order in which the file tells them, and the triangles."""
    if is_step(path):
        return step_surface(path)
    if path.suffix.lower() in OTHERS:
        return _by_trimesh(path)
    try:
        points = read_stl(path).reshape(-1, 3)
    except OSError as error:
        raise MeshFileError(f"a readable file ({error.strerror})") from error
    _, first, number = np.unique(points, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return points[first[order]], np.argsort(order)[number.ravel()].reshape(-1, 3)


def _by_trimesh(path: Path) -> tuple[Array, Triangles]:
    import trimesh  # takes a while, and few drawings need it

    try:
        scene = trimesh.load_scene(path, process=False)
        unit = scene.units if tells_unit(path) else None
        unit_m = trimesh.units.unit_conversion(unit, "meters") if unit else 1.0
        mesh = scene.to_mesh()
        points = unit_m * np.asarray(mesh.vertices, dtype=np.float64).reshape(-1, 3)
        cells = np.asarray(mesh.faces, dtype=np.int64).reshape(-1, 3)
    except Exception as error:  # of each format its own
        kind = path.suffix[1:].upper()
        reason = " ".join(str(error).split()) or type(error).__name__
        raise MeshFileError(f"a {kind} file that trimesh reads; it says: {reason}") from error
    if not len(cells):
        raise MeshFileError("a file with triangles; here are none")
    if not 0 <= cells.min() <= cells.max() < len(points):
        raise MeshFileError(f"triangles between its {len(points)} vertices")
    check_numbers(points, "vertex")
    return points, cells


def _merged(points: Array, triangles: Triangles) -> tuple[Array, Triangles]:
    """Join vertices that only round-off of the file keeps apart."""
    near_m = SAME * extent(points)
    pairs = cKDTree(points).query_pairs(near_m, output_type="ndarray")
    n = len(points)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(links, directed=False)
    _, first = np.unique(group, return_index=True)
    return points[first], group[triangles].astype(np.int64)


def _refuse(
    bad: NDArray[np.bool_], valid: str, what: str, vertices: Array, triangles: Triangles
) -> None:
    if bad.any():
        number = f"{bad.sum()} triangles are" if bad.sum() > 1 else "1 triangle is"
        place = at(vertices[triangles[bad][0]].mean(axis=0))
        raise MeshFileError(f"{valid}; {number} {what}, {place}")
