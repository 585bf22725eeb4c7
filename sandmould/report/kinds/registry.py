"""The reports of all kinds of studies."""

from __future__ import annotations

from sandmould.kinds.kind import AnyScenario
from sandmould.kinds.registry import kind_of
from sandmould.report.kinds import deck, flow, sand, solidification
from sandmould.report.kinds.kind import KindReport

REPORTS: dict[str, KindReport] = {
    "sand": sand.REPORT,
    "deck": deck.REPORT,
    "solidification": solidification.REPORT,
    "flow": flow.REPORT,
}
"""The part of a report by the name of its kind."""


def report_of(scenario: AnyScenario) -> KindReport:
    """The part of a report that depends on the kind of a scenario."""
    return REPORTS[kind_of(scenario).name]
