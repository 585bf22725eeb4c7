"""Obstacles of 3D that no flat plates can make: round cylinders and surfaces of triangles."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from sandmould import ROOT
from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.geometry.drawing_file import MeshFileError, file_hash
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesher import is_step
from sandmould.geometry.revolved import Revolved
from sandmould.scenario.quantity import PLANNED, Section, quantity

Array = NDArray[np.float64]
MANY_TRIANGLES = 100_000
"""From here on the plan tells what a surface takes."""
READ_S, READ_BYTES = 4e-5, 1300
"""Time and memory a triangle to read and check a surface: 41 s and 1.3 GB measured at 998 000."""


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
    "STL or STEP file (.step, .stp). Its path is relative to the file that names it, in a "
    "resolved scenario to the repository.",
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
    "Length that stands for 1 in an STL file: 0.001 for one drawn in mm. A STEP file tells its "
    "own unit.",
    unit="m",
    source="user",
    gt=0,
    le=100,
)
"""Keys of whatever is drawn in a file, an obstacle or a pattern."""


class SolidMesh(Section):
    """A solid drawn in an STL or STEP file, 3D only."""

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

    Parameters
    ----------
    name : str
    centre_m, axis : (3,) float64
        Centre, m, and unit vector along the axis.
    diameter_m, length_m : float, m
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

    Parameters
    ----------
    solid : SolidMesh
    key : str
        Key path of the obstacle, for messages.

    Raises
    ------
    BadInputError
        When the file bounds no solid, or is not the one that the scenario was planned with.
    """
    drawn_m, triangles = drawn_surface(solid, key)
    return TriangleMesh(solid.name, drawn_m + np.array(solid.position_m), triangles)


def drawn_surface(drawing: Drawing, key: str) -> tuple[Array, NDArray[np.int64]]:
    """Closed surface of a drawing about its own origin, scaled.

    Parameters
    ----------
    drawing : Drawing
    key : str
        Key path of its section, for messages.

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
    if is_step(drawing.path) and drawing.unit_m != 1.0:
        valid = "absent, or 1, for a STEP file, which tells its own unit"
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


def unit_hint(size_m: Array, box_m: Array, unit_m: float) -> str:
    """What to say of a drawing far larger than its box: that it may be in mm; else nothing.

    Parameters
    ----------
    size_m : (3,) float64, m
        Of the drawing, as read.
    box_m : (3,) float64, m
    unit_m : float, m
        That it was read with.
    """
    if unit_m == 1.0 and (size_m > 10.0 * box_m).any() and (1e-3 * size_m <= box_m).all():
        return "; with unit_m: 0.001 it fits: it seems to be drawn in mm"
    return ""


def drawing_notes(drawing: Drawing, key: str) -> list[str]:
    """What was repaired in a drawing, may have been meant otherwise, or takes long to read.

    Parameters
    ----------
    drawing : Drawing
        Whose file can be read.
    key : str
        Key path, for the sentences.
    """
    from sandmould.geometry.mesh_file import read_surface, repairs  # see drawn_surface

    done, triangles = repairs(drawing.path), len(read_surface(drawing.path)[1])
    said = []
    if done.filled_shells:
        count = done.filled_shells
        shells = "1 shell that lies" if count == 1 else f"{count} shells that lie"
        said.append(
            f"{key} has {shells} in another one with its faces outwards, and is part of the solid "
            "there. A cavity faces inwards."
        )
    if done.turned_triangles:
        said.append(
            f"{key} had {done.turned_triangles} triangles turned inside out. They were turned "
            "round: their surface has no solid on its other side."
        )
    if triangles > MANY_TRIANGLES:
        said.append(
            f"{key} has {triangles:,} triangles: every process of the study takes about "
            f"{READ_S * triangles:.0f} s and {1e-6 * READ_BYTES * triangles:,.0f} MB to read them. "
            "A coarser surface does as well where its triangles are far smaller than grains."
        )
    return said


def with_hash(solid: Named) -> Named:
    """The same section with its file's hash; unchanged if that is given or the file missing."""
    if solid.sha256 is not None:
        return solid
    try:
        copy: Named = solid.model_copy(update={"sha256": file_hash(solid.path)})
    except MeshFileError:
        return solid
    return copy
