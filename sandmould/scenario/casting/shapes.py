"""What is cast: parts of a casting, in the plane or in space."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould import ROOT
from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.geometry.drawing_file import MeshFileError, file_hash
from sandmould.geometry.geometry import Block
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline, outline_fault
from sandmould.limits import PIXELS
from sandmould.scenario.quantity import PLANNED, Section, quantity
from sandmould.scenario.solids import SolidMesh, mesh_solid, with_hash

Array = NDArray[np.float64]
Flat = tuple[float, float]
Place = tuple[float, float] | tuple[float, float, float]
GREY = 127
"""Pixels up to it are dark, of 255."""


class Body(Protocol):
    """A solid that tells how far points are from its surface."""

    @property
    def name(self) -> str:
        """What messages call it."""

    def distance_m(self, position_m: Array) -> Array:
        """Signed distance of points, (n,) float64, m; negative inside."""

    def corners(self) -> Array:
        """Points whose hull holds it, (k, d) float64, m."""

    @property
    def measure(self) -> float:
        """Area (m2) in 2D, volume (m3) in 3D."""


class Rectangle(Section):
    """An upright rectangle; with three coordinates a block."""

    kind: Literal["rectangle"] = Field("rectangle", description="Shape.")
    low_m: Place = quantity(..., "Its corner of least coordinates.", unit="m", source="user")
    high_m: Place = quantity(..., "Its corner opposite.", unit="m", source="user")

    @model_validator(mode="after")
    def _order(self) -> Rectangle:
        same = len(self.low_m) == len(self.high_m)
        if not same or not all(a < b for a, b in zip(self.low_m, self.high_m, strict=True)):
            raise PydanticCustomError(
                "corners", "a high_m with as many coordinates as low_m, each beyond its own"
            )
        return self

    @property
    def solid(self) -> Block:
        """Its geometry."""
        low, high = np.array(self.low_m), np.array(self.high_m)
        return Block("the rectangle", 0.5 * (low + high), 0.5 * (high - low), np.eye(len(low)))


class CastOutline(Section):
    """A closed line of straight edges."""

    kind: Literal["polygon"] = Field("polygon", description="Shape.")
    vertices_m: tuple[Flat, ...] = quantity(
        ..., "Corners in turn; the last is joined to the first.", unit="m", source="user",
        min_length=3,
    )  # fmt: skip

    @model_validator(mode="after")
    def _closed(self) -> CastOutline:
        if fault := outline_fault(np.array(self.vertices_m)):
            raise PydanticCustomError("polygon", "{fault}", {"fault": fault})
        return self

    @property
    def solid(self) -> Outline:
        """Its geometry."""
        return Outline("the polygon", np.array(self.vertices_m))


class FourPlates(Section):
    """Plates of several thicknesses that meet at the origin, as in the paper's section 4."""

    kind: Literal["plates"] = Field("plates", description="Shape.")
    reach_m: float = quantity(..., "Of each plate from the origin.", unit="m", source="user", gt=0)
    thickness_m: tuple[float, float, float, float] = quantity(
        ..., "Upwards, to the right, downwards, to the left.", unit="m", source="user"
    )

    @model_validator(mode="after")
    def _plates(self) -> FourPlates:
        if not all(0.0 < t < 2.0 * self.reach_m for t in self.thickness_m):
            raise PydanticCustomError("plates", "thicknesses above 0 and below twice reach_m")
        return self

    @property
    def solid(self) -> Outline:
        """Its geometry."""
        up, right, down, left = (0.5 * t for t in self.thickness_m)
        r = self.reach_m
        corners = [
            (up, right), (up, r), (-up, r), (-up, left), (-r, left), (-r, -left),
            (-down, -left), (-down, -r), (down, -r), (down, -right), (r, -right), (r, right),
        ]  # fmt: skip
        return Outline("plates", np.array(corners))


class CastPicture(Section):
    """The dark pixels of a picture, whose lower left corner is the origin."""

    kind: Literal["image"]
    file: str = quantity(
        ...,
        "Picture. Its path is relative to the file that names it, in a resolved scenario to the "
        "repository.",
        source="user",
        min_length=1,
    )
    sha256: str | None = quantity(
        None,
        "Hash of the file; the plan of a study writes it, so that another one is another run.",
        source=PLANNED,
        pattern=r"^[0-9a-f]{64}$",
    )
    pixel_m: float = quantity(..., "Side of a pixel.", unit="m", source="user", gt=0, le=1)

    @property
    def path(self) -> Path:
        """Where the file lies."""
        return Path(os.path.normpath(ROOT / self.file))


Shape = Annotated[
    Rectangle | CastOutline | FourPlates | SolidMesh | CastPicture, Field(discriminator="kind")
]


@dataclass(frozen=True)
class Pixels:
    """A solid made of squares."""

    name: str
    distance_in_pixels: Array
    """(nx, ny) float64: from each pixel's centre to the nearest edge between pixels, negative
    inside."""
    pixel_m: float
    low_m: Array

    def distance_m(self, position_m: Array) -> Array:
        """Signed distance of points, to half a pixel; beyond the picture they are outside."""
        place = np.floor((position_m - self.low_m) / self.pixel_m).astype(np.int64)
        shape = np.array(self.distance_in_pixels.shape)
        inside = ((place >= 0) & (place < shape)).all(axis=1)
        distance = np.full(len(place), float(shape.max()))
        distance[inside] = self.distance_in_pixels[tuple(place[inside].T)]
        return self.pixel_m * distance

    @property
    def measure(self) -> float:
        """Area of the dark pixels, m2."""
        return float((self.distance_in_pixels < 0.0).sum()) * self.pixel_m**2

    def corners(self) -> Array:
        """Two corners of the rectangle round the solid's pixels."""
        pixels = np.argwhere(self.distance_in_pixels < 0.0)
        extent = np.stack([pixels.min(axis=0), pixels.max(axis=0) + 1])
        return np.asarray(self.low_m + extent * self.pixel_m)


def solid_of(shape: Any, key: str) -> Body:
    """Geometry of a shape.

    ``key``: key path of the shape, for messages.

    Raises
    ------
    BadInputError
        When a file cannot be read, bounds no solid or has changed since the plan.
    """
    if isinstance(shape, SolidMesh):
        return mesh_solid(shape, key)
    if isinstance(shape, CastPicture):
        return _picture_solid(shape, key)
    solid: Body = shape.solid
    return solid


def held_by(body: Body, position_m: Array) -> NDArray[np.bool_]:
    """Which points a body holds, (n,) bool; ``position_m`` is (n, d) float64, m.

    A mesh counts how often it goes round each point, which costs a fortieth of a distance.
    """
    if isinstance(body, TriangleMesh):
        return body.holds(position_m)
    return np.asarray(body.distance_m(position_m) < 0.0)


def with_file_hash(shape: Any) -> Any:
    """The shape with the hash of its file, if it has one."""
    return with_hash(shape) if isinstance(shape, SolidMesh | CastPicture) else shape


def _picture_solid(shape: CastPicture, key: str) -> Pixels:
    try:
        sha256_now = file_hash(shape.path)
        if shape.sha256 not in (None, sha256_now):
            raise MeshFileError("the picture that the study was planned with; it has changed since")
        distance = _read_picture(shape.path, sha256_now)
    except MeshFileError as fault:
        problem = Problem(f"{key}.file", display_path(shape.path), str(fault))
        raise BadInputError([problem]) from fault
    return Pixels("the picture", distance, shape.pixel_m, np.zeros(2))


@lru_cache(maxsize=8)
def _read_picture(path: Path, sha256: str) -> Array:
    """Read a picture once for each state of its file."""
    from PIL import Image, UnidentifiedImageError
    from scipy.ndimage import distance_transform_edt

    of_library, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None  # ours is told below
    try:
        picture = Image.open(path)
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise MeshFileError("a picture, such as a PNG file") from error
    finally:
        Image.MAX_IMAGE_PIXELS = of_library
    with picture:
        pixels = picture.width * picture.height
        if pixels > PIXELS.most:
            raise MeshFileError(f"a picture {PIXELS.sentence(pixels)}")
        white = Image.new("RGBA", picture.size, "white")  # shows where it is transparent
        try:
            rows = np.asarray(Image.alpha_composite(white, picture.convert("RGBA")).convert("L"))
        except (OSError, SyntaxError, ValueError) as error:
            raise MeshFileError("a picture, such as a PNG file") from error
    dark = (rows <= GREY)[::-1].T
    if dark.all() or not dark.any():
        raise MeshFileError("a picture with dark pixels for the casting and light ones beside them")
    outside, inside = distance_transform_edt(~dark), distance_transform_edt(dark)
    return np.where(dark, 0.5 - inside, outside - 0.5)
