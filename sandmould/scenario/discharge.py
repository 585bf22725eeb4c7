"""How sand flows out once it is filled in: a gate is taken away."""

from __future__ import annotations

from pydantic import Field

from sandmould.geometry.geometry import Array
from sandmould.scenario.box import Plate, plate_blocks
from sandmould.scenario.fill import Settling
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED

LEFT_OF_GATE = 1e-6
"""Share of its length that a gate has when it has slid away, for a facet must have some length."""


class FlowSettling(Settling):
    """How long a flow may take to be over."""

    shortest_s: float = quantity(
        0.2, "A flow counts as over no sooner than this.", unit="s", source=ARGUED, ge=0, le=100
    )
    longest_s: float = quantity(
        20.0, "A flow not over by then ends the run.", unit="s", source=ARGUED, gt=0, le=1000
    )


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
        "How long the sand flows, the opening included; until it rests unless given.",
        unit="s",
        source="user",
        gt=0,
        le=1000,
    )
    settling: FlowSettling = Field(
        FlowSettling(), description="How long the flow may take to be over."
    )


def slid_away_m(gate: Plate, dimension: int) -> Array:
    """Corners of a gate that has opened, (2^d, d) float64, m: it has slid into its far end."""
    corners_m = plate_blocks(gate, dimension)[0].corners()
    axis = 0 if gate.is_level else -1
    far_m = corners_m[:, axis].max()
    corners_m[:, axis] = far_m - LEFT_OF_GATE * (far_m - corners_m[:, axis])
    return corners_m
