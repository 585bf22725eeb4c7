"""The moulding box and the obstacles in it, and their geometry."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from sandmould.geometry.geometry import Array, Block, Bore, Scene, Wall
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline, signed_area_m2
from sandmould.geometry.revolved import Revolved
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED
from sandmould.scenario.solids import Cylinder, SolidMesh, Triangles, cylinder_solid, mesh_solid


class Piston(Section):
    """A wall of the box that moves evenly into the sand once it is filled in, and stays there.

    The top is a lid that is put on the box, at its height, when it begins to move.
    """

    wall: Literal["top", "floor", "left", "right", "front", "back"] = quantity(
        ..., "Wall that moves; front and back in 3D.", source="user"
    )
    velocity_m_s: float = quantity(
        ..., "Velocity into the box; below 0 out of it.", unit="m/s", source="user", ge=-10, le=10
    )
    duration_s: float = quantity(..., "How long it moves.", unit="s", source="user", gt=0, le=1000)

    @property
    def way_m(self) -> float:
        """How far it goes into the box."""
        return self.velocity_m_s * self.duration_s

    @property
    def axis(self) -> int:
        """Axis that it moves along: x, y of 3D or the vertical, -1."""
        return {"left": 0, "right": 0, "front": 1, "back": 1}.get(self.wall, -1)


class Box(Section):
    """Inner size of the moulding box; its walls also guide the sand that falls from above."""

    width_m: float = quantity(0.1, "Inner width along x.", unit="m", source=ARGUED, gt=0, le=100)
    depth_m: float = quantity(
        0.05, "Inner depth along y, 3D only.", unit="m", source=ARGUED, gt=0, le=100
    )
    height_m: float = quantity(0.1, "Inner height.", unit="m", source=ARGUED, gt=0, le=100)

    def size_m(self, dimension: int) -> tuple[float, ...]:
        """Width and height in 2D; width, depth and height in 3D."""
        middle = (self.depth_m,) if dimension == 3 else ()
        return (self.width_m, *middle, self.height_m)

    def size_text(self, dimension: int) -> str:
        """The same in words, for messages."""
        return f"{' x '.join(f'{size:g}' for size in self.size_m(dimension))} m"

    def holds(self, points_m: Array, dimension: int, slack: float = 1e-9) -> bool:
        """Whether points lie in the box, or out of it by no more than a share of its size.

        ``points_m``: (n, d) float64, m.
        """
        size_m = np.array(self.size_m(dimension))
        slack_m = slack * size_m.max()
        return bool((points_m >= -slack_m).all() and (points_m <= size_m + slack_m).all())


class Plate(Section):
    """A solid rectangle (2D) or cuboid (3D)."""

    kind: Literal["plate"]
    name: str = quantity("plate", "Name in tables.", source="user", pattern=r"^[a-z][a-z0-9_]*$")
    centre_m: tuple[float, ...] = quantity(
        ...,
        "Centre, one number per dimension.",
        unit="m",
        source="user",
        min_length=2,
        max_length=3,
    )
    size_m: tuple[Annotated[float, Field(gt=0)], ...] = quantity(
        ..., "Edge lengths, one a dimension.", unit="m", source="user", min_length=2, max_length=3
    )
    angle_deg: float = quantity(
        0.0, "Turn in the plane of x and the vertical.", unit="deg", source="user", ge=-180, le=180
    )

    @property
    def is_level(self) -> bool:
        """Whether it lies, as a floor does, rather than stands."""
        return self.size_m[-1] < min(self.size_m[:-1])


class Tube(Section):
    """A straight horizontal tube along x: two plates in 2D, flat facets or round in 3D.

    In 3D it lies in the middle of the box's depth.
    """

    kind: Literal["tube"]
    name: str = quantity("tube", "Name in tables.", source="user", pattern=r"^[a-z][a-z0-9_]*$")
    diameter_m: float = quantity(
        ...,
        "Inner diameter; with facets that of the circle with the area of the prism's bore.",
        unit="m",
        source="user",
        gt=0,
        le=100,
    )
    length_m: float = quantity(..., "Inner length.", unit="m", source="user", gt=0, le=100)
    wall_thickness_m: float = quantity(
        0.003, "Thickness of the tube's wall.", unit="m", source=ARGUED, gt=0, le=100
    )
    left_end_x_m: float = quantity(..., "x of the tube's left end.", unit="m", source="user", ge=0)
    axis_height_m: float = quantity(..., "Height of the axis.", unit="m", source="user", gt=0)
    closed_end: Literal["none", "left", "right"] = quantity(
        "right", "Which end is closed; the mouth is the other one.", source=ARGUED
    )
    section: Literal["facets", "round"] = quantity(
        "facets", "Section of the tube in 3D: a regular polygon or a circle.", source=ARGUED
    )
    facets: int = quantity(
        8, "Number of flat facets of the tube in 3D, unless it is round.", source=ARGUED,
        ge=3, le=64,
    )  # fmt: skip

    @property
    def right_end_x_m(self) -> float:
        """Right end of the bore, x."""
        return self.left_end_x_m + self.length_m


class Polygon(Section):
    """A solid outlined by straight edges, 2D only."""

    kind: Literal["polygon"]
    name: str = quantity("polygon", "Name in tables.", source="user", pattern=r"^[a-z][a-z0-9_]*$")
    vertices_m: tuple[tuple[float, float], ...] = quantity(
        ..., "Vertices in turn, either way round.", unit="m", source="user", min_length=3
    )


AnyObstacle = Plate | Tube | Polygon | Cylinder | SolidMesh | Triangles
Obstacle = Annotated[AnyObstacle, Field(discriminator="kind")]
ROUND_BORE_SIDES = 64
"""Sides of the polygon that stands for a round bore in measures. It has the circle's area and lies
within 1e-3 of its radius from it: a grain at the wall, a fifth as large, loses 3e-6 of its part."""


def _turn(angle_deg: float, dimension: int) -> Array:
    """Axes turned by an angle in the plane of x and the vertical, one a row."""
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    axes = np.eye(dimension)
    axes[0, 0], axes[0, -1], axes[-1, 0], axes[-1, -1] = c, s, -s, c
    return axes


def plate_blocks(plate: Plate, dimension: int) -> list[Block]:
    """Geometry of a plate."""
    half = np.array(plate.size_m) / 2
    return [Block(plate.name, np.array(plate.centre_m), half, _turn(plate.angle_deg, dimension))]


def _tube_axis_point(tube: Tube, box: Box, dimension: int) -> Array:
    if dimension == 2:
        return np.array([0.0, tube.axis_height_m])
    return np.array([0.0, box.depth_m / 2, tube.axis_height_m])


def polygon_outline(polygon: Polygon) -> Outline:
    """Geometry of a polygon, counter-clockwise."""
    vertices_m = np.array(polygon.vertices_m)
    if signed_area_m2(vertices_m) < 0.0:
        vertices_m = vertices_m[::-1]
    return Outline(polygon.name, vertices_m)


def facet_apothem_m(tube: Tube) -> float:
    """Distance of a facet from the axis so that the bore has the circle's area.

    A regular n-gon with apothem h has the area n h^2 tan(pi/n).
    """
    circle = math.pi / 4 * tube.diameter_m**2
    sides = _bore_sides(tube)
    return math.sqrt(circle / (sides * math.tan(math.pi / sides)))


def _bore_sides(tube: Tube) -> int:
    return tube.facets if tube.section == "facets" else ROUND_BORE_SIDES


def _closing_x_m(tube: Tube, box: Box) -> float | None:
    """Where a tube needs an end of its own: x of its closed end, unless the box wall closes it."""
    x = {"left": tube.left_end_x_m, "right": tube.right_end_x_m}.get(tube.closed_end)
    return None if x is None or x <= 0 or x >= box.width_m * (1 - 1e-9) else x


def tube_blocks(tube: Tube, box: Box, dimension: int) -> list[Block]:
    """Geometry of a tube: its walls, and an end plate unless the box wall closes it."""
    half_length, half_wall = tube.length_m / 2, tube.wall_thickness_m / 2
    axis = _tube_axis_point(tube, box, dimension)
    middle = axis + np.eye(dimension)[0] * (tube.left_end_x_m + half_length)
    blocks = []
    if dimension == 2:
        across = (tube.diameter_m + tube.wall_thickness_m) / 2
        for name, side in (("lower", -1.0), ("upper", 1.0)):
            centre = middle + np.array([0.0, side * across])
            half = np.array([half_length, half_wall])
            blocks.append(Block(f"{tube.name}_{name}", centre, half, np.eye(2)))
        end_half = np.array([half_wall, tube.diameter_m / 2 + tube.wall_thickness_m])
    else:
        apothem = facet_apothem_m(tube)
        outer = apothem + tube.wall_thickness_m
        half_width = outer * math.tan(math.pi / tube.facets)
        for i in range(tube.facets):
            angle = 2 * math.pi * (i + 0.5) / tube.facets
            outward = np.array([0.0, math.cos(angle), math.sin(angle)])
            along = np.array([0.0, -math.sin(angle), math.cos(angle)])
            axes = np.array([[1.0, 0.0, 0.0], outward, along])
            half = np.array([half_length, half_wall, half_width])
            centre = middle + outward * (apothem + half_wall)
            blocks.append(Block(f"{tube.name}_{i + 1:02d}", centre, half, axes))
        end_half = np.array([half_wall, outer, outer])
    closing_x = _closing_x_m(tube, box)
    if closing_x is not None:
        side = -1.0 if tube.closed_end == "left" else 1.0
        centre = axis + np.eye(dimension)[0] * (closing_x + side * half_wall)
        blocks.append(Block(f"{tube.name}_end", centre, end_half, np.eye(dimension)))
    return blocks


def tube_wall(tube: Tube, box: Box) -> Revolved:
    """Geometry of a round tube in 3D: its wall, and an end unless the box wall closes it."""
    inner_m, length_m, wall_m = tube.diameter_m / 2, tube.length_m, tube.wall_thickness_m
    outer_m = inner_m + wall_m
    if _closing_x_m(tube, box) is None:
        profile = [[0.0, inner_m], [length_m, inner_m], [length_m, outer_m], [0.0, outer_m]]
    else:
        # closed on the left and turned round for the other side, which keeps the sense of rotation
        profile = [[-wall_m, 0.0], [0.0, 0.0], [0.0, inner_m], [length_m, inner_m],
                   [length_m, outer_m], [-wall_m, outer_m]]  # fmt: skip
    from_left = tube.closed_end == "left"
    origin = _tube_axis_point(tube, box, 3)
    origin[0] = tube.left_end_x_m if from_left else tube.right_end_x_m
    axis = np.array([1.0 if from_left else -1.0, 0.0, 0.0])
    return Revolved(tube.name, origin, axis, np.array(profile))


def tube_bore(tube: Tube, box: Box, dimension: int) -> Bore:
    """The tube's cavity, from its mouth (the left end unless that is closed)."""
    from_right = tube.closed_end == "left"
    mouth = _tube_axis_point(tube, box, dimension)
    mouth[0] = tube.right_end_x_m if from_right else tube.left_end_x_m
    axis = np.eye(dimension)[0] * (-1.0 if from_right else 1.0)
    if dimension == 2:
        section = np.array([[-tube.diameter_m / 2], [tube.diameter_m / 2]])
    else:
        sides = _bore_sides(tube)
        corner = facet_apothem_m(tube) / math.cos(math.pi / sides)
        angles = 2 * math.pi * np.arange(sides) / sides
        section = corner * np.column_stack([np.cos(angles), np.sin(angles)])
    return Bore(tube.name, mouth, axis, tube.length_m, np.eye(dimension)[1:], section)


def box_walls(box: Box, dimension: int) -> list[Wall]:
    """Floor and side walls, normals pointing into the sand."""
    unit = np.eye(dimension)
    walls = [
        Wall("floor", np.zeros(dimension), unit[-1]),
        Wall("left", np.zeros(dimension), unit[0]),
        Wall("right", unit[0] * box.width_m, -unit[0]),
    ]
    if dimension == 3:
        walls += [
            Wall("front", np.zeros(3), unit[1]),
            Wall("back", unit[1] * box.depth_m, -unit[1]),
        ]
    return walls


def piston_wall(piston: Piston, box: Box, dimension: int, way_m: float) -> Wall:
    """The wall that moves as a piston, once it has gone a way."""
    up = np.eye(dimension)[-1]
    walls = [*box_walls(box, dimension), Wall("top", up * box.height_m, -up)]
    (wall,) = (wall for wall in walls if wall.name == piston.wall)
    return replace(wall, point_m=wall.point_m + way_m * wall.normal)


def build_scene(box: Box, obstacles: tuple[AnyObstacle, ...], dimension: int) -> Scene:
    """Geometry of a box with all that stands in it.

    Raises
    ------
    BadInputError
        When the file of a mesh bounds no solid.
    """
    blocks: list[Block] = []
    bores: list[Bore] = []
    outlines: list[Outline] = []
    meshes: list[TriangleMesh] = []
    revolved: list[Revolved] = []
    for i, obstacle in enumerate(obstacles):
        if isinstance(obstacle, Plate):
            blocks += plate_blocks(obstacle, dimension)
        elif isinstance(obstacle, Tube):
            bores.append(tube_bore(obstacle, box, dimension))
            if dimension == 3 and obstacle.section == "round":
                revolved.append(tube_wall(obstacle, box))
            else:
                blocks += tube_blocks(obstacle, box, dimension)
        elif isinstance(obstacle, Polygon):
            outlines.append(polygon_outline(obstacle))
        elif isinstance(obstacle, Cylinder):
            revolved.append(cylinder_solid(obstacle))
        elif isinstance(obstacle, Triangles):
            meshes.append(obstacle.solid)
        else:
            meshes.append(mesh_solid(obstacle, f"obstacles.{i}"))
    return Scene(
        dimension,
        tuple(box_walls(box, dimension)),
        tuple(blocks),
        tuple(bores),
        tuple(outlines),
        tuple(meshes),
        tuple(revolved),
    )
