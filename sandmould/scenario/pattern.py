"""The foam pattern: its shape, its foam, how it is held and how sand and pattern are coupled."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sandmould import ROOT
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED
from sandmould.scenario.solids import DRAWING_FILE, DRAWING_HASH, DRAWING_UNIT

ROJEK = "Rojek 2004, section 4.3"
TOO_SOFT = (
    "a part that bends so far may be too soft for this sand without support: support it, or pour "
    "thinner layers"
)
"""What is likely where a coupled pattern runs away."""


def _length(description: str) -> float:
    """Declare a length that the user gives."""
    length: float = quantity(..., description, unit="m", source="user", gt=0, le=100)
    return length


class Bar(Section):
    """A rectangle."""

    kind: Literal["bar"]
    width_m: float = _length("Width.")
    height_m: float = _length("Height.")


class LShape(Section):
    """A stem with a flange at its top, reaching to the right."""

    kind: Literal["l_shape"]
    thickness_m: float = _length("Thickness of stem and flange.")
    height_m: float = _length("From the foot to the top of the flange.")
    reach_m: float = _length("From the back of the stem to the tip of the flange.")


class MeshFile(Section):
    """A mesh that meshio reads: triangles or quadrilaterals, in 3D tetrahedra or hexahedra."""

    kind: Literal["file"]
    file: str = quantity(
        ...,
        "Mesh file. Its path is relative to the file that names it, in a resolved scenario to the "
        "repository.",
        source="user",
        min_length=1,
    )
    sha256: str | None = DRAWING_HASH
    unit_m: float = quantity(
        1.0, "Length that stands for 1 in the file.", unit="m", source="user", gt=0, le=100
    )

    @property
    def path(self) -> Path:
        """Where the file lies."""
        return Path(os.path.normpath(ROOT / self.file))


class PatternDrawing(Section):
    """A solid drawn in a file, 3D only; Gmsh fills it with tetrahedra."""

    kind: Literal["drawing"]
    file: str = DRAWING_FILE
    sha256: str | None = DRAWING_HASH
    unit_m: float = DRAWING_UNIT

    @property
    def path(self) -> Path:
        """Where the file lies."""
        return Path(os.path.normpath(ROOT / self.file))


Shape = Annotated[Bar | LShape | MeshFile | PatternDrawing, Field(discriminator="kind")]


class Hung(Section):
    """A box in which a pattern is held, as its gating holds it."""

    low_m: tuple[float, ...] = quantity(
        ..., "Corner with the least coordinates, in the moulding box, one number per dimension.",
        unit="m", source="user", min_length=2, max_length=3,
    )  # fmt: skip
    high_m: tuple[float, ...] = quantity(
        ..., "Corner with the greatest coordinates.", unit="m", source="user",
        min_length=2, max_length=3,
    )  # fmt: skip


class SupportsConfig(Section):
    """What holds the pattern: left, right, bottom, top, front, back, or groups of a mesh file.

    Its bottom is clamped unless it is hung, bedded or free.
    """

    clamped: tuple[str, ...] = quantity(("bottom",), "Boundaries that do not move.", source=ARGUED)
    resting: tuple[str, ...] = quantity(
        (), "Flat boundaries that slide without friction and do not lift.", source=ARGUED
    )
    hung: tuple[Hung, ...] | None = quantity(
        None, "Boxes round the gating that the pattern hangs from: what of it lies in one does not "
        "move.", source=ARGUED,
    )  # fmt: skip
    bedding_n_m3: float | None = quantity(
        None, "Springs all over the surface, a plain model of sand that holds it (Winkler).",
        unit="N/m3", source=ARGUED, gt=0, le=1e12,
    )  # fmt: skip
    free: bool | None = quantity(
        None, "Whether sand alone holds it, floor and walls but for it; in_step only.",
        source=ARGUED,
    )  # fmt: skip

    @model_validator(mode="after")
    def _clamps_no_more(self) -> SupportsConfig:
        """Take the clamped bottom away where something else is told to hold the pattern."""
        holds_otherwise = self.hung or self.bedding_n_m3 is not None or self.free
        if holds_otherwise and "clamped" not in self.model_fields_set:
            # A section never changes once read; this is its reading.
            object.__setattr__(self, "clamped", ())
        return self


Scheme = Literal[
    "one_way",
    "per_layer",
    "fixed",
    "measured",
    "aitken",
    "quasi_newton",
    "in_step",
    "monolithic",
]


class Loop(Section):
    """The staggered loop: in each window sand moves under a moving surface, then the pattern."""

    window_s: float = quantity(
        0.0025, "Length of a window; rounded so that a check holds whole ones.", unit="s",
        source=ARGUED, gt=0, le=1,
    )  # fmt: skip
    scheme: Scheme = quantity(
        "aitken",
        "How the pattern follows the loads of the sand. one_way: it bends, but the sand does not "
        "feel it. per_layer: one solve after each layer or stage, with a fixed share. fixed: one "
        "solve a window, with a fixed share. measured: the same with a share of the limit that a "
        "measured gain sets; not on LIGGGHTS. aitken: the same with Aitken's share. quasi_newton: "
        "a quasi-Newton step over the last windows (IQN-ILS); it needs repeats above 0, so not on "
        "LIGGGHTS. in_step: without windows; the pattern, condensed on its surface, is stepped "
        "inside every step of the engine. monolithic: without windows; all of it is stepped after "
        "every step of the grains. That is slow, on engine reference only, and serves for "
        "comparison.",
        source=ARGUED,
    )
    factor: float = quantity(
        0.02, "The fixed share, or that of the first window.", source=ARGUED, gt=0, le=1
    )
    least_factor: float = quantity(
        0.0005, "Least share of Aitken's or measured.", source=ARGUED, gt=0, le=1
    )
    most_factor: float = quantity(
        0.5, "Greatest share of Aitken's or measured.", source=ARGUED, gt=0, le=1
    )
    repeats: int = quantity(
        12, "Times that a window is computed again at most; 0 on LIGGGHTS.", source=ARGUED,
        ge=0, le=100,
    )  # fmt: skip
    tolerance: float = quantity(
        0.03, "Residual over displacement below which no window is repeated.", source=ARGUED,
        gt=0, lt=1,
    )  # fmt: skip
    mass_scale: float | None = quantity(
        None,
        "Factor of the pattern's masses in the schemes monolithic and in_step. Unless given, it "
        "is just large enough for the step of the grains and for their contacts.",
        source=ARGUED, gt=0,
    )  # fmt: skip
    damping_ratio: float = quantity(
        0.5, "Damping of the pattern's slowest mode in these two schemes, by mass damping.",
        source=ARGUED, ge=0, le=10,
    )  # fmt: skip
    largest_displacement_m: float = quantity(
        0.05, "Displacement beyond which the loop has diverged.", unit="m", source=ARGUED, gt=0
    )

    @property
    def has_windows(self) -> bool:
        """Whether sand and pattern take turns; otherwise the pattern moves in every step."""
        return self.scheme not in ("in_step", "monolithic")

    @property
    def most_passes(self) -> int:
        """Times that a window is computed at most: once where its own loads move no surface."""
        feeds_back = self.has_windows and self.scheme not in ("one_way", "per_layer")
        return 1 + self.repeats if feeds_back else 1


class Placed(Section):
    """A body of foam in the box, and what holds it."""

    shape: Shape = Field(
        ..., description="Shape of the foam: one of the kinds below, or a drawing."
    )
    position_m: tuple[float, ...] = quantity(
        (0.0, 0.0), "Place of the shape's origin in the box, one number per dimension.", unit="m",
        source="user", min_length=2, max_length=3,
    )  # fmt: skip
    depth_m: float | None = quantity(
        None, "Extent of a shape along y in 3D; to the back of the box unless given. A mesh file "
        "has its own.", unit="m", source="user", gt=0, le=100,
    )  # fmt: skip
    supports: SupportsConfig = Field(
        SupportsConfig(), description="What holds the pattern in the box."
    )


class PatternConfig(Placed):
    """A foam pattern that bends under the sand."""

    name: str = quantity("pattern", "Name in tables.", source="user", pattern=r"^[a-z][a-z0-9_]*$")
    others: tuple[Placed, ...] | None = quantity(
        None,
        "Further patterns of the same foam in the box, 3D only: with the first one a "
        "cluster. Each has its own supports.",
        source="user",
        min_length=1,
        max_length=20,
    )
    element_m: float = quantity(
        0.005, "Longest side of an element; a mesh file has its own.", unit="m", source=ARGUED,
        gt=0, le=1,
    )  # fmt: skip
    order: Literal[1, 2] = quantity(
        2, "Order of the elements; those of the first are too stiff in bending.", source=ARGUED
    )
    young_modulus_pa: float = quantity(
        6.4e6, "Young's modulus.", unit="Pa", source=ROJEK, gt=0, le=1e12
    )
    poisson_ratio: float = quantity(0.35, "Poisson's ratio.", source=ROJEK, gt=-1, lt=0.5)
    density_kg_m3: float = quantity(12.0, "Density.", unit="kg/m3", source=ROJEK, gt=0, le=3e4)
    crush_strength_pa: float | None = quantity(
        None,
        "Compression at which the foam crushes; without it nothing is said of crushing.",
        unit="Pa",
        source="user",
        gt=0,
        le=1e12,
    )
    tolerance_m: float | None = quantity(
        None, "Distance from the drawing that passes.", unit="m", source="user", gt=0, le=1
    )
    statics: Literal["linear", "large"] = quantity(
        "linear", "Small displacements, or large ones (total Lagrangian).", source=ARGUED
    )
    loop: Loop = Field(Loop(), description="How sand and pattern are coupled while it bends.")

    @property
    def bodies(self) -> tuple[PatternConfig, ...]:
        """The patterns of a cluster, each as if it were alone."""
        own = {name: getattr(self, name) for name in Placed.model_fields}
        each = [own, *({n: getattr(o, n) for n in Placed.model_fields} for o in self.others or ())]
        return tuple(self.model_copy(update=body | {"others": None}) for body in each)
