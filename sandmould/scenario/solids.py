"""Obstacles of 3D that no flat plates can make: round cylinders and surfaces of triangles."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from sandmould import ROOT
from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.geometry.drawing_file import MeshFileError, file_hash, tells_unit
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.revolved import Revolved
from sandmould.scenario.quantity import PLANNED, Section, quantity

if TYPE_CHECKING:
    from sandmould.geometry.mesh_file import Reading

Array = NDArray[np.float64]
MANY_TRIANGLES = 100_000
"""From here on the plan tells what a surface takes."""
UNITS = {0.001: "mm", 0.0254: "inches", 0.01: "cm", 1.0: "m"}
LOST = 0.04
"""Share of the longest side of its box below which a part may be drawn in another unit."""
READ_S, READ_BYTES = 7e-5, 1300
"""Time and memory a triangle to read, check and merge a surface: 14 s measured at 200 000 on a busy
core, 1.3 GB at 998 000."""


class Cylinder(Section):
    """A solid round cylinder, 3D only."""

    kind: Literal["cylinder"]
    name: str = quantity("cylinder", "Name in tables.", source="user", pattern=r"^[a-z][a-z0-9_]*$")
    centre_m: tuple[float, float, float] = quantity(..., "Centre.", unit="m", source="user")
    axis: Literal["x", "y", "z"] = quantity("z", "Direction of the axis.", source="user")
    diameter_m: float = quantity(..., "Diameter.", unit="m", source="user", gt=0, le=100)
    length_m: float = quantity(..., "Length.", unit="m", source="user", gt=0, le=100)


class NamesFile(Protocol):
    """A section that names a file."""

    @property
    def path(self) -> Path:
        """Where the file lies."""

    @property
    def sha256(self) -> str | None:
        """Hash of the file."""

    def model_copy(self, *, update: Mapping[str, Any]) -> Any:
        """A changed copy."""


Named = TypeVar("Named", bound=NamesFile)


DRAWING_FILE: Any = quantity(
    ...,
    "STL, OBJ, PLY, 3MF or STEP file (.step, .stp). Its path is relative to the file that names "
    "it, in a resolved scenario to the repository.",
    source="user",
    min_length=1,
)
DRAWING_HASH: Any = quantity(
    None,
    "Hash of the file; the plan of a study writes it, so that another drawing is another run.",
    source=PLANNED,
    pattern=r"^[0-9a-f]{64}$",
)
DRAWING_UNIT: Any = quantity(
    1.0,
    "Length that stands for 1 in the file: 0.001 for one drawn in mm. STEP and 3MF files tell "
    "their own unit.",
    unit="m",
    source="user",
    gt=0,
    le=100,
)
"""Keys of whatever is drawn in a file, an obstacle or a pattern."""


class SolidMesh(Section):
    """A solid drawn in a file, 3D only."""

    kind: Literal["mesh"]
    name: str = quantity("mesh", "Name in tables.", source="user", pattern=r"^[a-z][a-z0-9_]*$")
    file: str = DRAWING_FILE
    sha256: str | None = DRAWING_HASH
    unit_m: float = DRAWING_UNIT
    position_m: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "Place of the file's origin in the box.", unit="m", source="user"
    )

    @property
    def path(self) -> Path:
        """Where the file lies."""
        return Path(os.path.normpath(ROOT / self.file))


class Triangles(Section):
    """A solid bounded by triangles given in place, 3D only: so a plan puts a pattern in a scene."""

    kind: Literal["triangles"]
    name: str = quantity(
        "triangles", "Name in tables.", source=PLANNED, pattern=r"^[a-z][a-z0-9_]*$"
    )
    vertices_m: tuple[tuple[float, float, float], ...] = quantity(
        ..., "Vertices.", unit="m", source=PLANNED, min_length=4
    )
    triangles: tuple[tuple[int, int, int], ...] = quantity(
        ...,
        "Vertices of each triangle, counted from 0, counter-clockwise seen from outside.",
        source=PLANNED,
        min_length=4,
    )

    @property
    def solid(self) -> TriangleMesh:
        """Its geometry."""
        return TriangleMesh(self.name, np.array(self.vertices_m), np.array(self.triangles))


def cylinder_solid(cylinder: Cylinder) -> Revolved:
    """Geometry of a cylinder."""
    axis = np.eye(3)["xyz".index(cylinder.axis)]
    return cylinder_along(
        cylinder.name, np.array(cylinder.centre_m), axis, cylinder.diameter_m, cylinder.length_m
    )


def cylinder_along(
    name: str, centre_m: Array, axis: Array, diameter_m: float, length_m: float
) -> Revolved:
    """Geometry of a cylinder about any axis.

    ``centre_m``, ``axis``, (3,) float64: centre, m, and unit vector along the axis.
    """
    half_m, radius_m = length_m / 2, diameter_m / 2
    profile_m = np.array([[-half_m, 0.0], [half_m, 0.0], [half_m, radius_m], [-half_m, radius_m]])
    return Revolved(name, centre_m, axis, profile_m)


class Drawing(NamesFile, Protocol):
    """A section that names a file of a solid, and its unit."""

    @property
    def unit_m(self) -> float:
        """Length that stands for 1 in it."""


def mesh_solid(solid: SolidMesh, key: str) -> TriangleMesh:
    """Geometry of a mesh, scaled and shifted into the box.

    Raises
    ------
    BadInputError
        When the file bounds no solid, or is not the one that the scenario was planned with.
    """
    drawn_m, triangles = drawn_surface(solid, key)
    return TriangleMesh(solid.name, drawn_m + np.array(solid.position_m), triangles)


def drawn_surface(drawing: Drawing, key: str) -> tuple[Array, NDArray[np.int64]]:
    """Closed surface of a drawing about its own origin, scaled.

    Returns
    -------
    vertices_m : (nv, 3) float64, m
    triangles : (nt, 3) int64

    Raises
    ------
    BadInputError
        As :func:`mesh_solid`.
    """
    from sandmould.geometry.mesh_file import read_surface  # slow to import, and few scenes have it

    file_name = display_path(drawing.path)
    if tells_unit(drawing.path) and drawing.unit_m != 1.0:
        valid = "absent, or 1, for a STEP or 3MF file, which tells its own unit"
        raise BadInputError([Problem(f"{key}.unit_m", drawing.unit_m, valid)])
    try:
        sha256_now = file_hash(drawing.path)
        if drawing.sha256 not in (None, sha256_now):
            valid = "the file that the study was planned with; this one has changed since"
            raise MeshFileError(valid)
        vertices, triangles = read_surface(drawing.path)
    except MeshFileError as fault:
        raise BadInputError([Problem(f"{key}.file", file_name, str(fault))]) from fault
    return drawing.unit_m * vertices, triangles


def other_units(drawing: Drawing, size_m: Array, box_m: Array) -> list[tuple[float, str]]:
    """Units in which a drawing fits its box and is not lost in it, other than its own.

    ``size_m``, (3,) float64, m: as read. ``box_m``: (3,) float64, m.
    """
    if tells_unit(drawing.path):
        return []
    sizes = ((unit, unit / drawing.unit_m * size_m) for unit in UNITS if unit != drawing.unit_m)
    least_m = LOST * box_m.max()
    return [(unit, UNITS[unit]) for unit, m in sizes if (m <= box_m).all() and m.max() >= least_m]


def unit_hint(drawing: Drawing, size_m: Array, box_m: Array) -> str:
    """What to say of a drawing far larger than its box: in which unit it fits; else nothing.

    Parameters as of :func:`other_units`.
    """
    fits = other_units(drawing, size_m, box_m) if (size_m > 2.0 * box_m).any() else []
    return "".join(
        f"; with unit_m: {unit:g} it fits: it seems to be drawn in {name}" for unit, name in fits
    )


@dataclass(frozen=True)
class DrawnPart:
    """A drawing as people are told of it."""

    reading: Reading
    now: TriangleMesh
    """The surface that is computed with, in the file's unit."""
    unit_m: float
    other_units: list[tuple[float, str]]
    """Units to ask after, of a drawing that is lost in its box."""
    takes_s: float
    """Time and memory to read it, 0 where they are small."""
    takes_bytes: float

    def size_m(self, unit_m: float | None = None) -> Array:
        """Size in its own unit, or in another, (3,) float64, m."""
        return (unit_m or self.unit_m) * np.ptp(self.now.vertices_m, axis=0)


def drawn_part(drawing: Drawing, box_m: Array) -> DrawnPart:
    """Measure a drawing whose file can be read.

    ``box_m``, (3,) float64, m: size of the box that it stands in.
    """
    from sandmould.geometry.mesh_file import read_drawing  # see drawn_surface

    it = read_drawing(drawing.path)
    size_m = drawing.unit_m * np.ptp(it.vertices, axis=0)
    is_lost = size_m.max() < LOST * box_m.max()
    number = len(it.as_drawn.triangles)
    long = number if number > MANY_TRIANGLES else 0
    return DrawnPart(
        it,
        TriangleMesh("now", it.vertices, it.triangles),
        drawing.unit_m,
        other_units(drawing, size_m, box_m) if is_lost else [],
        READ_S * long,
        READ_BYTES * long,
    )


def with_hash(solid: Named) -> Named:
    """The same section with its file's hash; unchanged if that is given or the file missing."""
    if solid.sha256 is not None:
        return solid
    try:
        copy: Named = solid.model_copy(update={"sha256": file_hash(solid.path)})
    except MeshFileError:
        return solid
    return copy
