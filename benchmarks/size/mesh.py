"""A bed of spheres round a pattern whose surface is a mesh."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from benchmarks.engines.beds import Bed, falling, resting, solver_on
from sandmould.arrays import Floats, Ints

_HALF_AXES = (0.33, 0.33, 0.09)
"""Of the pattern, over the width of the box: a flat body in the middle of the bed."""


class Mesh(NamedTuple):
    """Triangles."""

    vertices_m: Floats
    """(nv, 3) float64."""
    facets: Ints
    """(nf, 3) int64."""


def ellipsoid(middle_m: Floats, half_axes_m: Floats, cuts: int) -> Mesh:
    """Give the ellipsoid onto which a cube is blown up, each of its faces cut into squares.

    Parameters
    ----------
    middle_m, half_axes_m : (3,) float64
    cuts : int
        Squares along an edge; each is two of the 12 cuts^2 triangles.
    """
    # Equal angles make the triangles nearly equal.
    line = np.tan(np.linspace(-0.25, 0.25, cuts + 1) * np.pi)
    u, v = (x.ravel() for x in np.meshgrid(line, line, indexing="ij"))
    square = np.arange(cuts)[:, None] * (cuts + 1) + np.arange(cuts)
    a, b, c, d = (square.ravel() + k for k in (0, cuts + 1, cuts + 2, 1))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    points, facets = [], []
    for face in range(6):
        side = np.full_like(u, 1.0 if face % 2 else -1.0)
        points.append(np.roll(np.stack([side, u, v], axis=1), face // 2, axis=1))
        facets.append(triangles + face * len(u))
    cube = np.concatenate(points)
    sphere = cube / np.linalg.norm(cube, axis=1, keepdims=True)
    # Faces share the vertices of their edges.
    _, first, place = np.unique(sphere.round(9), axis=0, return_index=True, return_inverse=True)
    return Mesh(middle_m + half_axes_m * sphere[first], place.ravel()[np.concatenate(facets)])


def round_pattern(bed: Bed, cuts: int) -> tuple[Bed, Mesh]:
    """Take the spheres that a pattern in the middle of a bed would cut; give the rest and it."""
    height = bed.position_m[:, 2].max()
    middle = 0.5 * np.array([bed.width_m, bed.depth_m, height])
    half = bed.width_m * np.array(_HALF_AXES)
    half[2] = min(half[2], 0.3 * height)
    mesh = ellipsoid(middle, half, cuts)
    far, _ = KDTree(mesh.vertices_m).query(bed.position_m)
    outside = (((bed.position_m - middle) / half) ** 2).sum(axis=1) > 1.0
    clear = outside & (far > 1.1 * bed.radius_m)
    rest = Bed(
        3, bed.width_m, bed.depth_m, bed.position_m[clear], bed.velocity_m_s[clear],
        bed.spin_rad_s[clear], bed.radius_m[clear],
    )  # fmt: skip
    return rest, mesh


def rested(bed: Bed, mesh: Mesh, fall_s: float, rest_s: float) -> Bed:
    """Let a bed fall on a pattern with softer springs, and come to rest with its own."""
    for changes, time_s in ((falling(3), fall_s), (resting(), rest_s)):
        solver = solver_on(bed, **changes)
        solver.surfaces.add_facets("pattern", *mesh)
        solver.place(bed.position_m, bed.velocity_m_s, bed.spin_rad_s)
        solver.advance(np.zeros(round(time_s / solver.scene.dt) + 2))
        velocity, spin = solver.whole_step_velocities()
        order = np.argsort(solver.grains.id)
        bed = replace(
            bed,
            position_m=solver.grains.position[order],
            velocity_m_s=velocity[order],
            spin_rad_s=spin[order],
        )
    return bed
