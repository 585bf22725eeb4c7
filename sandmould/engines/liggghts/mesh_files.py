"""Walls and obstacles as triangles, in LIGGGHTS's three dimensions.

A scene of discs becomes a plane of spheres, z = 0, and its walls become strips across that plane.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sandmould.geometry.geometry import Array, Block, Wall
from sandmould.geometry.outline import signed_area_m2
from sandmould.scenario.scenario import Scenario

LONGEST_OVER_WIDE = 20.0
"""Longest rectangle that is not cut: LIGGGHTS refuses triangles with an angle under 0.06 degrees
and warns under 0.5."""


def surface_triangles(
    scenario: Scenario, simulation_box: list[tuple[float, float]]
) -> dict[str, Array]:
    """Triangulate all walls, blocks and outlines, and take meshes as they are.

    ``simulation_box``, list of (low, high), m: one pair for each of three axes; the triangles stay
    well inside, as LIGGGHTS drops those that leave it.

    Gives the corners of each triangle by surface, (n, 3, 3) float64, m, counter-clockwise seen from
    the sand.
    """
    low, high = np.array(simulation_box).T
    # A quarter of the margin round the moulding box, and all that the box may move.
    inset = scenario.largest_diameter_m / 2 + largest_motion_m(scenario)
    low, high = low + inset, high - inset
    scene, span = scenario.scene, (low[2], high[2])
    surfaces = {wall.name: _wall(wall, low, high) for wall in scene.walls}
    for block in scene.blocks:
        surfaces[block.name] = (
            outline_strips(block.corners()[block.facets()[:, 0]], span)
            if scene.dimension == 2
            else _cuboid(block)
        )
    for outline in scene.outlines:
        surfaces[outline.name] = outline_strips(outline.vertices_m, span)
    for mesh in scene.meshes:
        surfaces[mesh.name] = mesh.corners_m
    return surfaces


def largest_motion_m(scenario: Scenario) -> float:
    """How far the walls go in the laboratory frame; in that of the box they stand."""
    if scenario.frame == "box":
        return 0.0
    shakings = (*scenario.vibrations, *scenario.fill.shakings)
    return max((shaking.amplitude_m for shaking in shakings), default=0.0)


def _rectangle(corner: Array, first: Array, second: Array) -> Array:
    """Two triangles, or more where the rectangle is long; the normal is first x second."""
    if np.linalg.norm(first) < np.linalg.norm(second):
        corner, first, second = corner + first, second, -first
    pieces = int(
        np.ceil(np.linalg.norm(first) / np.linalg.norm(second) / LONGEST_OVER_WIDE * (1 - 1e-9))
    )
    step = first / pieces
    triangles = []
    for i in range(pieces):
        a = corner + i * step
        b, c, d = a + step, a + step + second, a + second
        triangles += [[a, b, c], [a, c, d]]
    return np.array(triangles)


def _wall(wall: Wall, low: Array, high: Array) -> Array:
    """The part of an axis-parallel wall between two corners of space."""
    d = len(wall.normal)
    normal = np.zeros(3)
    normal[:d] = wall.normal
    axis = int(np.abs(normal).argmax())
    corner = low.copy()
    corner[axis] = wall.point_m[axis]
    first, second = ((high - low)[i] * np.eye(3)[i] for i in range(3) if i != axis)
    if np.cross(first, second) @ normal < 0:
        first, second = second, first
    return _rectangle(corner, first, second)


def outline_strips(outline_m: Array, span_m: tuple[float, float]) -> Array:
    """Sides of an outline drawn out along z; the ends, out of the grains' reach, are left open."""
    if signed_area_m2(outline_m) < 0:
        outline_m = outline_m[::-1]
    up = np.array([0.0, 0.0, span_m[1] - span_m[0]])
    foot = np.column_stack([outline_m, np.full(len(outline_m), span_m[0])])
    sides = [_rectangle(a, b - a, up) for a, b in zip(foot, np.roll(foot, -1, axis=0), strict=True)]
    return np.concatenate(sides)


def _cuboid(block: Block) -> Array:
    edges = 2 * block.half_size_m[:, None] * block.axes
    faces = []
    for i in range(3):
        first, second = edges[(i + 1) % 3], edges[(i + 2) % 3]
        if np.cross(first, second) @ edges[i] < 0:
            first, second = second, first
        corner = block.centre_m - (first + second) / 2
        faces.append(_rectangle(corner + edges[i] / 2, first, second))
        faces.append(_rectangle(corner - edges[i] / 2, second, first))
    return np.concatenate(faces)


def write_stl(path: Path, name: str, triangles_m: Array) -> None:
    """Write triangles as an ASCII STL file, every number exact.

    ``triangles_m``: (n, 3, 3) float64, m.
    """
    normals = np.cross(triangles_m[:, 1] - triangles_m[:, 0], triangles_m[:, 2] - triangles_m[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    lines = [f"solid {name}"]
    for normal, corners in zip(normals.tolist(), triangles_m.tolist(), strict=True):
        lines.append("facet normal {:.6g} {:.6g} {:.6g}".format(*normal))
        lines.append(" outer loop")
        lines += ["  vertex {!r} {!r} {!r}".format(*corner) for corner in corners]
        lines += [" endloop", "endfacet"]
    path.write_text("\n".join([*lines, f"endsolid {name}"]) + "\n", encoding="utf-8")
