"""The kind of study in which metal flows."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sandmould.scenario.flow import MetalFlow
from sandmould.study.definition.study import Study, kind_key
from sandmould.study.kinds.kind import Execution, Kind, Planning


class FlowStudy(Study):
    """A study of metal that flows."""

    kind: Literal["flow"] = kind_key("flow")
    scenario: MetalFlow = Field(
        ..., description="The metal, where it flows, and how that is computed."
    )


def _planning() -> Planning[MetalFlow]:
    from sandmould.study.kinds.flow.planning import PLANNING

    return PLANNING


def _execution() -> Execution[MetalFlow]:
    from sandmould.study.kinds.flow.execution import EXECUTION

    return EXECUTION


FLOW = Kind(
    name="flow",
    scenario=MetalFlow,
    study=FlowStudy,
    open_planning=_planning,
    open_execution=_execution,
)
