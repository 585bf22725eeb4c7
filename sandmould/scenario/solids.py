"""Obstacles of 3D that no flat plates can make: round cylinders and surfaces of triangles."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Protocol, TypeVar

import numpy as np

from sandmould import ROOT
from sandmould.scenario.bad_input import BadInputError, Problem, display_path
from sandmould.scenario.drawing_file import MeshFileError, file_hash
from sandmould.scenario.mesh import TriangleMesh
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.revolved import Array, Revolved


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


class SolidMesh(Section):
    """A solid bounded by the triangles of an STL file, 3D only."""

    kind: Literal["mesh"]
    name: str = quantity("mesh", "Name in tables.", source="user", pattern=r"^[a-z][a-z0-9_]*$")
    file: str = quantity(
        ...,
        "STL file, seen from the file that names it; in a resolved scenario, from the repository.",
        source="user",
        min_length=1,
    )
    sha256: str | None = quantity(
        None,
        "Hash of the file; the plan of a study writes it, so that another mesh is another run.",
        source="user",
        pattern=r"^[0-9a-f]{64}$",
    )
    unit_m: float = quantity(
        1.0,
        "Length that stands for 1 in the file: 0.001 for one drawn in mm.",
        unit="m",
        source="user",
        gt=0,
        le=100,
    )
    angle_deg: float = quantity(
        0.0, "Turn about the vertical through the file's origin.", unit="deg", source="user",
        ge=-360, le=360,
    )  # fmt: skip
    position_m: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "Place of the file's origin in the box.", unit="m", source="user"
    )

    @property
    def path(self) -> Path:
        """Where the file lies."""
        return Path(os.path.normpath(ROOT / self.file))


class Triangles(Section):
    """A solid bounded by triangles given in place, 3D only: a pattern stands in its scene so."""

    kind: Literal["triangles"]
    name: str = quantity(
        "triangles", "Name in tables.", source="user", pattern=r"^[a-z][a-z0-9_]*$"
    )
    vertices_m: tuple[tuple[float, float, float], ...] = quantity(
        ..., "Vertices.", unit="m", source="user", min_length=4
    )
    triangles: tuple[tuple[int, int, int], ...] = quantity(
        ...,
        "Vertices of each triangle, counted from 0, counter-clockwise seen from outside.",
        source="user",
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


def mesh_solid(solid: SolidMesh, key: str) -> TriangleMesh:
    """Geometry of a mesh, turned, scaled and shifted into the box.

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
    from sandmould.scenario.mesh_file import read_surface  # slow to import, and few scenes have it

    file_name = display_path(solid.path)
    try:
        sha256_now = file_hash(solid.path)
        if solid.sha256 not in (None, sha256_now):
            valid = "the file that the study was planned with; this one has changed since"
            raise MeshFileError(valid)
        vertices, triangles = read_surface(solid.path)
    except MeshFileError as fault:
        raise BadInputError([Problem(f"{key}.file", file_name, str(fault))]) from fault
    c, s = math.cos(math.radians(solid.angle_deg)), math.sin(math.radians(solid.angle_deg))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    placed_m = solid.unit_m * vertices @ turn.T + np.array(solid.position_m)
    return TriangleMesh(solid.name, placed_m, triangles)


def filled_note(solid: SolidMesh, key: str) -> str:
    """What to tell of shells that may have been meant as cavities; empty without any.

    Parameters
    ----------
    solid : SolidMesh
        Whose file can be read.
    key : str
        Key path, for the sentence.
    """
    from sandmould.scenario.mesh_file import filled_shells  # see mesh_solid

    count = filled_shells(solid.path)
    if not count:
        return ""
    shells = "1 shell that lies" if count == 1 else f"{count} shells that lie"
    return (
        f"{key} has {shells} in another one with its faces outwards, and is part of the solid "
        "there. A cavity faces inwards."
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
