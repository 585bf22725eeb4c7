"""Exact common parts of discs and spheres with one another, with planes, polygons and prisms."""

from __future__ import annotations

import numpy as np

from sandmould.geometry.geometry import Array

_NODES = 12
"""Gauss points an interval; see :func:`sphere_prism_m3` for the error this leaves."""
_CHUNK = 20_000
"""Spheres integrated together, which bounds the memory of the slices."""
_TINY_M = 1e-150
"""Stands for a zero distance of centres: its square does not underflow to zero."""


def disc_segment_m2(distance_m: Array, radius_m: Array) -> Array:
    """Area of a disc beyond a straight line, (n,) float64, m2.

    ``r^2 arccos(x/r) - x sqrt(r^2 - x^2)``; 0 or the whole disc when the line misses it.
    ``distance_m``, (n,) float64, m: from the disc's centre to the line, negative when the centre
    lies beyond it. ``radius_m``: (n,) float64, m.
    """
    x = np.clip(distance_m, -radius_m, radius_m)
    return radius_m**2 * np.arccos(x / radius_m) - x * np.sqrt(radius_m**2 - x**2)


def sphere_cap_m3(distance_m: Array, radius_m: Array) -> Array:
    """Volume of a sphere beyond a plane, (n,) float64, m3.

    ``pi/3 (r - x)^2 (2 r + x)``; 0 or the whole sphere when the plane misses it. ``distance_m``,
    (n,) float64, m: from the sphere's centre to the plane, negative when the centre lies beyond it.
    ``radius_m``: (n,) float64, m.
    """
    x = np.clip(distance_m, -radius_m, radius_m)
    return np.pi / 3.0 * (radius_m - x) ** 2 * (2.0 * radius_m + x)


def disc_lens_m2(distance_m: Array, first_radius_m: Array, second_radius_m: Array) -> Array:
    """Area common to two discs, also when apart or one inside the other, (n,) float64, m2.

    The line of equal power cuts both discs along their common chord, so the lens is a segment of
    each. ``distance_m``, (n,) float64, m: between the centres. ``first_radius_m``,
    ``second_radius_m``: (n,) float64, m.
    """
    first, second = _to_common_chord(distance_m, first_radius_m, second_radius_m)
    return disc_segment_m2(first, first_radius_m) + disc_segment_m2(second, second_radius_m)


def sphere_lens_m3(distance_m: Array, first_radius_m: Array, second_radius_m: Array) -> Array:
    """Volume common to two spheres, also when apart or one inside the other, (n,) float64, m3.

    ``distance_m``, (n,) float64, m: between the centres. ``first_radius_m``, ``second_radius_m``:
    (n,) float64, m.
    """
    first, second = _to_common_chord(distance_m, first_radius_m, second_radius_m)
    return sphere_cap_m3(first, first_radius_m) + sphere_cap_m3(second, second_radius_m)


def _to_common_chord(distance_m: Array, first_m: Array, second_m: Array) -> tuple[Array, Array]:
    """Signed distances of the two centres from the line (plane) of equal power."""
    d = np.maximum(distance_m, _TINY_M)
    x = 0.5 * (d + (first_m - second_m) * (first_m + second_m) / d)
    return x, d - x


def _next(values: Array) -> Array:
    """Each row's follower, round: ``numpy.roll`` takes ten times as long for a few rows."""
    return np.concatenate((values[1:], values[:1]))


def polygon_area_m2(polygon_m: Array) -> float:
    """Area of a simple polygon, positive when its vertices run counter-clockwise.

    ``polygon_m``: (k, 2) float64, m.
    """
    x, y = polygon_m[:, 0], polygon_m[:, 1]
    return float(0.5 * np.sum(x * _next(y) - _next(x) * y))


def cut_polygon(polygon_m: Array, point_m: Array, normal: Array) -> Array:
    """Part of a polygon on the normal's side of a line, (k', 2) float64, m.

    A polygon that is not convex may be left in several pieces: they stay joined along the line by
    edges that run there and back, which bound no area.

    In the same sense of rotation; empty when nothing is left. ``polygon_m``: (k, 2) float64, m.
    ``point_m``, ``normal``, (2,) float64: a point of the line, m, and a vector towards the side
    that stays.
    """
    if len(polygon_m) == 0:
        return polygon_m
    side = (polygon_m - point_m) @ normal
    if (side > 0.0).all():
        return polygon_m
    following, next_side = _next(polygon_m), _next(side)
    crossed = (side > 0.0) != (next_side > 0.0)
    step = np.where(crossed, side, 0.0) / np.where(crossed, side - next_side, 1.0)
    crossing = polygon_m + step[:, None] * (following - polygon_m)
    # each vertex is followed by the crossing of the edge that it begins
    both = np.stack([polygon_m, crossing], axis=1).reshape(-1, 2)
    return both[np.stack([side > 0.0, crossed], axis=1).ravel()]


def depth_in_polygon_m(point_m: Array, polygon_m: Array) -> Array:
    """Distance of points from the nearest edge line of a convex polygon, positive inside it.

    Gives (n,) float64, m. ``point_m``: (n, 2) float64, m. ``polygon_m``, (k, 2) float64, m: in
    either sense of rotation.
    """
    return _inside_m(point_m, *_edges(polygon_m)).min(axis=1)


def disc_polygon_m2(centre_m: Array, radius_m: Array, polygon_m: Array) -> Array:
    """Area common to discs and one convex polygon, exact, (n,) float64, m2.

    Green's theorem: each edge, seen from the disc's centre at distance d, adds the triangle under
    its chord and the sectors beside it. A half-infinite region is given as a polygon that reaches
    beyond every disc.

    Parameters
    ----------
    centre_m : (n, 2) float64, m
    radius_m : (n,) float64, m
    polygon_m : (k, 2) float64, m
        In either sense of rotation; an empty one has no area.
    """
    area = np.zeros(len(centre_m))
    if len(polygon_m) < 3:
        return area
    start_m, along = _edges(polygon_m)
    if len(start_m) < 3:
        return area
    inside_m = _inside_m(centre_m, start_m, along).min(axis=1)
    whole = inside_m >= radius_m
    area[whole] = np.pi * radius_m[whole] ** 2
    cut = ~whole & (inside_m > -radius_m)
    area[cut] = _green_m2(centre_m[cut], radius_m[cut], start_m, along)
    return area


def disc_outline_m2(centre_m: Array, radius_m: Array, polygon_m: Array) -> Array:
    """Area common to discs and one polygon that need not be convex, exact, (n,) float64, m2.

    Parameters
    ----------
    centre_m : (n, 2) float64, m
    radius_m : (n,) float64, m
    polygon_m : (k, 2) float64, m
        In either sense of rotation; edges may run back along one another, as where
        :func:`cut_polygon` has parted it.
    """
    area = np.zeros(len(centre_m))
    if len(polygon_m) < 3:
        return area
    start_m, along = _edges(polygon_m)
    if len(start_m) < 3:
        return area
    away_m = np.maximum(start_m.min(axis=0) - centre_m, centre_m - start_m.max(axis=0))
    near = np.flatnonzero(away_m.max(axis=1) < radius_m)
    for at in range(0, len(near), _CHUNK):
        part = near[at : at + _CHUNK]
        area[part] = np.maximum(_green_m2(centre_m[part], radius_m[part], start_m, along), 0.0)
    return area


def _edges(polygon_m: Array) -> tuple[Array, Array]:
    """Vertices, counter-clockwise and without doubles, and the unit vectors of the edges."""
    vertex_m = polygon_m if polygon_area_m2(polygon_m) > 0.0 else polygon_m[::-1]
    extent_m = float(np.ptp(vertex_m, axis=0).max())
    length_m = np.linalg.norm(_next(vertex_m) - vertex_m, axis=1)
    vertex_m = vertex_m[length_m > 1e-12 * extent_m]
    edge_m = _next(vertex_m) - vertex_m
    return vertex_m, edge_m / np.linalg.norm(edge_m, axis=1)[:, None]


def _inside_m(centre_m: Array, start_m: Array, along: Array) -> Array:
    """(n, k) distances of points from the lines of the edges, positive on the inner side."""
    constant = along[:, 1] * start_m[:, 0] - along[:, 0] * start_m[:, 1]
    return centre_m @ np.array([-along[:, 1], along[:, 0]]) + constant


def _green_m2(centre_m: Array, radius_m: Array, start_m: Array, along: Array) -> Array:
    """Area common to discs and the polygon by Green's theorem."""
    d = _inside_m(centre_m, start_m, along)
    depth = np.abs(d)
    r = radius_m[:, None]
    half_chord = np.sqrt(np.maximum(r**2 - d**2, 0.0))
    length_m = np.linalg.norm(_next(start_m) - start_m, axis=1)
    first = np.sum(start_m * along, axis=1) - centre_m @ along.T
    last = first + length_m
    first_in = np.clip(first, -half_chord, half_chord)
    last_in = np.clip(last, -half_chord, half_chord)
    # the angles are those swept outside the chord, where the disc's own rim bounds the part
    angle = np.arctan2(first_in, depth) - np.arctan2(first, depth)
    angle += np.arctan2(last, depth) - np.arctan2(last_in, depth)
    return 0.5 * np.sum(np.sign(d) * (depth * (last_in - first_in) + r**2 * angle), axis=1)


def sphere_prism_m3(
    centre_m: Array, radius_m: Array, polygon_m: Array, low_m: float, high_m: float
) -> Array:
    """Volume common to spheres and a convex prism along the third axis, (n,) float64, m3.

    Spheres wholly inside, wholly outside or cut by one face only are exact. The others are
    integrated over slices (disc and polygon, exact) by Gauss-Legendre quadrature between the
    heights at which a slice first meets an edge or a corner; the error left is below 1e-6 of the
    common part.

    Parameters
    ----------
    centre_m : (n, 3) float64, m
    radius_m : (n,) float64, m
    polygon_m : (k, 2) float64, m
        Convex section in the plane of the first two axes.
    low_m, high_m : float, m
        Ends of the prism on the third axis.
    """
    volume = np.zeros(len(centre_m))
    if len(polygon_m) < 3 or high_m <= low_m:
        return volume
    start_m, along = _edges(polygon_m)
    if len(start_m) < 3:
        return volume
    z = centre_m[:, 2]
    inside_m = np.column_stack([_inside_m(centre_m[:, :2], start_m, along), z - low_m, high_m - z])
    nearest_m = inside_m.min(axis=1)
    met = nearest_m > -radius_m
    faces = np.sum(np.abs(inside_m) < radius_m[:, None], axis=1)
    simple = met & (faces <= 1)
    volume[simple] = sphere_cap_m3(-nearest_m[simple], radius_m[simple])
    hard = np.flatnonzero(met & (faces > 1))
    for at in range(0, len(hard), _CHUNK):
        part = hard[at : at + _CHUNK]
        volume[part] = _slices_m3(centre_m[part], radius_m[part], start_m, low_m, high_m)
    return volume


def _slices_m3(
    centre_m: Array, radius_m: Array, vertex_m: Array, low_m: float, high_m: float
) -> Array:
    """Integrate the area of slices between the heights where their shape changes."""
    start_m, along = _edges(vertex_m)
    r = radius_m[:, None]
    bottom = np.maximum(low_m - centre_m[:, 2:], -r)
    top = np.minimum(high_m - centre_m[:, 2:], r)
    edge_m = np.abs(_inside_m(centre_m[:, :2], start_m, along))
    corner_m = np.linalg.norm(centre_m[:, None, :2] - start_m, axis=2)
    reach_m = np.concatenate([edge_m, corner_m], axis=1)
    height = np.where(reach_m < r, np.sqrt(np.maximum(r**2 - reach_m**2, 0.0)), bottom)
    knots = np.clip(np.concatenate([bottom, -height, height, top], axis=1), bottom, top)
    knots.sort(axis=1)
    width = np.diff(knots, axis=1)
    which, interval = np.nonzero(width > 1e-9 * r)
    # x^2 (3 - 2x) flattens the ends, where the area grows like a power 3/2
    gauss, weight = np.polynomial.legendre.leggauss(_NODES)
    x = 0.5 * (1.0 + gauss)
    w = width[which, interval, None]
    t = knots[which, interval, None] + w * (x**2 * (3.0 - 2.0 * x))
    ring = np.sqrt(np.maximum(radius_m[which, None] ** 2 - t**2, 0.0))
    centres = np.repeat(centre_m[which, :2], _NODES, axis=0)
    area = disc_polygon_m2(centres, ring.ravel(), vertex_m).reshape(t.shape)
    share = np.sum(area * (0.5 * weight * 6.0 * x * (1.0 - x)), axis=1) * w[:, 0]
    volume = np.bincount(which, weights=share, minlength=len(radius_m))
    return volume.astype(np.float64)
