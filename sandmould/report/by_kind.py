"""What the report of each kind of study shows beside verdict, settings and runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic

import pandas as pd

from sandmould.report.chart import Chart
from sandmould.report.figure_files import numbered, pictures, strip
from sandmould.report.filling import FillingPages, filling_pages
from sandmould.report.flow import flow_method, flow_pages
from sandmould.report.method import Row, deck_method, sand_method
from sandmould.report.sand import SandPages, sand_pages
from sandmould.report.solidification import choose_pictured_run, solid_method, solid_pages
from sandmould.report.time_series import Curve, measure_curves, whole_conclusion
from sandmould.runs.columns import LARGEST_OVERLAP_FRACTION
from sandmould.scenario.flow import MetalFlow, StillTank
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solidification import Solidification
from sandmould.statistics.verdict import Verdict, rank_runs, sand_notes
from sandmould.study.collect import Collected
from sandmould.study.definition.study import Study
from sandmould.study.kinds.kind import AnyScenario, ScenarioT
from sandmould.study.kinds.registry import kind_of

if TYPE_CHECKING:
    from sandmould.report.bending import BendingPages


@dataclass(frozen=True)
class KindPages:
    """The part of a report that depends on what is simulated."""

    template: str
    """File of ``templates/report``."""
    method: tuple[Row, ...]
    ends: str
    """When measures are taken, where the objective names no time."""
    advice: tuple[str, ...]
    """What follows the verdict."""
    context: Mapping[str, Any]
    """What the template is given beside what all are given."""
    figures: Mapping[str, Chart | bytes] = field(default_factory=dict)
    """What is written as files too, by name."""


@dataclass(frozen=True)
class Findings(Generic[ScenarioT]):
    """What the pages of a kind are drawn from."""

    study_folder: Path
    study: Study
    scenario: ScenarioT
    """Of the run that is shown."""
    collected: Collected
    verdict: Verdict
    film_budget_bytes: int
    """Most that the film of one run may weigh."""
    href: str
    """Address of the study's folder, seen from the report."""


@dataclass(frozen=True)
class KindReport(Generic[ScenarioT]):
    """What reports of one kind of study say and show of their own."""

    notes: Callable[[ScenarioT, Collected, bool, bool], tuple[str, ...]]
    """What the simulation leaves open; arguments are those of ``notes_of``."""
    pages: Callable[[Findings[ScenarioT]], KindPages]
    """What it draws."""
    shows_drives: bool = False
    """Whether settings are listed with the drive of a vibrating table."""


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
) -> KindPages:
    """Draw what the kind of study shows; parameters are the fields of ``Findings``."""
    findings = Findings(study_folder, study, scenario, collected, verdict, film_budget_bytes, href)
    return _report_of(scenario).pages(findings)


def drives_of(by_setting: Mapping[str, AnyScenario]) -> dict[str, Any]:
    """Scenarios among those of the settings that have a vibrating table, for its drive."""
    return {label: s for label, s in by_setting.items() if _report_of(s).shows_drives}


def _report_of(scenario: ScenarioT) -> KindReport[ScenarioT]:
    return REPORTS[kind_of(scenario).name]


def _deck_notes(
    scenario: OwnDeck, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    return ("The deck is the user's own: what it simulates, and how well, it alone says.",)


def _solidification_notes(
    scenario: Solidification, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    flat = "Two dimensions: heat that leaves a casting across the plane is not counted."
    return (flat,) if scenario.dimensions == 2 else ()


def _flow_notes(
    scenario: MetalFlow, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    """What the paper leaves open."""
    gradient = (
        "The gradient as printed, eq. (3), points the wrong way and makes every run fail; the "
        f"gradient used here, {scenario.gradient}, is a choice."
    )
    if isinstance(scenario.case, StillTank):
        return (gradient,)
    return (
        gradient,
        "The paper gives neither the particle size in space nor the speed of the stream.",
    )


def _sand_notes(
    scenario: Scenario, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    stage = scenario.vibration[0] if scenario.vibration else None
    deepest = _deepest_overlap_fraction(collected.summary)
    return sand_notes(collected.keys, stage, deepest, seeks_best, is_controlled)


def _deepest_overlap_fraction(summary: pd.DataFrame) -> float:
    column = LARGEST_OVERLAP_FRACTION
    deepest = pd.to_numeric(summary[column], errors="coerce").max() if column in summary else 0.0
    return float(deepest) if deepest > 0 else 0.0


def _deck_pages(findings: Findings[OwnDeck]) -> KindPages:
    scenario, collected = findings.scenario, findings.collected
    curves = _deck_curves(scenario, collected.of_sweep, findings.verdict)
    return KindPages(
        "deck.html",
        deck_method(scenario, collected.keys, collected.summary),
        "the end of the deck's log",
        (),
        {"curves": curves},
        _curve_figures(curves),
    )


def _solidification_pages(findings: Findings[Solidification]) -> KindPages:
    study, scenario, verdict = findings.study, findings.scenario, findings.verdict
    of_sweep, keys = findings.collected.of_sweep, findings.collected.keys
    reference = getattr(study, "reference", {})
    best = _run_of(of_sweep.summary, verdict) if study.seeks_best else ""
    pictured_run = choose_pictured_run(reference, of_sweep, best)
    pages = solid_pages(findings.study_folder, reference, scenario, of_sweep, verdict, pictured_run)
    return KindPages(
        "solidification.html",
        solid_method(scenario, keys),
        "the end of the run",
        (),
        {"pages": pages},
        {
            **pictures(fields=pages.fields),
            **numbered("error_cost", pages.error_cost),
            **_curve_figures(pages.curves),
        },
    )


def _flow_pages(findings: Findings[MetalFlow]) -> KindPages:
    scenario, of_sweep = findings.scenario, findings.collected.of_sweep
    pages = flow_pages(
        findings.study_folder, scenario, of_sweep, findings.verdict, findings.film_budget_bytes
    )
    return KindPages(
        "flow.html",
        flow_method(scenario, findings.collected.keys),
        "the end of the run",
        (),
        {"pages": pages},
        pictures(stability_map=pages.map, histories=pages.histories, fields=pages.fields),
    )


def _sand_pages(findings: Findings[Scenario]) -> KindPages:
    folder, study, scenario = findings.study_folder, findings.study, findings.scenario
    collected, verdict = findings.collected, findings.verdict
    of_sweep = collected.of_sweep
    filling = filling_pages(study, of_sweep, verdict, scenario) if study.seeks_best else None
    pages = sand_pages(folder, scenario, of_sweep, verdict, findings.film_budget_bytes)
    bending = None
    if scenario.pattern is not None:
        from sandmould.report.bending import bending_pages  # scikit-fem: few studies need it

        bending = bending_pages(
            folder, findings.href, scenario, of_sweep, verdict, pages.pictured_run
        )
    return KindPages(
        "sand.html",
        sand_method(scenario, collected.keys, collected.summary),
        "the end of vibration" if scenario.vibration else "the end",
        filling.advice if filling else (),
        {
            "pages": pages,
            "bending": bending,
            "dimension": scenario.dimension,
            "vibrates": bool(scenario.vibration),
            "filling": filling,
        },
        _sand_figures(pages, filling, bending),
    )


def _curve_figures(curves: Iterable[Curve]) -> dict[str, Chart]:
    """Measures over time."""
    return numbered("curves", (curve.chart for curve in curves))


def _sand_figures(
    pages: SandPages, filling: FillingPages | None, bending: BendingPages | None
) -> dict[str, Chart | bytes]:
    """The sand at its moments, the pattern, filling over what is swept, and over time."""
    files: dict[str, Chart | bytes] = {}
    if pages.panels:
        files["sand"] = strip([(panel.heading, panel.by_layer) for panel in pages.panels])
    if filling and filling.chart:
        files["filling"] = filling.chart
    if bending:
        files |= pictures(pattern=bending.outlines)
    if bending and bending.deflection:
        files["deflection"] = bending.deflection
    return files | _curve_figures(pages.tubes)


def _deck_curves(scenario: OwnDeck, collected: Collected, verdict: Verdict) -> tuple[Curve, ...]:
    """The objective first, then the other measures."""
    measures = dict.fromkeys([verdict.measure, *scenario.measures])
    return measure_curves(collected, verdict, list(measures), whole_conclusion)


def _run_of(summary: pd.DataFrame, verdict: Verdict) -> str:
    """The best run of the objective; empty where none finished."""
    return rank_runs(summary, verdict.measure, verdict.better).get("best", "")


REPORTS: dict[str, KindReport[Any]] = {
    "sand": KindReport(_sand_notes, _sand_pages, shows_drives=True),
    "deck": KindReport(_deck_notes, _deck_pages),
    "solidification": KindReport(_solidification_notes, _solidification_pages),
    "flow": KindReport(_flow_notes, _flow_pages),
}
"""The part of a report by the name of its kind."""
