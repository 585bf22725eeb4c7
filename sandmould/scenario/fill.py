"""How the sand comes into the box: layers, their drop, when they are at rest; how it flows out."""

from __future__ import annotations

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould.geometry.geometry import Array
from sandmould.scenario.box import Plate, plate_blocks
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED
from sandmould.scenario.vibration import Shaking, VibrationStage


class Rest(Section):
    """Checks that end a stage in which sand comes to rest."""

    check_every_s: float = quantity(
        0.005,
        "Interval of the checks and of the guards. Loads are means over it, and the engine runs "
        "without a stop in between. Series and snapshots are written at whole checks.",
        unit="s",
        source=ARGUED,
        gt=0,
        le=100,
    )
    shaken_check_every_s: float | None = quantity(
        None,
        "The same from the first vibration on, rounded down to a whole part of check_every_s. "
        "Series and loads are then written at each of these checks. The fill keeps check_every_s, "
        "so runs with and without this key share it. On engine reference.",
        unit="s",
        source="user",
        gt=0,
        le=100,
    )
    checks: int = quantity(
        10, "Checks in a row that must find the sand at rest.", source=ARGUED, ge=1, le=1000
    )
    rms_speed_m_s: float = quantity(
        0.01,
        "Root mean square speed of all grains, weighted by mass, below which the bed is at rest.",
        unit="m/s",
        source=ARGUED,
        gt=0,
        le=10,
    )
    discharge_rms_speed_m_s: float = quantity(
        0.002,
        "The same after a discharge, where few of many grains still roll.",
        unit="m/s",
        source=ARGUED,
        gt=0,
        le=10,
    )
    load_tolerance: float | None = quantity(
        0.01,
        "Largest difference between the vertical loads on all surfaces together and the sand's "
        "weight, over that weight. null: only the speed is checked.",
        source=ARGUED,
        gt=0,
        le=10,
    )
    load_every_steps: int = quantity(
        20,
        "Steps between two samples of the loads on LAMMPS and LIGGGHTS. Checks and the coupling "
        "take means of these samples. A check holds whole samples.",
        source=ARGUED,
        ge=1,
        le=100000,
    )

    def while_shaken(self, step_s: float) -> Rest:
        """Give the checks from the first vibration on; as many as fill the same time find rest."""
        asked_s = self.shaken_check_every_s
        if asked_s is None:
            return self
        # A fill ends at one of its checks, and the next ones must go on from there as a whole.
        sample_s = self.load_every_steps * step_s
        samples = max(1, round(self.check_every_s / sample_s))
        parts = (n for n in range(1, samples + 1) if samples % n == 0)
        of_one = max((n for n in parts if n * sample_s <= asked_s), default=1)
        return self.model_copy(
            update={"check_every_s": of_one * sample_s, "checks": self.checks * samples // of_one}
        )

    def speed_limit_m_s(self, *, flows: bool) -> float:
        """The limit of a bed, or of sand that has flowed out."""
        return self.discharge_rms_speed_m_s if flows else self.rms_speed_m_s


class Layer(Section):
    """One layer of sand, or several equal ones, by height, mass or number of grains."""

    height_m: float | None = quantity(
        None, "Height the layer adds to an even bed.", unit="m", source=ARGUED, gt=0, le=10
    )
    mass_kg: float | None = quantity(
        None, "Mass of the layer.", unit="kg", source=ARGUED, gt=0, le=1e5
    )
    count: int | None = quantity(
        None, "Number of grains in the layer.", source=ARGUED, ge=1, le=10_000_000
    )
    repeat: int = quantity(
        1, "How many such layers follow each other.", source=ARGUED, ge=1, le=100
    )

    @model_validator(mode="after")
    def _one_amount(self) -> Layer:
        if sum(v is not None for v in (self.height_m, self.mass_kg, self.count)) != 1:
            raise PydanticCustomError("layer", "exactly one of height_m, mass_kg and count")
        return self


class Settling(Section):
    """How long a layer may take to come to rest, by the checks of ``rest``."""

    shortest_s: float = quantity(
        0.05, "A bed counts as at rest no sooner than this.", unit="s", source=ARGUED, ge=0, le=100
    )
    longest_s: float = quantity(
        2.0, "A bed not at rest by then ends the run.", unit="s", source=ARGUED, gt=0, le=1000
    )

    @model_validator(mode="after")
    def _order(self) -> Settling:
        if self.longest_s <= self.shortest_s:
            raise PydanticCustomError("settling", "a longest_s greater than shortest_s")
        return self


class PlacedGrain(Section):
    """One grain placed by hand."""

    position_m: tuple[float, ...] = quantity(
        ..., "Place of its centre in the box, one number per dimension.", unit="m", source="user"
    )
    diameter_m: float = quantity(
        ..., "Diameter, that of a size class of the sand.", unit="m", source="user", gt=0, le=1
    )
    velocity_m_s: tuple[float, ...] | None = quantity(
        None, "Velocity at the start; none unless given.", unit="m/s", source="user"
    )


class Spout(Section):
    """A square spout that moves evenly over the box while a layer is poured, in portions."""

    from_m: tuple[float, ...] = quantity(
        ..., "Middle of the spout at the first portion: x in 2D, x and y in 3D.", unit="m",
        source="user", min_length=1, max_length=2,
    )  # fmt: skip
    to_m: tuple[float, ...] = quantity(
        ..., "Its middle at the last portion of each layer.", unit="m", source="user",
        min_length=1, max_length=2,
    )  # fmt: skip
    width_m: float = quantity(
        ..., "Width of the spout, along x and y.", unit="m", source="user", gt=0, le=10
    )
    time_s: float = quantity(
        1.0, "Time from the first portion of a layer to the last.", unit="s", source=ARGUED,
        gt=0, le=100,
    )  # fmt: skip
    portions: int = quantity(
        5, "Portions of a layer, dropped at equal times.", source=ARGUED, ge=2, le=100
    )

    @property
    def interval_s(self) -> float:
        """Time from a portion to the next."""
        return self.time_s / (self.portions - 1)

    def window_m(self, portion: int) -> tuple[tuple[float, float], ...]:
        """Where a portion, counted from 0, is dropped: (low, high) of each horizontal axis, m."""
        share, half_m = portion / (self.portions - 1), self.width_m / 2
        middle = (a + (b - a) * share for a, b in zip(self.from_m, self.to_m, strict=True))
        return tuple((x - half_m, x + half_m) for x in middle)


class FillVibration(Shaking):
    """Vibration from the first layer on until after the last, without a pause.

    A layer then falls a stated time after the one before, and the sand comes to rest at the end.
    """

    layer_s: float = quantity(
        0.4, "Time from the drop of a layer to that of the next.", unit="s", source=ARGUED,
        gt=0, le=30,
    )  # fmt: skip
    after_s: float = quantity(
        0.0, "How long the box goes on once the last layer has had its layer_s.", unit="s",
        source=ARGUED, ge=0, le=100,
    )  # fmt: skip

    def over(self, layers: int) -> VibrationStage:
        """The whole of it, as one stage of vibration: its time is rounded to whole periods."""
        given = {name: getattr(self, name) for name in Shaking.model_fields}
        duration_s = layers * self.layer_s + self.after_s
        # A long fill may last longer than a stage that is read.
        return VibrationStage.model_construct(**given, duration_s=duration_s)


class Fill(Section):
    """Layers of sand dropped one after the other, each on a bed at rest or on a vibrating one."""

    layers: tuple[Layer, ...] = Field(
        (Layer(height_m=0.02, repeat=2),),
        description="Layers from the bottom up; an empty list with grains placed by hand alone.",
    )
    grains: tuple[PlacedGrain, ...] = Field(
        (), max_length=10_000,
        description="Grains placed by hand; layers fall on them once they are at rest.",
    )  # fmt: skip
    drop_height_m: float = quantity(
        0.005,
        "Gap between the bed's highest grain and the lowest of the new layer.",
        unit="m",
        source=ARGUED,
        ge=0,
        le=10,
    )
    over_x_m: tuple[float, float] | None = quantity(
        None,
        "Part of the box's width that sand is poured over, such as that of a hopper; all of it "
        "unless given.",
        unit="m",
        source="user",
    )
    over_y_m: tuple[float, float] | None = quantity(
        None, "Part of the box's depth that sand is poured over, 3D only; all of it unless given.",
        unit="m", source="user",
    )  # fmt: skip
    spout: Spout | None = Field(
        None, description="Spout that each layer is poured through; all at once unless given."
    )
    settling: Settling = Field(Settling(), description="How long a layer may take to settle.")
    vibration: FillVibration | None = Field(
        None, description="Vibration while the layers are poured; the box stands unless given."
    )
    vibration_between_layers: VibrationStage | None = Field(
        None, description="Vibration after each layer but the last."
    )

    @model_validator(mode="after")
    def _some_sand(self) -> Fill:
        if not self.layers and not self.grains:
            raise PydanticCustomError("fill", "at least one layer in layers, or grains")
        return self

    @property
    def shakings(self) -> tuple[Shaking, ...]:
        """How the box vibrates during the fill."""
        return tuple(x for x in (self.vibration, self.vibration_between_layers) if x is not None)

    def each_layer(self) -> tuple[Layer, ...]:
        """The layers with repeats written out."""
        return tuple(layer for layer in self.layers for _ in range(layer.repeat))


LEFT_OF_GATE = 1e-6
"""Share of its length that a gate has when it has slid away, for a facet must have some length."""
FLOW_SETTLING = Settling(shortest_s=0.2, longest_s=20.0)
"""How long a flow may take to be over, where no duration is stated."""


class Discharge(Section):
    """A plate that holds the sand is taken away, and the sand flows until it rests.

    A level gate lets the sand fall through an outlet; an upright one lets a column run out. In a
    stated time a level gate opens from its left end to the right, an upright one from its foot
    upwards, both evenly.
    """

    gate: str = quantity(..., "Name of the plate that is taken away.", source="user")
    opening_time_s: float | None = quantity(
        None,
        "Time in which the gate opens evenly: a level one from the left, an upright one from its "
        "foot. At once unless given.",
        unit="s",
        source="user",
        gt=0,
        le=100,
    )
    duration_s: float | None = quantity(
        None,
        "How long the sand flows, the opening included. Unless given, until it rests: for at "
        "least 0.2 s, and a flow that is not over after 20 s ends the run.",
        unit="s",
        source="user",
        gt=0,
        le=1000,
    )


def slid_away_m(gate: Plate, dimension: int) -> Array:
    """Corners of a gate that has opened, (2^d, d) float64, m: it has slid into its far end."""
    corners_m = plate_blocks(gate, dimension)[0].corners()
    axis = 0 if gate.is_level else -1
    far_m = corners_m[:, axis].max()
    corners_m[:, axis] = far_m - LEFT_OF_GATE * (far_m - corners_m[:, axis])
    return corners_m
