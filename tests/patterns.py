"""Patterns that the tests of ``pattern_fe`` share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.typing import NDArray
from skfem import MeshQuad, MeshTet
from skfem.io.meshio import to_meshio
from threadpoolctl import threadpool_limits

from sandmould.pattern_fe.large_displacement import NewtonSettings
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.shapes import Rectangle, bar, l_shape, mesh_of, with_sides
from sandmould.pattern_fe.supports import Supports

Array = NDArray[np.float64]
THICKNESS_M = 0.25
KINDS = ("quadrilaterals", "triangles", "hexahedra", "tetrahedra")
FOOT = Supports(clamped=("bottom",))


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Keep small products of matrices from waiting for one another's threads."""
    with threadpool_limits(1):
        yield


def mesh_of_kind(kind: str, element_m: float = 0.01, extent_m: float = 0.02) -> Any:
    """Square or cube of any kind of element, corner at the origin."""
    depth_m = extent_m if kind in ("hexahedra", "tetrahedra") else None
    mesh = mesh_of(bar(extent_m, extent_m), element_m, depth_m)
    if kind == "triangles":
        return with_sides(mesh.to_meshtri())
    if kind == "tetrahedra":
        lines = [np.unique(np.round(axis, 12)) for axis in mesh.p]
        return with_sides(MeshTet.init_tensor(*lines))
    return mesh


def distorted(mesh: Any, share: float = 0.2) -> Any:
    """Same mesh with its inner nodes moved at random."""
    moved = mesh.p.copy()
    inner = mesh.interior_nodes()
    length_m = np.ptp(mesh.p[:, mesh.t[:, 0]], axis=1).max()
    moved[:, inner] += (
        share * length_m * np.random.default_rng(3).uniform(-1, 1, (len(moved), len(inner)))
    )
    return type(mesh)(moved, mesh.t).with_boundaries(dict(mesh.boundaries))


def pattern_of_kind(kind: str, order: int, supports: Supports = FOOT, **mesh: float) -> Pattern:
    """Pattern of default foam on a square or cube."""
    shape = mesh_of_kind(kind, **mesh)
    thickness_m = THICKNESS_M if shape.dim() == 2 else None
    return Pattern(shape, supports, order=order, thickness_m=thickness_m)


def l_pattern(element_m: float = 0.015 / 2, order: int = 2) -> Pattern:
    """An L on its foot: 15 mm thick, 60 mm high, 75 mm from the back to the tip."""
    mesh = mesh_of(l_shape(0.015, 0.06, 0.075), element_m)
    return Pattern(mesh, FOOT, order=order, thickness_m=THICKNESS_M)


def cantilever(
    length_m: float, height_m: float, through: int, along: int, order: int, poisson: float = 0.35
) -> Pattern:
    """Horizontal bar clamped at its left end, elements through and along it given."""
    mesh = MeshQuad.init_tensor(
        np.linspace(0.0, length_m, along + 1), np.linspace(0.0, height_m, through + 1)
    )
    foam = Foam(poisson=poisson)
    return Pattern(
        with_sides(mesh), Supports(clamped=("left",)), foam, order, thickness_m=THICKNESS_M
    )


def end_load(pattern: Pattern, force_n: float) -> Array:
    """Force along y on the right end, shared by the areas of its vertices."""
    surface = pattern.surface
    right = surface.vertices_m[:, 0] > surface.vertices_m[:, 0].max() - 1e-9
    # only the part of each area that faces right
    area = np.where(right, surface.vertex_area_vector_m2[:, 0], 0.0)
    loads = np.zeros_like(surface.vertices_m)
    loads[:, 1] = force_n * area / area.sum()
    return pattern.on_nodes(loads)


def frame(thickness_m: float, width_m: float, height_m: float) -> list[Rectangle]:
    """Hollow box: four walls of one thickness around a cavity."""
    inner_m, roof_m = width_m - thickness_m, height_m - thickness_m
    return [
        (0.0, 0.0, width_m, thickness_m),
        (0.0, roof_m, width_m, height_m),
        (0.0, 0.0, thickness_m, height_m),
        (inner_m, 0.0, width_m, height_m),
    ]


def write_mesh(path: Path, mesh: Any) -> None:
    """Write a mesh with its named boundaries in a format that the file's name asks for.

    The names go along as cell data of scikit-fem, which ``read_mesh`` understands; formats
    without cell data lose them. Points of 2D lie at z = 0.
    """
    written = to_meshio(mesh)
    written.points = np.pad(written.points, ((0, 0), (0, 3 - written.points.shape[1])))
    meshio.write(path, written)


def read_shapes(path: Path, vertices: int, dimension: int) -> tuple[Array, Array]:
    """Times (k,) in s and displacements (k, nv, d) in m of all whole rows of a file."""
    width = 1 + vertices * dimension
    flat = np.fromfile(path, dtype="<f8")
    table = flat[: len(flat) // width * width].reshape(-1, width)
    return table[:, 0], table[:, 1:].reshape(-1, vertices, dimension)


def bent_far(pattern: Pattern, load_n: Array, **settings: Any) -> Array:
    """Large displacements under dead loads, (n, d) float64, m."""
    return pattern.solve_large(load_n, settings=NewtonSettings(**settings))[0]
