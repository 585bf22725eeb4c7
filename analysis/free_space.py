"""The space that the walls of the box and the solids leave for the sand.

Solids are taken to lie apart from one another. What of a block or an outline lies outside the box
is not subtracted; a cuboid tilted in 3D, a mesh and a round solid are taken to lie inside it.

Blocks, outlines and meshes are exact. A round solid is measured as a mesh of 128 sides with the
same volume; its surface then lies within 2e-4 of its radius R from the round one, so that the part
of a sphere of radius r cut by it is wrong by less than 3e-4 R/r of the sphere.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from sandmould.analysis.intersections import (
    cut_polygon,
    disc_outline_m2,
    disc_polygon_m2,
    polygon_area_m2,
    sphere_prism_m3,
)
from sandmould.arrays import Centres, Radii
from sandmould.geometry.geometry import Array, Block, Scene, Solid, Wall
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline

_UPRIGHT = 1e-9
"""Largest slope at which a wall or a block counts as upright or level."""
_CHUNK = 200_000
"""Pairs of sphere and triangle in memory together."""
_ON_SURFACE = 1e-7
"""A centre nearer to the surface than this share of the radius is moved off it by as much: on it,
the solid angle of the surface jumps."""


@dataclass(frozen=True)
class _Prism:
    """A convex section swept along the third of three orthonormal axes."""

    origin_m: Array
    axes: Array
    section_m: Array
    low_m: float
    high_m: float

    def part_m3(self, position_m: Array, radius_m: Array) -> Array:
        """Volume of each sphere inside, (n,) float64, m3."""
        local_m = (position_m - self.origin_m) @ self.axes.T
        return sphere_prism_m3(local_m, radius_m, self.section_m, self.low_m, self.high_m)

    def below_m3(self, height_m: Array) -> Array:
        """Volume under each height, (m,) float64, m3; the section of a tilted one is a box's."""
        if abs(self.axes[2, 2]) > 1.0 - _UPRIGHT:
            level = np.clip(height_m - self.origin_m[2], self.low_m, self.high_m)
            return abs(polygon_area_m2(self.section_m)) * (level - self.low_m)
        size_m = np.append(np.ptp(self.section_m, axis=0), self.high_m - self.low_m)
        return _cuboid_below_m3(size_m, self.axes[:, 2], height_m - self.origin_m[2])


def free_part(position_m: Centres, radius_m: Radii, scene: Scene) -> Array:
    """Measure of the part of each disc or sphere that lies in free space.

    Gives (n,) float64, m2 in 2D or m3 in 3D; never negative, even where solids overlap one another.

    Raises
    ------
    ValueError
        When a wall of a 3D scene is oblique.
    """
    if len(position_m) == 0:
        return np.zeros(0)
    # beyond every disc, so that this bound stands for none
    margin_m = 2.0 * float(radius_m.max())
    low_m = position_m.min(axis=0) - margin_m
    high_m = position_m.max(axis=0) + margin_m
    if scene.dimension == 2:
        box_m = _box_polygon(scene.walls, low_m, high_m)
        part = disc_polygon_m2(position_m, radius_m, box_m)
    else:
        part = _box_prism(scene.walls, low_m, high_m).part_m3(position_m, radius_m)
    for solid in scene.solids:
        part -= part_in_solid(position_m, radius_m, solid, scene.walls)
    return np.maximum(part, 0.0)


def part_in_solid(
    position_m: Centres, radius_m: Radii, solid: Solid, walls: tuple[Wall, ...] = ()
) -> Array:
    """Measure of the part of each disc or sphere that lies in a solid, or in a space of its shape.

    ``walls``: what of a 2D solid or an upright block lies behind them does not count.

    Gives (n,) float64, m2 in 2D or m3 in 3D; exact but for round solids, as the head of this file
    says.
    """
    if isinstance(solid, Outline):
        return disc_outline_m2(position_m, radius_m, _within(solid.vertices_m, walls))
    if isinstance(solid, Block) and len(solid.centre_m) == 2:
        return disc_polygon_m2(position_m, radius_m, _block_polygon(solid, walls))
    if isinstance(solid, Block):
        return _block_prism(solid, walls).part_m3(position_m, radius_m)
    mesh = solid if isinstance(solid, TriangleMesh) else solid.mesh()
    return sphere_mesh_m3(position_m, radius_m, mesh)


def free_measure_between(scene: Scene, edges_m: Array) -> Array:
    """Area or volume of free space in each slab between successive heights.

    Exact but for round solids, whose edges are polygons of 128 sides with the same area.

    ``edges_m``, (m + 1,) float64, m: rising heights.

    Gives (m,) float64, m2 in 2D or m3 in 3D.

    Raises
    ------
    ValueError
        When the box is open at a side, or a wall of a 3D scene is oblique.
    """
    if scene.dimension == 2:
        box_m = box_section(scene, float(edges_m[0]), float(edges_m[-1]))
        below = polygon_below_m2(box_m, edges_m)
        for block in scene.blocks:
            below = below - polygon_below_m2(_block_polygon(block, scene.walls), edges_m)
        for outline in scene.outlines:
            below = below - polygon_below_m2(_within(outline.vertices_m, scene.walls), edges_m)
    else:
        level = np.clip(edges_m, *box_levels_m(scene.walls))
        below = abs(polygon_area_m2(box_section(scene))) * (level - level[0])
        for block in scene.blocks:
            below = below - _block_prism(block, scene.walls).below_m3(edges_m)
        for mesh in _meshes(scene):
            below = below - mesh_below_m3(mesh, edges_m)
    return np.maximum(np.diff(below), 0.0)


def _meshes(scene: Scene) -> tuple[TriangleMesh, ...]:
    """Meshes, and round solids as such."""
    return (*scene.meshes, *(solid.mesh() for solid in scene.revolved))


def box_section(scene: Scene, low_m: float = 0.0, high_m: float = 0.0) -> Array:
    """Polygon of the box: between two heights in 2D, in plan in 3D, (k, 2) float64, m.

    ``low_m``, ``high_m``: heights that bound the polygon in 2D; not used in 3D.

    Raises
    ------
    ValueError
        When the walls leave the box open at a side.
    """
    points_m = np.array([wall.point_m for wall in scene.walls]).reshape(-1, scene.dimension)
    far_m = 10.0 * (1.0 + np.abs(points_m).max(initial=0.0))
    lowest, highest = np.full(2, -far_m), np.full(2, far_m)
    if scene.dimension == 2:
        lowest[1], highest[1] = low_m, high_m
    polygon_m = _box_polygon(scene.walls, lowest, highest)
    # in 2D the second column is the height, which the caller bounds
    across_m = polygon_m[:, : scene.dimension - 1]
    if np.abs(across_m).max(initial=0.0) >= far_m:
        raise ValueError("the walls leave the box open at a side, so it has no section")
    return polygon_m


def box_levels_m(walls: tuple[Wall, ...]) -> tuple[float, float]:
    """Heights of floor and lid of a 3D box, infinite where there is none.

    Returns
    -------
    floor_m, lid_m : float, m

    Raises
    ------
    ValueError
        When a wall is oblique.
    """
    level = [wall for wall in walls if _is_level(wall)]
    floors_m = [float(wall.point_m[2]) for wall in level if wall.normal[2] > 0.0]
    lids_m = [float(wall.point_m[2]) for wall in level if wall.normal[2] < 0.0]
    return max(floors_m, default=-np.inf), min(lids_m, default=np.inf)


def _box_polygon(walls: tuple[Wall, ...], low_m: Array, high_m: Array) -> Array:
    """Rectangle cut by the walls; of those of 3D, by the upright ones."""
    x, y = (low_m[0], high_m[0]), (low_m[1], high_m[1])
    polygon_m = np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])
    return _within(polygon_m, walls)


def _within(polygon_m: Array, walls: tuple[Wall, ...]) -> Array:
    """Part of a polygon (in plan, in 3D) on the sand's side of all walls."""
    for wall in walls:
        if len(wall.normal) == 2 or not _is_level(wall):
            polygon_m = cut_polygon(polygon_m, wall.point_m[:2], wall.normal[:2])
    return polygon_m


def _is_level(wall: Wall) -> bool:
    """Tell a floor or lid of a 3D box from an upright wall."""
    slope = abs(float(wall.normal[2]))
    if _UPRIGHT < slope < 1.0 - _UPRIGHT:
        raise ValueError(f"wall {wall.name!r} is oblique: walls in 3D must be upright or level")
    return slope > 0.5


def _box_prism(walls: tuple[Wall, ...], low_m: Array, high_m: Array) -> _Prism:
    """Box of a 3D scene, bounded where it is open."""
    floor_m, lid_m = box_levels_m(walls)
    section_m = _box_polygon(walls, low_m[:2], high_m[:2])
    bottom_m, top_m = max(floor_m, float(low_m[2])), min(lid_m, float(high_m[2]))
    return _Prism(np.zeros(3), np.eye(3), section_m, bottom_m, top_m)


def _rectangle(centre_m: Array, first_m: Array, second_m: Array) -> Array:
    """Corners in turn, from the centre and two half sides."""
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return centre_m + signs @ np.array([first_m, second_m])


def _block_polygon(block: Block, walls: tuple[Wall, ...]) -> Array:
    """Part of a 2D block inside the box."""
    sides_m = block.half_size_m[:, None] * block.axes
    return _within(_rectangle(block.centre_m, sides_m[0], sides_m[1]), walls)


def _block_prism(block: Block, walls: tuple[Wall, ...]) -> _Prism:
    """Part of a 3D block inside the box if it stands upright, else the whole block."""
    sides_m = block.half_size_m[:, None] * block.axes
    upright = int(np.argmax(np.abs(block.axes[:, 2])))
    if abs(block.axes[upright, 2]) > 1.0 - _UPRIGHT:
        first, second = (i for i in range(3) if i != upright)
        section_m = _rectangle(block.centre_m[:2], sides_m[first, :2], sides_m[second, :2])
        half_m, z_m = float(block.half_size_m[upright]), float(block.centre_m[2])
        floor_m, lid_m = box_levels_m(walls)
        low_m, high_m = max(z_m - half_m, floor_m), min(z_m + half_m, lid_m)
        return _Prism(np.zeros(3), np.eye(3), _within(section_m, walls), low_m, high_m)
    a, b, c = block.half_size_m
    section_m = _rectangle(np.zeros(2), np.array([a, 0.0]), np.array([0.0, b]))
    return _Prism(block.centre_m, block.axes, section_m, -float(c), float(c))


def polygon_below_m2(polygon_m: Array, height_m: Array) -> Array:
    """Area of a polygon under each height, (m,) float64, m2.

    ``polygon_m``: (k, 2) float64, m; ``height_m``: (m,) float64, m.
    """
    down = np.array([0.0, -1.0])
    cut = [cut_polygon(polygon_m, np.array([0.0, h]), down) for h in height_m]
    return np.array([abs(polygon_area_m2(part)) for part in cut])


def _cuboid_below_m3(size_m: Array, slope: Array, height_m: Array) -> Array:
    """Volume of a tilted cuboid under heights measured from its centre."""
    # The height of a random point in it is a sum of uniform numbers, one an axis:
    # inclusion-exclusion over the corners of powers of (h - corner).
    rise_m = size_m * np.abs(slope)
    # a side all but level adds nothing to the spread and would only cancel digits
    rise_m = rise_m[rise_m > 1e-5 * rise_m.max()]
    corners = np.array(list(product((0.0, 1.0), repeat=len(rise_m))))
    from_bottom = height_m + 0.5 * rise_m.sum()
    powers = np.maximum(from_bottom[:, None] - corners @ rise_m, 0.0) ** len(rise_m)
    factorial = {1: 1.0, 2: 2.0, 3: 6.0}[len(rise_m)]
    signs = (-1.0) ** corners.sum(axis=1)
    share = powers @ signs / (factorial * rise_m.prod())
    inside = np.abs(height_m) < 0.5 * rise_m.sum()
    return float(size_m.prod()) * np.where(inside, share, height_m > 0.0)


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
