"""Exact parts of a solid bounded by triangles: inside spheres, and below heights."""

from __future__ import annotations

import numpy as np

from sandmould.geometry.geometry import Array
from sandmould.geometry.mesh import TriangleMesh

_CHUNK = 200_000
"""Pairs of sphere and triangle in memory together."""
_ON_SURFACE = 1e-7
"""A centre nearer to the surface than this share of the radius is moved off it by as much: on it,
the solid angle of the surface jumps."""


def sphere_mesh_m3(centre_m: Array, radius_m: Array, mesh: TriangleMesh) -> Array:
    """Volume common to spheres and a closed mesh, exact to about 1e-6 of the sphere.

    By the divergence theorem the common part is r^3/3 times the solid angle under which the
    centre sees the sphere's own surface inside the mesh, plus a third of the sum, over the
    triangles, of the area inside the sphere times the height of the triangle's plane over the
    centre. The first solid angle is that of all triangles' parts outside the sphere: 4 pi for a
    centre inside the mesh, 0 outside, less the triangles' parts inside the sphere. So only
    triangles that the sphere meets count.

    Gives (n,) float64, m3. ``centre_m``: (n, 3) float64, m; ``radius_m``: (n,) float64, m.
    """
    if len(centre_m) == 0:
        return np.zeros(0)
    # whether a centre lies inside is asked exactly; far away the lower bound is as good
    distance_m = mesh.distance_m(centre_m, reach_m=float(radius_m.max()))
    volume = np.where(distance_m < 0.0, 4.0 / 3.0 * np.pi * radius_m**3, 0.0)
    near = np.flatnonzero(np.abs(distance_m) < radius_m)
    centre_m, radius_m = centre_m[near].copy(), radius_m[near]
    on = np.abs(distance_m[near]) < _ON_SURFACE * radius_m
    if on.any():
        centre_m[on] += _ON_SURFACE * radius_m[on, None] * np.array([0.48, 0.60, 0.64])
        inside = mesh.distance_m(centre_m[on]) < 0.0
        volume[near[on]] = np.where(inside, 4.0 / 3.0 * np.pi * radius_m[on] ** 3, 0.0)
    corners_m = mesh.corners_m
    spheres, triangles = mesh.near_triangles(centre_m, radius_m)
    for at in range(0, len(spheres), _CHUNK):
        sphere, triangle = spheres[at : at + _CHUNK], triangles[at : at + _CHUNK]
        part = _triangle_part_m3(corners_m[triangle] - centre_m[sphere, None], radius_m[sphere])
        volume += np.bincount(near[sphere], weights=part, minlength=len(volume))
    return np.clip(volume, 0.0, None)


def _triangle_part_m3(corners_m: Array, radius_m: Array) -> Array:
    """What the part of a triangle inside a sphere round the origin adds, (p,) float64, m3."""
    # In polar coordinates round the foot of the centre, over an angle out to rho, area and solid
    # angle are rho^2/2 and 1 - h/sqrt(h^2 + rho^2); an edge d from the foot has rho = d/cos(angle),
    # cut off at the sphere's rim.
    edge_m = np.roll(corners_m, -1, axis=1) - corners_m
    normal = np.cross(edge_m[:, 0], edge_m[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    height_m = np.sum(normal * corners_m[:, 0], axis=1)[:, None]
    along = edge_m / np.linalg.norm(edge_m, axis=2)[..., None]
    inward = np.cross(normal[:, None], along)
    d = -np.sum(inward * corners_m, axis=2)
    depth, h, r = np.abs(d), np.abs(height_m), radius_m[:, None]
    first = np.sum(along * corners_m, axis=2)
    last = np.sum(along * (corners_m + edge_m), axis=2)
    rim = np.sqrt(np.maximum(r**2 - h**2, 0.0))
    half_chord = np.sqrt(np.maximum(rim**2 - d**2, 0.0))
    first_in, last_in = (
        np.clip(first, -half_chord, half_chord),
        np.clip(last, -half_chord, half_chord),
    )
    swept_out = _angle(first_in, depth) - _angle(first, depth)
    swept_out += _angle(last, depth) - _angle(last_in, depth)
    area = 0.5 * (depth * (last_in - first_in) + rim**2 * swept_out)
    # integral of h/sqrt(h^2 + rho^2) along the edge: arcsin(h sin(angle)/sqrt(h^2 + d^2))
    lean = _lean(last_in, depth, h) - _lean(first_in, depth, h)
    angle = _angle(last, depth) - _angle(first, depth) - lean - h / r * swept_out
    side = np.sign(d)
    area, angle = np.sum(side * area, axis=1), np.sum(side * angle, axis=1)
    return np.asarray((height_m[:, 0] * area - np.sign(height_m[:, 0]) * radius_m**3 * angle) / 3.0)


def _angle(along_m: Array, depth_m: Array) -> Array:
    return np.arctan2(along_m, depth_m)


def _lean(along_m: Array, depth_m: Array, height_m: Array) -> Array:
    """Integral of h/sqrt(h^2 + d^2/cos^2) from the foot of an edge to a place along it."""
    to_edge = np.sqrt(height_m**2 + depth_m**2)
    to_place = np.sqrt(depth_m**2 + along_m**2)
    share = height_m * along_m / np.maximum(to_edge * to_place, 1e-300)
    return np.asarray(np.arcsin(np.clip(share, -1.0, 1.0)))


def mesh_below_m3(mesh: TriangleMesh, height_m: Array) -> Array:
    """Volume of a closed mesh under each height, exact, (m,) float64, m3.

    By the divergence theorem it is the sum, over the triangles' parts below the height, of the
    integral of the depth under it times the slope of the triangle. ``height_m``: (m,) float64, m.
    """
    corners_m = mesh.corners_m
    # twice the area seen from above, negative for a triangle that faces down
    first_m, second_m = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    plan = 0.5 * (first_m[:, 0] * second_m[:, 1] - first_m[:, 1] * second_m[:, 0])
    low, middle, top = np.sort(corners_m[:, :, 2], axis=1).T
    return np.array([-float(plan @ _mean_depth(low, middle, top, h)) for h in height_m.tolist()])


def _mean_depth(low: Array, middle: Array, top: Array, height_m: float) -> Array:
    """Mean over a triangle of the depth under a height, 0 where it rises above it."""
    below = np.maximum(height_m - low, 0.0)
    above = np.maximum(top - height_m, 0.0)
    # the tip below the height, or all but the tip above it, is a triangle of its own
    tip = (height_m > low) & (height_m <= middle)
    but = (height_m > middle) & (height_m < top)
    whole = height_m - (low + middle + top) / 3.0
    tip_span = np.where(tip, (middle - low) * (top - low), 1.0)
    but_span = np.where(but, (top - low) * (top - middle), 1.0)
    partly = np.where(but, whole + above**3 / (3.0 * but_span), whole)
    return np.where(tip, below**3 / (3.0 * tip_span), np.where(height_m <= low, 0.0, partly))
