"""Meshes of patterns from files of any format that meshio reads."""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import meshio
import numpy as np
from meshio.gmsh import _gmsh41
from numpy.typing import NDArray
from skfem import MeshHex1, MeshQuad1, MeshTet1, MeshTri1
from skfem.io.meshio import from_meshio

from sandmould.pattern_fe.checks import check_mesh
from sandmould.pattern_fe.shapes import with_sides

Array = NDArray[np.float64]
_SOLID = ("tetra", "tetra10", "hexahedron", "hexahedron27")
_PLANE = ("triangle", "triangle6", "quad", "quad9")
_STRAIGHT = {(2, 3): MeshTri1, (2, 4): MeshQuad1, (3, 4): MeshTet1, (3, 8): MeshHex1}
"""By dimension and number of corners."""


def read_mesh(path: Path, unit_m: float = 1.0) -> Any:
    """Read a pattern of triangles or quadrilaterals, or of tetrahedra or hexahedra.

    Physical groups of faces become named boundaries, and the extreme sides are named as in
    ``shapes.SIDES`` unless a group has that name. Mid-side nodes are dropped: edges are straight;
    groups of faces that have such nodes are not found.

    ``unit_m``: length of the file's unit, 0.001 for millimetres.

    Raises
    ------
    ValueError
        When the file cannot be read, has not one kind of element, or its mesh is no pattern.
    """
    if not 0.0 < unit_m < np.inf:
        raise ValueError(f"unit of the mesh file {path.name} is {unit_m} m, valid is above 0")
    content = _parsed(path)
    kinds = [block.type for block in content.cells]
    solid = sorted({kind for kind in kinds if kind in _SOLID})
    plane = sorted({kind for kind in kinds if kind in _PLANE})
    own = solid or plane
    if len(own) != 1:
        present = ", ".join(sorted(set(kinds))) or "none"
        valid = "one kind among triangles, quadrilaterals, tetrahedra and hexahedra"
        raise ValueError(f"mesh file {path.name} has elements {present}, valid is {valid}")
    points = np.asarray(content.points, dtype=np.float64)
    _check_numbers(path, content, points)
    if not solid and points.shape[1] == 3 and np.ptp(points[:, 2]) > 1e-9 * np.ptp(points):
        raise ValueError(
            f"mesh file {path.name} has a surface in space, not closed round a solid; valid are "
            "tetrahedra or hexahedra, or triangles or quadrilaterals in a plane of constant z"
        )
    try:
        mesh = _straight(_with_groups(content), unit_m)
    except (IndexError, KeyError, TypeError) as error:
        raise ValueError(
            f"mesh file {path.name} has elements and groups that do not fit together"
        ) from error
    check_mesh(mesh)
    return with_sides(mesh)


def _check_numbers(path: Path, content: meshio.Mesh, points: NDArray[np.float64]) -> None:
    """Refuse elements between points that are not there, and points that are nowhere."""
    for block in content.cells:
        nodes = np.asarray(block.data)
        if nodes.size and not 0 <= nodes.min() <= nodes.max() < len(points):
            raise ValueError(
                f"mesh file {path.name} has elements between points that it does not have; it has "
                f"{len(points)} points"
            )
    if not np.isfinite(points).all():
        raise ValueError(f"mesh file {path.name} has points that are no finite numbers")


def _parsed(path: Path) -> meshio.Mesh:
    printed = io.StringIO()
    # meshio tries Ansys's format first on this ending, and never ends at some damaged files
    known = "gmsh" if path.suffix.lower() == ".msh" else None
    try:
        # a device has no end
        if path.exists() and not path.is_file():
            raise OSError("it is a folder or a device")
        # meshio prints and ends the process at a file that it cannot read; of a text file it takes
        # some bytes for a number of triangles, which may overflow
        hushed = contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed)
        with hushed[0], hushed[1], np.errstate(over="ignore"), _all_saved():
            return meshio.read(path, file_format=known)
    except (Exception, SystemExit) as error:
        told = error if isinstance(error, Exception) else ""
        reason = " ".join(f"{printed.getvalue()} {told}".split()) or "not readable"
        valid = "a mesh that meshio reads, such as .msh of Gmsh, .vtu or .inp"
        raise ValueError(f"mesh file {path} cannot be read ({reason}), valid is {valid}") from error


@contextlib.contextmanager
def _all_saved() -> Iterator[None]:
    """Let meshio read files of Gmsh 4.1 whose groups do not hold all elements (Mesh.SaveAll)."""
    # It takes the numbers of groups for too few then. Groups are found by their names.
    given = _gmsh41.Mesh

    def fitting(points: Any, cells: Any, *, cell_data: dict[str, Any], **others: Any) -> Any:
        whole = {name: rows for name, rows in cell_data.items() if len(rows) == len(cells)}
        return given(points, cells, cell_data=whole, **others)

    _gmsh41.Mesh = fitting
    try:
        yield
    finally:
        _gmsh41.Mesh = given


def _with_groups(content: meshio.Mesh) -> Any:
    """Mesh of scikit-fem with the file's groups; it only warns of groups that it cannot place."""
    log = logging.getLogger("skfem.io.meshio")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        return from_meshio(content, ignore_orientation=True)
    finally:
        log.setLevel(level)


def _straight(mesh: Any, unit_m: float) -> Any:
    """Mesh of corners alone, with those groups of faces that lie on its boundary."""
    corners = mesh.t[: mesh.refdom.nnodes]
    used, t = np.unique(corners, return_inverse=True)
    kind = _STRAIGHT[mesh.dim(), len(corners)]
    points = np.ascontiguousarray(unit_m * mesh.p[:, used])
    straight = kind(points, np.ascontiguousarray(t.reshape(corners.shape)))
    outer = {tuple(sorted(v)): f for f, v in enumerate(straight.facets.T.tolist())}
    groups = {}
    for name, facets in (mesh.boundaries or {}).items():
        ends = np.searchsorted(used, mesh.facets[: len(straight.facets), np.asarray(facets)])
        numbers = [outer[tuple(sorted(v))] for v in ends.T.tolist()]
        own = np.intersect1d(numbers, straight.boundary_facets())
        if len(own):
            groups[name] = own
    return straight.with_boundaries(groups)
