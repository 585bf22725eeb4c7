"""The reports of all kinds of studies."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import pandas as pd

from sandmould.definition.study import Study
from sandmould.kinds.kind import AnyScenario, ScenarioT
from sandmould.kinds.registry import kind_of
from sandmould.report.bed_mode import BedMode
from sandmould.report.drive import drive_of
from sandmould.report.heaps import Heap
from sandmould.report.kinds.deck import DECK_REPORT
from sandmould.report.kinds.flow import FLOW_REPORT
from sandmould.report.kinds.kind import Findings, KindPages, KindReport
from sandmould.report.kinds.sand import SAND_REPORT
from sandmould.report.kinds.solidification import SOLIDIFICATION_REPORT
from sandmould.report.robustness import RobustnessPages
from sandmould.scenario.drive import BoxDrive
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected

REPORTS: dict[str, KindReport[Any]] = {
    "sand": SAND_REPORT,
    "deck": DECK_REPORT,
    "solidification": SOLIDIFICATION_REPORT,
    "flow": FLOW_REPORT,
}
"""The part of a report by the name of its kind."""


def notes_of(
    scenario: AnyScenario, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    """What the kind of simulation leaves open.

    Parameters
    ----------
    scenario : scenario of any kind
    collected : Collected
    seeks_best, is_controlled : bool
        Whether the study looks for the best setting; whether its controls have been run.
    """
    return _report_of(scenario).notes(scenario, collected, seeks_best, is_controlled)


def kind_pages(
    study_folder: Path,
    study: Study,
    scenario: AnyScenario,
    collected: Collected,
    verdict: Verdict,
    film_budget_bytes: int,
    href: str,
    by_setting: Mapping[str, AnyScenario],
) -> KindPages:
    """Draw what the kind of study shows; parameters are the fields of ``Findings``."""
    findings = Findings(
        study_folder, study, scenario, collected, verdict, film_budget_bytes, href, by_setting
    )
    return _report_of(scenario).pages(findings)


def drives_of(
    by_setting: Mapping[str, tuple[AnyScenario, pd.DataFrame]],
) -> dict[str, BoxDrive]:
    """Drives of the settings that have a vibrating table, by label.

    Parameters
    ----------
    by_setting : mapping of str to scenario and DataFrame
        The rows of the summary at each setting beside its scenario.
    """
    shown = (
        (label, drive_of(cast(Scenario, scenario), runs))
        for label, (scenario, runs) in by_setting.items()
        if _report_of(scenario).shows_drives
    )
    return {label: drive for label, drive in shown if drive is not None}


def robustness_of(
    study_folder: Path, study: Study, collected: Collected, scenario: AnyScenario
) -> RobustnessPages | None:
    """Draw the controls of a study; None of a kind without any.

    Parameters are those of ``robustness_pages``.
    """
    robustness = _report_of(scenario).robustness
    return robustness(study_folder, study, collected, scenario) if robustness else None


def mode_of(scenario: AnyScenario, summary: pd.DataFrame) -> BedMode | None:
    """Estimate the first mode of the bed; None of a kind without any.

    Parameters
    ----------
    scenario : scenario of any kind
    summary : DataFrame
        One row a run.
    """
    mode = _report_of(scenario).mode
    return mode(scenario, summary) if mode else None


def heaps_of(
    study_folder: Path, summary: pd.DataFrame, verdict: Verdict, scenario: AnyScenario
) -> tuple[Heap, ...]:
    """Draw the sand that a measure was read from; none of a kind without heaps.

    Parameters are those of ``steepest_heaps``.
    """
    heaps = _report_of(scenario).heaps
    return heaps(study_folder, summary, verdict, scenario) if heaps else ()


def _report_of(scenario: ScenarioT) -> KindReport[ScenarioT]:
    return REPORTS[kind_of(scenario).name]
