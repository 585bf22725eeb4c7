"""How sand flows out once it is filled in: a gate is taken away."""

from __future__ import annotations

from pydantic import Field

from sandmould.scenario.fill import Settling
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED


class FlowSettling(Settling):
    """How long a flow may take to be over."""

    shortest_s: float = quantity(
        0.2, "A flow counts as over no sooner than this.", unit="s", source=ARGUED, ge=0, le=100
    )
    longest_s: float = quantity(
        20.0, "A flow not over by then ends the run.", unit="s", source=ARGUED, gt=0, le=1000
    )


class Discharge(Section):
    """A plate that holds the sand is taken away at once, and the sand flows until it rests.

    A level gate lets the sand fall through an outlet; an upright one lets a column run out.
    """

    gate: str = quantity(..., "Name of the plate that is taken away.", source="user")
    settling: FlowSettling = Field(
        FlowSettling(), description="How long the flow may take to be over."
    )
