"""The kind of study in which metal flows."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from sandmould.definition.study import CastingStudy, kind_key
from sandmould.kinds.kind import Execution, Kind, Planning
from sandmould.scenario.casting.flow import MetalFlow


class FlowStudy(CastingStudy):
    """A study of metal that flows."""

    kind: Literal["flow"] = kind_key("flow")
    material: ClassVar[str | None] = None  # type: ignore[misc]
    scenario: MetalFlow = Field(
        ..., description="The metal, where it flows, and how that is computed."
    )


def _open_planning() -> Planning[MetalFlow]:
    from sandmould.kinds.flow.planning import FlowPlanning

    return FlowPlanning()


def _open_execution() -> Execution[MetalFlow]:
    from sandmould.kinds.flow.execution import FlowExecution

    return FlowExecution()


FLOW: Kind[MetalFlow] = Kind(
    name="flow",
    scenario=MetalFlow,
    study=FlowStudy,
    open_planning=_open_planning,
    open_execution=_open_execution,
)
