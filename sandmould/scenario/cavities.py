"""Cavities: spaces that the sand should fill, named by the user, open in any direction.

A cavity bounds nothing: what stands round it is an obstacle of its own. Points of a regular grid
over one tell how it is filled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from sandmould.bad_input import BadInputError, Problem
from sandmould.geometry.geometry import Array, Cavity
from sandmould.scenario.box import Plate, Polygon, plate_blocks, polygon_outline
from sandmould.scenario.quantity import NAME, Section, quantity
from sandmould.scenario.sand import ARGUED
from sandmould.scenario.solids import SolidMesh, cylinder_along, mesh_solid

Side = Literal["up", "down", "left", "right", "front", "back"]
_SIDES = {"left": (0, -1.0), "right": (0, 1.0), "front": (1, -1.0), "back": (1, 1.0),
          "down": (-1, -1.0), "up": (-1, 1.0)}  # fmt: skip
"""Axis and sign of each side; front and back are those of the box in 3D."""
_NAME_MEANING = "Name in tables."


class BoxCavity(Section):
    """A rectangle (2D) or cuboid (3D) that the sand should fill."""

    kind: Literal["box"]
    name: str = quantity(..., _NAME_MEANING, source="user", pattern=NAME)
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
    opens: Side = quantity("up", "Side that it is open at; front and back in 3D.", source=ARGUED)


class PolygonCavity(Section):
    """A space outlined by straight edges that the sand should fill, 2D only."""

    kind: Literal["polygon"]
    name: str = quantity(..., _NAME_MEANING, source="user", pattern=NAME)
    vertices_m: tuple[tuple[float, float], ...] = quantity(
        ..., "Vertices in turn, either way round.", unit="m", source="user", min_length=3
    )
    opens: Side | tuple[float, float] = quantity(
        "up", "Direction that it is open to, a side or two numbers.", source=ARGUED
    )


class CylinderCavity(Section):
    """A round space that the sand should fill, open at one of its flat ends, 3D only."""

    kind: Literal["cylinder"]
    name: str = quantity(..., _NAME_MEANING, source="user", pattern=NAME)
    centre_m: tuple[float, float, float] = quantity(..., "Centre.", unit="m", source="user")
    diameter_m: float = quantity(..., "Diameter.", unit="m", source="user", gt=0, le=100)
    length_m: float = quantity(..., "Length.", unit="m", source="user", gt=0, le=100)
    opens: Side | tuple[float, float, float] = quantity(
        "up", "Direction of its axis towards the open end, a side or three numbers.", source=ARGUED
    )


class MeshCavity(SolidMesh):
    """A space bounded by the triangles of a closed STL file that the sand should fill, 3D only."""

    name: str = quantity(..., _NAME_MEANING, source="user", pattern=NAME)
    hollow: int | None = quantity(
        None,
        "Where the file is that of the part: which of its hollows, counted from the largest. "
        "A hollow is what its convex hull holds and the part does not.",
        source="user",
        ge=1,
    )
    opens: Side | tuple[float, float, float] = quantity(
        "up", "Direction that it is open to in the box, a side or three numbers.", source=ARGUED
    )


AnyCavity = BoxCavity | PolygonCavity | CylinderCavity | MeshCavity
CavityKey = Annotated[AnyCavity, Field(discriminator="kind")]
CAVITY_KINDS = {2: ("box", "polygon"), 3: ("box", "cylinder", "mesh")}
"""Kinds of cavities that a dimension has."""


def inward(cavity: AnyCavity, dimension: int, key: str) -> Array:
    """Unit vector from the side that a cavity opens to into it, (d,) float64.

    Raises
    ------
    BadInputError
        When the dimension has no such side, or the numbers are no direction.
    """
    opens = cavity.opens
    if isinstance(opens, str) and (dimension == 3 or opens not in ("front", "back")):
        axis, sign = _SIDES[opens]
        vector = np.zeros(dimension)
        vector[axis] = -sign
        return vector
    if not isinstance(opens, str) and any(opens):
        return -np.array(opens) / math.hypot(*opens)
    sides = "up, down, left or right" if dimension == 2 else "a side"
    numbers = "" if isinstance(cavity, BoxCavity) else ", or numbers that are not all 0"
    stated = opens if isinstance(opens, str) else list(opens)
    raise BadInputError([Problem(f"{key}.opens", stated, f"{sides}{numbers}")])


def cavity_space(cavity: AnyCavity, dimension: int, key: str) -> Cavity:
    """Geometry of a cavity whose keys go together.

    Raises
    ------
    BadInputError
        When it opens to no side, or the file of a mesh bounds no space.
    """
    into = inward(cavity, dimension, key)
    if isinstance(cavity, BoxCavity):
        plate = Plate(kind="plate", **cavity.model_dump(exclude={"kind", "opens"}))
        (block,) = plate_blocks(plate, dimension)
        return Cavity(cavity.name, block, into)
    if isinstance(cavity, PolygonCavity):
        polygon = Polygon(kind="polygon", name=cavity.name, vertices_m=cavity.vertices_m)
        return Cavity(cavity.name, polygon_outline(polygon), into)
    if isinstance(cavity, CylinderCavity):
        size_m = (cavity.diameter_m, cavity.length_m)
        rod = cylinder_along(cavity.name, np.array(cavity.centre_m), into, *size_m)
        return Cavity(cavity.name, rod, into)
    drawn = mesh_solid(cavity, key)
    if cavity.hollow is not None:
        from sandmould.scenario.hollows import hollow_of  # slow to import, and few scenes have it

        drawn = hollow_of(drawn, cavity.hollow, key)
    return Cavity(cavity.name, drawn, into)


CELLS_A_GRAIN = {2: 16, 3: 8}
"""Cells along a grain's diameter, by dimension."""


@dataclass(frozen=True)
class CavityGrid:
    """Centres of equal cells that fill the box round a cavity."""

    spacing_m: Array
    """(d,) float64, m: edges of a cell, nearly equal."""
    points_m: Array
    """(..., d) float64, m: one axis of the grid a dimension."""
    inside_m: Array
    """(...) float64, m: distance of each from the cavity's border, positive inside."""


def cavity_grid(
    cavity: Cavity, spacing_m: float, most_points: int, margin_m: float = 0.0
) -> CavityGrid:
    """Lay a grid over a cavity.

    ``spacing_m``: longest edge of a cell; longer where there would be too many. ``margin_m``: how
    far the grid goes beyond the box round the cavity.
    """
    corners_m = cavity.space.corners()
    low_m = corners_m.min(axis=0) - margin_m
    size_m = corners_m.max(axis=0) + margin_m - low_m
    widest_m = max(spacing_m, float(np.prod(size_m) / most_points) ** (1 / len(size_m)))
    count = np.maximum(1, np.ceil(size_m / widest_m * (1.0 - 1e-9))).astype(np.int64)
    cell_m = size_m / count
    axes_m = [
        low + cell * (np.arange(n) + 0.5) for low, cell, n in zip(low_m, cell_m, count, strict=True)
    ]
    points_m = np.stack(np.meshgrid(*axes_m, indexing="ij"), axis=-1)
    inside_m = -cavity.space.distance_m(points_m.reshape(-1, len(size_m)))
    return CavityGrid(cell_m, points_m, inside_m.reshape(points_m.shape[:-1]))


def drawn_inside(cavity: Cavity, number: int) -> Array:
    """Places in a cavity, of so many drawn at random in the box round it, (n, d) float64, m.

    A grid lies on facets, or beside them, all along.
    """
    corners_m = cavity.space.corners()
    low_m, high_m = corners_m.min(axis=0), corners_m.max(axis=0)
    drawn_m = np.random.default_rng(0).uniform(low_m, high_m, (number, len(low_m)))
    return drawn_m[cavity.space.distance_m(drawn_m) < 0.0]
