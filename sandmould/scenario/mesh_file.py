"""Closed surfaces from STL files, checked before they stand in a scene."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sandmould.digest import file_digest
from sandmould.scenario.mesh import signed_volumes_m3

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]
SAME = 1e-6
"""Vertices nearer than this share of the mesh's extent are one; STL holds seven digits."""
LEAST_VOLUME = 1e-9
"""A surface around less than this share of its extent cubed encloses nothing."""


class MeshFileError(ValueError):
    """A file that bounds no solid; its text says what would be valid."""


def file_hash(path: Path) -> str:
    """SHA-256 of a file.

    Raises
    ------
    MeshFileError
        When it cannot be read.
    """
    try:
        return file_digest(path)
    except OSError as error:
        reason = error.strerror or "it cannot be read"
        raise MeshFileError(f"a readable file ({reason})") from error


def read_surface(path: Path) -> tuple[Array, Triangles]:
    """Read an STL file, ASCII or binary, as a closed surface seen from outside.

    Vertices are merged within a millionth of the extent. A surface that is closed and oriented
    alike throughout but faces inwards is turned round; a cavity faces inwards, as it must.

    Parameters
    ----------
    path : Path

    Returns
    -------
    vertices : (nv, 3) float64
        In the file's unit.
    triangles : (nt, 3) int64

    Raises
    ------
    MeshFileError
        When the file is missing or no STL, or its triangles bound no solid.
    """
    return _read(path, file_hash(path))


@lru_cache(maxsize=8)
def _read(path: Path, sha256: str) -> tuple[Array, Triangles]:
    """Read a file once for each state of it: a sweep asks for the same one at every point."""
    vertices, triangles = _merged(*_parsed(path))
    _check_triangles(vertices, triangles)
    shell = _shells(vertices, triangles)
    return _outward(vertices, triangles, shell)


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
    _shells(vertices, triangles)
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
    except (meshio.ReadError, OSError, ValueError, IndexError, TypeError) as error:
        raise MeshFileError("an STL file, ASCII or binary") from error
    if len(cells) == 0:
        raise MeshFileError("an STL file with triangles; here are none")
    if not np.isfinite(points).all():
        raise MeshFileError("vertices that are finite numbers")
    return points, np.asarray(cells, dtype=np.int64)


def _merged(points: Array, triangles: Triangles) -> tuple[Array, Triangles]:
    """Join vertices that only round-off of the file keeps apart."""
    near_m = SAME * _extent(points)
    pairs = cKDTree(points).query_pairs(near_m, output_type="ndarray")
    n = len(points)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(links, directed=False)
    _, first = np.unique(group, return_index=True)
    return points[first], group[triangles].astype(np.int64)


def _extent(points: Array) -> float:
    return float(np.ptp(points, axis=0).max())


def _check_triangles(vertices: Array, triangles: Triangles) -> None:
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    area2 = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    flat = area2 <= SAME * _extent(vertices) * longest
    if flat.any():
        raise MeshFileError(
            f"triangles with an area; {_counted(flat, 'triangle')} degenerate, "
            f"{_at(vertices[triangles[flat][0]].mean(axis=0))}"
        )
    _, index, count = np.unique(
        np.sort(triangles, axis=1), axis=0, return_index=True, return_counts=True
    )
    if (count > 1).any():
        raise MeshFileError(
            f"triangles that differ; {_counted(count > 1, 'triangle')} given more than once, "
            f"{_at(vertices[triangles[index[count > 1][0]]].mean(axis=0))}"
        )


def _shells(vertices: Array, triangles: Triangles) -> NDArray[np.int64]:
    """Number of the connected shell of each triangle, (nt,) int64.

    Each edge must belong to two triangles, which run along it in opposite ways.
    """
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, inverse, count = np.unique(
        np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    way = np.bincount(inverse.ravel(), weights=np.where(ends[:, 0] < ends[:, 1], 1.0, -1.0))
    faults = (
        (count == 1, "a closed surface", "belong to one triangle only", "belongs"),
        (count > 2, "edges of two triangles", "belong to more", "belongs"),
        (way != 0.0, "triangles that all face one way", "lie between two that do not", "lies"),
    )
    for bad, valid, plural, singular in faults:
        if bad.any():
            words = plural if bad.sum() > 1 else " ".join([singular, *plural.split()[1:]])
            number = f"{bad.sum()} edge{'s' if bad.sum() > 1 else ''}"
            place = _at(vertices[edges[bad][0]].mean(axis=0))
            raise MeshFileError(f"{valid}; {number} {words}, {place}")
    beside = (np.argsort(inverse.ravel(), kind="stable") // 3).reshape(-1, 2)
    n = len(triangles)
    links = coo_array((np.ones(len(beside)), (beside[:, 0], beside[:, 1])), shape=(n, n))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _counted(bad: NDArray[np.bool_], what: str) -> str:
    return f"{bad.sum()} {what}s are" if bad.sum() > 1 else f"1 {what} is"


def _at(place: Array) -> str:
    return "one at ({}) in the file's unit".format(", ".join(f"{x:.4g}" for x in place))


def _outward(
    vertices: Array, triangles: Triangles, shell: NDArray[np.int64]
) -> tuple[Array, Triangles]:
    """Turn every shell that faces the wrong way; a shell inside another is a cavity."""
    count = int(shell.max()) + 1
    volume = np.bincount(shell, weights=signed_volumes_m3(vertices, triangles), minlength=count)
    for number in range(count):
        own = triangles[shell == number]
        if abs(volume[number]) <= LEAST_VOLUME * _extent(vertices[own.ravel()]) ** 3:
            raise MeshFileError("a surface that encloses a volume")
        around = [
            other
            for other in range(count)
            if other != number
            and _surrounds(vertices[triangles[shell == other]], vertices[own[0, 0]])
        ]
        if (volume[number] > 0.0) != (len(around) % 2 == 0):
            triangles = np.where((shell == number)[:, None], triangles[:, ::-1], triangles)
    # shells that meet in a vertex have one each, or its normal would mix theirs
    own, corner = np.unique(triangles * count + shell[:, None], return_inverse=True)
    return vertices[own // count], corner.reshape(-1, 3).astype(np.int64)


def _surrounds(corners: Array, point: Array) -> bool:
    """Whether a closed surface goes round a point: its solid angle there is all or nothing.

    Van Oosterom and Strackee, IEEE Transactions on Biomedical Engineering 30, 1983.
    """
    a, b, c = (corners - point).transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    triple = np.sum(a * np.cross(b, c), axis=1)
    ab, bc, ca = np.sum(a * b, axis=1), np.sum(b * c, axis=1), np.sum(c * a, axis=1)
    angle = 2.0 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb)
    return bool(abs(angle.sum()) > 2.0 * np.pi)
