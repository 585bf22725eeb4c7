"""What the report of a study of sand says and shows of its own."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd

from sandmould.drawing.chart import Chart
from sandmould.drawing.figure_files import pictures, strip
from sandmould.kinds.sand.narrow import narrow_spaces
from sandmould.report.bed_mode import bed_mode
from sandmould.report.curves import curve_figures
from sandmould.report.filling import FillingPages, filling_pages
from sandmould.report.grain_size import grain_size_pages
from sandmould.report.kinds.kind import Findings, KindPages, KindReport
from sandmould.report.loose_sand import loose_sand_pages
from sandmould.report.method import measured_when, sand_method
from sandmould.report.repose_figures import steepest_heaps
from sandmould.report.robustness import robustness_pages
from sandmould.report.sand import film_scene, sand_pages
from sandmould.report.tables import ReportPicture
from sandmould.runs.columns import (
    LEAST_LIMIT_S,
    OVERLAP_P99_FRACTION,
    PART,
    RUN,
    TIME_STEP_S,
    finished,
)
from sandmould.runs.formatting import number, setting_text
from sandmould.runs.templates import worded
from sandmould.scenario.drive import DISPLACEMENT, BoxDrive, laid_down_drive
from sandmould.scenario.hardness import DEEP_OVERLAP, LEAST_KAPPA, bed_hardness
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected
from sandmould.study.robustness.controls import COARSER
from sandmould.wording.answer import sand_limits
from sandmould.wording.grounds import sand_grounds
from sandmould.wording.next_steps import coarse_step, narrow_steps


def _notes(
    scenario: Scenario, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    """Steps that were too long, and what the drive and its controls leave open."""
    stage = scenario.vibrations[0] if scenario.vibrations else None
    has_coarser = PART in collected.summary and (collected.summary[PART] == COARSER.part).any()
    varied = [key for key in collected.keys if collected.summary[key].nunique() > 1]
    notes = sand_limits(varied, stage, seeks_best and not is_controlled, bool(has_coarser))
    return (*_steps_above_limit(collected.summary), *notes)


def drive_of(scenario: Scenario, runs: pd.DataFrame) -> BoxDrive | None:
    """Drive of the first vibration of a setting; None where there is none, or none was measured.

    ``runs``: rows of the summary at the setting: a table on mounts moves as it was measured.
    """
    if not scenario.vibrations:
        return None
    stage = scenario.vibrations[0]
    if stage.unbalance is None:
        return laid_down_drive(stage)
    measured = runs.loc[finished(runs), DISPLACEMENT] if DISPLACEMENT in runs else pd.Series()
    displacement_m = float(pd.to_numeric(measured).mean())
    return BoxDrive(stage.frequency_hz, displacement_m) if math.isfinite(displacement_m) else None


def _pages(findings: Findings[Scenario], film_budget_bytes: int) -> KindPages:
    """See ``KindPages``."""
    folder, study, scenario = findings.study_folder, findings.study, findings.scenario
    collected, verdict = findings.collected, findings.verdict
    of_sweep = collected.of_sweep
    filling = filling_pages(study, of_sweep, verdict, scenario) if study.seeks_best else None
    own, href = study.own_measures, findings.href
    pages = sand_pages(folder, scenario, of_sweep, verdict, film_budget_bytes, href, own)
    run = pages["pictured_run"]
    bending = None
    if scenario.pattern is not None:
        from sandmould.report.bending import bending_pages  # scikit-fem: few studies need it

        bending = bending_pages(folder, href, scenario, of_sweep, verdict, run)
    loose = loose_sand_pages(folder, run, scenario, pages["height_m"])
    surfaces = [loose["surface"]] if loose and loose["surface"] else []
    best = verdict.best.label if verdict.best else ""
    grain_size = grain_size_pages(study, collected, scenario, best) if verdict.best else None
    by_setting = {label: own for label, (own, _) in findings.by_setting.items()}
    pages["film_scene"] = film_scene(scenario, pages["height_m"], surfaces)
    return KindPages(
        "sand.html",
        sand_method(scenario, collected.keys, collected.summary),
        measured_when(scenario),
        {
            "pages": pages,
            "bending": bending,
            "has_rigid": any(o.name != scenario.pattern.name for o in scenario.obstacles)
            if scenario.pattern is not None
            else bool(scenario.obstacles),
            "loose": loose,
            "dimension": scenario.dimension,
            "vibrates": bool(scenario.vibrations),
            "ends_at_rest": scenario.ends_at_rest,
            "filling": filling,
            "grain_size": grain_size,
        },
        _sand_figures(pages, filling, bending, loose),
        _first_picture(pages, verdict, of_sweep),
        pages["beside"],
        grounds=sand_grounds(
            scenario, study, verdict, by_setting, grain_size.short if grain_size else ()
        ),
        at_last=None if grain_size else coarse_step(study, scenario.sand.size_scale),
        steps=tuple(narrow_steps(study, findings.answer, narrow_spaces(scenario))),
        warning=_softness(scenario, of_sweep.summary),
    )


def _first_picture(
    pages: dict[str, Any], verdict: Verdict, collected: Collected
) -> ReportPicture | None:
    """The sand at its end; None without a snapshot."""
    if not pages["panels"]:
        return None
    last = pages["panels"][-1]
    of_run = collected.summary[collected.summary[RUN] == pages["pictured_run"]]
    values = {key: of_run.iloc[0][key] for key in collected.keys}
    said = f"the sand coloured by layer of fill, {last['heading']}."
    caption = f"{setting_text(values)}: {said}" if values else said.capitalize()
    return ReportPicture(last["by_layer"], last["alt"], caption)


def _steps_above_limit(summary: pd.DataFrame) -> tuple[str, ...]:
    """Say in how many runs the time step of the filled bed was too long for the shaken one."""
    if LEAST_LIMIT_S not in summary:
        return ()
    above = summary[summary[LEAST_LIMIT_S] < summary[TIME_STEP_S]]
    if not len(above):
        return ()
    share = number(float((above[LEAST_LIMIT_S] / above[TIME_STEP_S]).min()))
    return (
        f"In {len(above)} of {len(summary)} runs the exact limit of the shaken bed fell below the "
        f"time step, to {share} of it at the least. Take a smaller time_step.bed_fraction.",
    )


def _softness(scenario: Scenario, summary: pd.DataFrame) -> str:
    """A warning where the bed is soft by its springs, or by the overlaps that were measured."""
    deepest = 0.0
    if OVERLAP_P99_FRACTION in summary:
        measured = pd.to_numeric(summary[OVERLAP_P99_FRACTION], errors="coerce")
        deepest = float(measured[finished(summary)].max())
    return worded(
        "too_soft.j2",
        it=bed_hardness(scenario),
        least=LEAST_KAPPA,
        overlap_percent=100 * deepest,
        deep_percent=100 * DEEP_OVERLAP,
    )


def _sand_figures(
    pages: dict[str, Any],
    filling: FillingPages | None,
    bending: dict[str, Any] | None,
    loose: dict[str, Any] | None,
) -> dict[str, Chart | bytes]:
    """The sand at its moments, the pattern, filling over what is swept, and over time."""
    files: dict[str, Chart | bytes] = {}
    panels = pages["panels"]
    if panels:
        files["sand"] = strip(pages["moments"])
    if panels and loose:
        files["density"] = strip([(panel["heading"], panel["by_density"]) for panel in panels])
        files |= pictures(loose=loose["picture"])
    if filling:
        files["filling"] = filling.chart
    if bending:
        files |= pictures(pattern=bending["outlines"], distances=bending["distances"])
    if bending and bending["deflection"]:
        files["deflection"] = bending["deflection"]
    return files | curve_figures(pages["tubes"])


REPORT = KindReport(
    _pages,
    _notes,
    drive_of,
    lambda of: robustness_pages(of.study_folder, of.study, of.collected, of.scenario),
    lambda of: bed_mode(of.scenario, of.collected.of_sweep.summary),
    steepest_heaps,
)
