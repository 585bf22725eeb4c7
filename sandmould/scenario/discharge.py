"""How sand flows out once it is filled in: a gate is taken away."""

from __future__ import annotations

from sandmould.geometry.geometry import Array
from sandmould.scenario.box import Plate, plate_blocks
from sandmould.scenario.fill import Settling
from sandmould.scenario.quantity import Section, quantity

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
