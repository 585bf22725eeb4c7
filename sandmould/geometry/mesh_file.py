"""Closed surfaces from STL and STEP files, checked before they stand in a scene."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sandmould.geometry.drawing_file import MeshFileError, file_hash
from sandmould.geometry.mesh import signed_volumes_m3
from sandmould.geometry.mesh_crossing import check_crossings
from sandmould.geometry.mesh_shells import (
    SAME,
    at,
    extent,
    facing,
    joined_sides,
    shells_of,
    with_own_vertices,
)
from sandmould.geometry.mesh_union import united
from sandmould.geometry.mesher import is_step, step_surface
from sandmould.limits import TRIANGLES

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]


class Repairs(NamedTuple):
    """What was changed in a drawing, or may have been meant otherwise."""

    filled_shells: int
    """Shells that change nothing: they lie in another and face outwards."""
    turned_triangles: int
    """Triangles that were drawn inside out."""


def read_surface(path: Path) -> tuple[Array, Triangles]:
    """Read an STL file, ASCII or binary, or a STEP file as a closed surface seen from outside.

    Vertices are merged within a millionth of the extent. Inside is where the winding number of all
    shells is above 1/2: shells that touch or overlap are one solid, and one that faces inwards
    takes away from the solid round it. A shell that faces inwards with no solid round it was drawn
    inside out and is turned.

    Returns
    -------
    vertices : (nv, 3) float64
        In the file's unit; metres of a STEP file.
    triangles : (nt, 3) int64
        The surface of the union alone: nothing inside it is left.

    Raises
    ------
    MeshFileError
        When the file is missing or of another kind, or its triangles bound no solid.
    """
    return _read(path, file_hash(path))[:2]


def repairs(path: Path) -> Repairs:
    """What :func:`read_surface` changed in a file, and what it left as it is.

    Raises
    ------
    MeshFileError
        As :func:`read_surface`.
    """
    return _read(path, file_hash(path))[2]


@lru_cache(maxsize=8)
def _read(path: Path, sha256: str) -> tuple[Array, Triangles, Repairs]:
    """Read a file once for each state of it: a sweep asks for the same one at every point."""
    points, cells = step_surface(path) if is_step(path) else _parsed(path)
    if len(cells) > TRIANGLES.most:
        raise MeshFileError(f"a file {TRIANGLES.sentence(len(cells))}")
    vertices, triangles = _merged(points, cells)
    _check_triangles(vertices, triangles)
    # from the lowest vertex on: shells that touch may have one triangle in both ways
    start = triangles.argmin(axis=1)[:, None]
    way = np.take_along_axis(triangles, (start + np.arange(3)) % 3, axis=1)
    _check_doubles(vertices, triangles, way)
    joined = joined_sides(vertices, triangles)
    shell = shells_of(joined, len(triangles))
    _check_doubles(vertices, triangles, np.column_stack([np.sort(triangles, axis=1), shell]))
    faced, filled = facing(vertices, triangles, shell)
    check_crossings(vertices, faced, shell)
    done = Repairs(len(filled), int((faced != triangles).any(axis=1).sum()))
    if shell.any():
        return *united(vertices, faced, shell), done
    return *with_own_vertices(vertices, faced, joined_sides(vertices, faced)), done


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
    _check_triangles(vertices, triangles)
    _check_doubles(vertices, triangles, np.sort(triangles, axis=1))
    joined_sides(vertices, triangles, most=2)
    if not signed_volumes_m3(vertices, triangles).sum() > 0.0:
        raise MeshFileError("triangles that run counter-clockwise seen from outside")


def _parsed(path: Path) -> tuple[Array, Triangles]:
    # slow to import, and few scenes have meshes
    import meshio

    try:
        # not meshio.read, which ends the process at a file that it cannot read; of a text file it
        # takes some bytes for a number of triangles, which may overflow
        with np.errstate(over="ignore"):
            mesh = meshio.stl.read(str(path))
        cells = mesh.cells_dict.get("triangle", np.empty((0, 3)))
        points = np.asarray(mesh.points, dtype=np.float64).reshape(-1, 3)
    except (meshio.ReadError, OSError, ValueError, IndexError, TypeError, MemoryError) as error:
        raise MeshFileError("an STL file, ASCII or binary") from error
    if len(cells) == 0:
        raise MeshFileError("an STL file with triangles; here are none")
    if not np.isfinite(points).all():
        raise MeshFileError("vertices that are finite numbers")
    return points, np.asarray(cells, dtype=np.int64)


def _merged(points: Array, triangles: Triangles) -> tuple[Array, Triangles]:
    """Join vertices that only round-off of the file keeps apart."""
    near_m = SAME * extent(points)
    pairs = cKDTree(points).query_pairs(near_m, output_type="ndarray")
    n = len(points)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(links, directed=False)
    _, first = np.unique(group, return_index=True)
    return points[first], group[triangles].astype(np.int64)


def _check_triangles(vertices: Array, triangles: Triangles) -> None:
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    area2 = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    flat = area2 <= SAME * extent(vertices) * longest
    if flat.any():
        raise MeshFileError(
            f"triangles with an area; {_counted(flat, 'triangle')} degenerate, "
            f"{at(vertices[triangles[flat][0]].mean(axis=0))}"
        )


def _check_doubles(vertices: Array, triangles: Triangles, rows: Triangles) -> None:
    """Refuse triangles whose rows are equal."""
    _, index, count = np.unique(rows, axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        raise MeshFileError(
            f"triangles that differ; {_counted(count > 1, 'triangle')} given more than once, "
            f"{at(vertices[triangles[index[count > 1][0]]].mean(axis=0))}"
        )


def _counted(bad: NDArray[np.bool_], what: str) -> str:
    return f"{bad.sum()} {what}s are" if bad.sum() > 1 else f"1 {what} is"
