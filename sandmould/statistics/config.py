"""What a study compares its runs by: objective, margins, cases of controls, values measured."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould.runs.columns import CONTROL
from sandmould.runs.formatting import FILL, OF_BED, filled_space
from sandmould.scenario.quantity import NAME, Section, quantity
from sandmould.scenario.sand import ARGUED

Better = Literal["larger", "smaller", "neither"]
SPRINGS = "springs"
"""Control whose cases are whole curves, each over frequency in one hold."""
FULL = "full"
FULL_SHARE = 0.95
"""Of what fits into a tube or cavity, as densely as the bed: from there on it is full."""


@dataclass(frozen=True)
class Goal:
    """A value of a measure that is good enough."""

    measure: str
    value: float


@dataclass(frozen=True)
class ControlCase:
    """One case of a control: what is changed, and to what."""

    control: str
    value: str
    """In words."""
    factor: float | None
    """What the property is multiplied by; None where a control does not multiply."""
    hold: str = field(default="", kw_only=True)
    """Amplitude that is held in a curve of the control springs; empty of all others."""

    @property
    def part(self) -> str:
        """What it is called in ``runs.tsv``."""
        return f"{CONTROL}{self.control} {self.value}"

    @property
    def name(self) -> str:
        """As sentences name it."""
        what = self.control.replace("_", " ")
        return f"{self.value} held" if self.control == "hold" else f"{what} {self.value}"


class Reported(Section):
    """A value that someone else has reported."""

    value: float = quantity(..., "Reported value.", unit="of the column", source="user")
    by: str = quantity(..., "Who reports it, and where.", source="user")


class Aim(Section):
    """A measure, and which of its values are better, or good enough."""

    measure: str = quantity(
        "tube_fill_fraction",
        "Column of measures.tsv that is compared.",
        source=ARGUED,
        pattern=NAME,
    )
    better: Better = quantity(
        "larger",
        "Which values of the measure are better; neither where it is only to be known.",
        source=ARGUED,
    )
    target: Literal["full"] | float | None = quantity(
        None,
        "Value of the measure that is good enough; full is 95 % of what fits into a tube or "
        "cavity. The fill of one has the target full unless another is given.",
        unit="of the column",
        source=ARGUED,
    )

    @property
    def is_fill(self) -> bool:
        """Whether the measure is the fill of a tube or cavity."""
        return self.measure.endswith((FILL, OF_BED))

    @property
    def goal(self) -> Goal | None:
        """What is good enough; None where nothing is, or no value is better."""
        if isinstance(self.target, float):
            return Goal(self.measure, self.target)
        if not self.is_fill or self.better != "larger":
            return None
        return Goal(filled_space(self.measure) + OF_BED, FULL_SHARE)


class Objective(Aim):
    """What makes one setting better than another."""

    beside: tuple[Aim, ...] = Field(
        (),
        description="What the settings should do well besides. The other cavities and the tip of a "
        "pattern are judged unasked.",
    )
    reported: Reported | None = Field(None, description="What the measure is compared with.")
    reported_best: tuple[Reported, ...] = Field(
        (), description="Values of the one swept key that others have found best."
    )


class SandWaveSpeed(Section):
    """Speed of compression waves in the real sand as somebody measured it, with its spread."""

    low_m_s: float = quantity(
        ..., "Lowest value that is likely.", unit="m/s", source="user", gt=0, le=1e4
    )
    high_m_s: float = quantity(
        ..., "Highest value that is likely.", unit="m/s", source="user", gt=0, le=1e4
    )
    by: str = quantity(
        ..., "Who measured it, where, and at which pressure.", source="user", min_length=1
    )

    @model_validator(mode="after")
    def _spread(self) -> SandWaveSpeed:
        if self.high_m_s < self.low_m_s:
            raise PydanticCustomError("wave_speed", "a high_m_s that is not below the low_m_s")
        return self


class Equivalence(Section):
    """Which settings should agree, and how closely: set before the runs, judged after them."""

    keys: tuple[str, ...] = Field(
        (),
        description="Swept keys whose values should agree, such as engine.name. Settings that "
        "differ in one of them alone are compared.",
    )
    over: tuple[str, ...] = Field(
        (),
        description="Swept keys that are averaged over. The values of a key are compared over all "
        "settings of these at once, as the main effect of a factorial design.",
    )
    margins: dict[Annotated[str, Field(pattern=NAME)], Annotated[float, Field(gt=0)]] = Field(
        {},
        description="Columns of measures.tsv, each with the largest difference of means that "
        "counts as none, in the unit of the column.",
    )


def fewest_points(keys: int) -> int:
    """Different points that a surface over some keys needs."""
    return 2 + 2 * keys


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
