"""A deformed pattern in files: fields of its surface and solid for ParaView, and STL."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray
from skfem import MeshQuad
from skfem.io.meshio import to_meshio

from sandmould.pattern_fe.loads import vertex_pressure_pa
from sandmould.pattern_fe.perimeter import Perimeter, distance_from_drawing
from sandmould.pattern_fe.space import Space

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def write_surface(
    path: Path, perimeter: Perimeter, displacement_m: Array, load_n: Array | None = None
) -> None:
    """Write the deformed surface, for ParaView and tools that measure shapes (.vtu).

    Points lie where the vertices are, each with its displacement and its distance from the drawing,
    positive outside it; with loads also these and the pressure (56), per area as drawn.
    ``perimeter``: as drawn. ``displacement_m``, ``load_n``, (nv, d) float64, m and N: of the
    vertices.
    """
    kind = "line" if perimeter.facets.shape[1] == 2 else "triangle"
    moved = perimeter.moved(displacement_m)
    values = {
        "displacement_m": _in_space(displacement_m),
        "distance_m": distance_from_drawing(perimeter, moved).vertex_m,
    }
    if load_n is not None:
        values["load_n"] = _in_space(load_n)
        values["pressure_pa"] = vertex_pressure_pa(perimeter, load_n)
    meshio.Mesh(_in_space(moved.vertices_m), [(kind, perimeter.facets)], point_data=values).write(
        path, file_format="vtu"
    )


def write_solid(
    path: Path, space: Space, displacement_m: Array, of_elements: Mapping[str, Array]
) -> None:
    """Write the deformed solid for ParaView (.vtu), sides of elements straight.

    ``displacement_m``, (n, d) float64, m: of all nodes. ``of_elements``: mapping of name to
    (ne,) float64.
    """
    mesh = space.mesh
    corners_m = displacement_m[: mesh.nvertices]
    fields = {name: [values] for name, values in of_elements.items()}
    bent = type(mesh)(mesh.p + corners_m.T, mesh.t)
    written = to_meshio(bent, {"displacement_m": _in_space(corners_m)}, fields)
    written.points = _in_space(written.points)
    written.write(path, file_format="vtu")


def write_stl(path: Path, space: Space, perimeter: Perimeter, displacement_m: Array) -> None:
    """Write the deformed surface as STL; a 2D pattern becomes a plate of its thickness.

    ``perimeter``: as drawn. ``displacement_m``, (n, d) float64, m: of all nodes of the pattern.
    """
    moved = perimeter.moved(perimeter.motion @ displacement_m)
    if space.dimension == 3:
        points, triangles = moved.vertices_m, moved.facets
    else:
        points, triangles = _plate(space, moved, space.node_m + displacement_m)
    meshio.Mesh(points, [("triangle", triangles)]).write(path, file_format="stl", binary=True)


def _plate(space: Space, moved: Perimeter, place_m: Array) -> tuple[Array, Indices]:
    """Two copies of a flat pattern and a wall between them; normals point outwards."""
    n = len(place_m)
    outline = np.asarray(moved.motion.argmax(axis=1))
    place_m[outline] = moved.vertices_m
    half_m = 0.5 * space.thickness_m
    points = np.vstack([np.column_stack([place_m, np.full(n, z)]) for z in (-half_m, half_m)])
    mesh = space.node_mesh
    flat = (mesh.to_meshtri() if isinstance(mesh, MeshQuad) else mesh).t.T
    edge, next_edge = (space.node_m[flat[:, i]] - space.node_m[flat[:, 0]] for i in (1, 2))
    turned = edge[:, 0] * next_edge[:, 1] - edge[:, 1] * next_edge[:, 0] < 0.0
    flat = np.where(turned[:, None], flat[:, ::-1], flat)
    a, b = outline[moved.facets].T
    wall = np.concatenate([np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)])
    return points, np.concatenate([flat[:, ::-1], flat + n, wall])


def _in_space(vectors: Array) -> Array:
    missing = 3 - vectors.shape[1]
    return np.pad(vectors, ((0, 0), (0, missing)))
