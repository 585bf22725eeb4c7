"""The kind of study in which metal flows."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from sandmould.definition.study import CastingStudy, kind_key
from sandmould.kinds.kind import Kind, opened_later
from sandmould.scenario.casting.flow import MetalFlow


class FlowStudy(CastingStudy):
    """A study of metal that flows."""

    kind: Literal["flow"] = kind_key("flow")
    material: ClassVar[str | None] = None  # type: ignore[misc]
    scenario: MetalFlow = Field(
        ..., description="The metal, where it flows, and how that is computed."
    )


FLOW: Kind[MetalFlow] = Kind(
    name="flow",
    scenario=MetalFlow,
    study=FlowStudy,
    open_planning=opened_later("sandmould.kinds.flow.planning", "FlowPlanning"),
    open_execution=opened_later("sandmould.kinds.flow.execution", "FlowExecution"),
)
