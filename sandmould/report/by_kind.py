"""What the report of each kind of study shows beside verdict, settings and runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from sandmould.report.chart import Chart
from sandmould.report.figure_files import numbered, pictures, strip
from sandmould.report.filling import FillingPages, filling_pages
from sandmould.report.flow import flow_method, flow_pages
from sandmould.report.method import Row, deck_method, sand_method
from sandmould.report.sand import SandPages, sand_pages
from sandmould.report.solidification import shown_run, solid_method, solid_pages
from sandmould.report.time_series import Curve, measure_curves, whole_conclusion
from sandmould.runs.columns import LARGEST_OVERLAP_FRACTION
from sandmould.scenario.flow import MetalFlow, StillTank
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solidification import Solidification
from sandmould.statistics.verdict import Verdict, rank_runs, sand_notes
from sandmould.study.collect import Collected
from sandmould.study.kinds.kind import AnyScenario
from sandmould.study.study import SolidificationStudy, Study

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
    if isinstance(scenario, OwnDeck):
        return ("The deck is the user's own: what it simulates, and how well, it alone says.",)
    if isinstance(scenario, Solidification):
        flat = "Two dimensions: heat that leaves a casting across the plane is not counted."
        return (flat,) if scenario.dimensions == 2 else ()
    if isinstance(scenario, MetalFlow):
        return _flow_notes(scenario)
    stage = scenario.vibration[0] if scenario.vibration else None
    deepest = _deepest_overlap_fraction(collected.summary)
    return sand_notes(collected.keys, stage, deepest, seeks_best, is_controlled)


def _flow_notes(scenario: MetalFlow) -> tuple[str, ...]:
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


def _deepest_overlap_fraction(summary: pd.DataFrame) -> float:
    column = LARGEST_OVERLAP_FRACTION
    found = pd.to_numeric(summary[column], errors="coerce").max() if column in summary else 0.0
    return float(found) if found > 0 else 0.0


def kind_pages(
    study_folder: Path,
    study: Study,
    scenario: AnyScenario,
    collected: Collected,
    verdict: Verdict,
    film_budget_bytes: int,
    href: str,
) -> KindPages:
    """Draw what the kind of study shows.

    Parameters
    ----------
    study_folder : Path
    study : Study
    scenario : scenario of any kind
        Of the run that is shown.
    collected : Collected
    verdict : Verdict
    film_budget_bytes : int
        Most that the film of one run may weigh.
    href : str
        Address of the study's folder, seen from the report.
    """
    of_sweep = collected.of_sweep
    if isinstance(scenario, OwnDeck):
        curves = _deck_curves(scenario, of_sweep, verdict)
        return KindPages(
            "deck.html",
            deck_method(scenario, collected.keys, collected.summary),
            "the end of the deck's log",
            (),
            {"curves": curves},
            _curve_figures(curves),
        )
    if isinstance(scenario, Solidification):
        reference = study.reference if isinstance(study, SolidificationStudy) else {}
        best = _run_of(of_sweep.summary, verdict) if study.seeks_best else ""
        shown = shown_run(reference, of_sweep, best)
        solid = solid_pages(study_folder, reference, scenario, of_sweep, verdict, shown)
        return KindPages(
            "solidification.html",
            solid_method(scenario, collected.keys),
            "the end of the run",
            (),
            {"pages": solid},
            {
                **pictures(fields=solid.fields),
                **numbered("error_cost", solid.error_cost),
                **_curve_figures(solid.curves),
            },
        )
    if isinstance(scenario, MetalFlow):
        flow = flow_pages(study_folder, scenario, of_sweep, verdict, film_budget_bytes)
        return KindPages(
            "flow.html",
            flow_method(scenario, collected.keys),
            "the end of the run",
            (),
            {"pages": flow},
            pictures(stability_map=flow.map, histories=flow.histories, fields=flow.fields),
        )
    filling = filling_pages(study, of_sweep, verdict, scenario) if study.seeks_best else None
    pages = sand_pages(study_folder, scenario, of_sweep, verdict, film_budget_bytes)
    bending = None
    if scenario.pattern is not None:
        from sandmould.report.bending import bending_pages  # scikit-fem: few studies need it

        bending = bending_pages(study_folder, href, scenario, of_sweep, verdict, pages.shown_run)
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


def drives_of(by_setting: Mapping[str, AnyScenario]) -> dict[str, Scenario]:
    """Scenarios of sand among those of the settings, for the drive of the vibrating table."""
    return {label: s for label, s in by_setting.items() if isinstance(s, Scenario)}
