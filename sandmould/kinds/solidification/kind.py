"""The kind of study in which a casting solidifies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

from pydantic import Field

from sandmould.bad_input import Problem
from sandmould.definition.study import CastingStudy, kind_key
from sandmould.definition.sweep import points
from sandmould.kinds.kind import Kind, opened_later
from sandmould.scenario.casting.solidification import MetalAndMould, Solidification


class SolidificationStudy(CastingStudy):
    """A study of a casting in its mould."""

    kind: Literal["solidification"] = kind_key("solidification")
    scenario: Solidification = Field(
        ..., description="The casting, its mould, and how they are computed."
    )
    reference: dict[str, Any] = Field(
        {},
        description="The swept point that the others are compared with in error and cost: a value "
        "of every swept key, as the sweep has it.",
    )

    def problems(self) -> Iterator[Problem]:
        """The point that others are compared with is one of the sweep."""
        swept = points(self.sweep, self.scenario) if self.reference else []
        if self.reference and self.reference not in swept:
            yield Problem("reference", self.reference, f"a point of the sweep, such as {swept[0]}")


SOLIDIFICATION: Kind[Solidification] = Kind(
    name="solidification",
    scenario=Solidification,
    study=SolidificationStudy,
    open_planning=opened_later("sandmould.kinds.solidification.planning", "SolidificationPlanning"),
    open_execution=opened_later(
        "sandmould.kinds.solidification.execution", "SolidificationExecution"
    ),
    material=MetalAndMould,
)
