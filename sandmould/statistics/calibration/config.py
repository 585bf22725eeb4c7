"""What a study calibrates: real sands, and what was measured on them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sandmould.scenario.quantity import NAME, Section, quantity


class Target(Section):
    """A value measured on the real sand, or assumed of it."""

    value: float = quantity(..., "The value.", unit="of the column or key", source="user")
    sd: float = quantity(
        ..., "Its standard deviation, of the mean of what was measured.",
        unit="of the column or key", source="user", gt=0,
    )  # fmt: skip


class TargetSand(Section):
    """One real sand: what was measured on it, and the material that is made of that."""

    name: str = quantity(..., "Name of the material that is written.", source="user", pattern=NAME)
    targets: dict[Annotated[str, Field(pattern=NAME)], Target] = Field(
        ..., min_length=1, description="Columns of summary.tsv and what was measured of each."
    )
    assumed: dict[str, Target] = Field(
        {},
        description="Swept keys, each with what is taken for granted of it, such as a rolling "
        "angle of 10 degrees. One measured value leaves a ridge of points that fit; this picks a "
        "place on it.",
    )


class Calibration(Section):
    """Sands whose two swept keys are found from what was measured on them."""

    sands: tuple[TargetSand, ...] = Field(
        (), description="The sands; none asks for no calibration."
    )
    also: tuple[Annotated[str, Field(pattern=NAME)], ...] = Field(
        (),
        description="Finished studies that sweep the same two keys over another scene. Their "
        "columns get the study's name and two underscores in front.",
    )
