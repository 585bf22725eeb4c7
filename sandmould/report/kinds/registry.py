"""The reports of all kinds of studies."""

from __future__ import annotations

from importlib import import_module
from typing import cast

from sandmould.kinds.kind import AnyScenario
from sandmould.kinds.registry import kind_of
from sandmould.report.kinds.kind import KindReport

REPORTS = {
    "sand": "sandmould.report.kinds.sand",
    "deck": "sandmould.report.kinds.deck",
    "solidification": "sandmould.report.kinds.solidification",
    "flow": "sandmould.report.kinds.flow",
}
"""The module that holds the part of a report by the name of its kind, imported when asked for."""


def report_of(scenario: AnyScenario) -> KindReport:
    """The part of a report that depends on the kind of a scenario."""
    return cast(KindReport, import_module(REPORTS[kind_of(scenario).name]).REPORT)
