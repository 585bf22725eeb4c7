"""The reports of all kinds of studies."""

from __future__ import annotations

from typing import Any

from sandmould.kinds.kind import ScenarioT
from sandmould.kinds.registry import kind_of
from sandmould.report.kinds.deck import DeckReport
from sandmould.report.kinds.flow import FlowReport
from sandmould.report.kinds.kind import KindReport
from sandmould.report.kinds.sand import SandReport
from sandmould.report.kinds.solidification import SolidificationReport

REPORTS: dict[str, KindReport[Any]] = {
    "sand": SandReport(),
    "deck": DeckReport(),
    "solidification": SolidificationReport(),
    "flow": FlowReport(),
}
"""The part of a report by the name of its kind."""


def report_of(scenario: ScenarioT) -> KindReport[ScenarioT]:
    """The part of a report that depends on the kind of a scenario."""
    return REPORTS[kind_of(scenario).name]
