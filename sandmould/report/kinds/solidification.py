"""What the report of a study of solidification says and shows of its own."""

from __future__ import annotations

import pandas as pd

from sandmould.drawing.figure_files import numbered, pictures
from sandmould.kinds.solidification.kind import SolidificationStudy
from sandmould.report.kinds.kind import Findings, KindPages, KindReport
from sandmould.report.next_steps import NextStep
from sandmould.report.solidification import choose_pictured_run, solid_method, solid_pages
from sandmould.report.time_series import curve_figures
from sandmould.scenario.casting.solidification import Solidification
from sandmould.statistics.verdict import Verdict, rank_runs
from sandmould.study.collect import Collected


class SolidificationReport(KindReport[Solidification]):
    """See ``KindReport``."""

    def notes(
        self, scenario: Solidification, collected: Collected, seeks_best: bool, is_controlled: bool
    ) -> tuple[str, ...]:
        """What two dimensions leave out."""
        flat = "Two dimensions: heat that leaves a casting across the plane is not counted."
        return (flat,) if scenario.dimensions == 2 else ()

    def pages(self, findings: Findings[Solidification], film_budget_bytes: int) -> KindPages:
        """See ``KindPages``."""
        study, scenario, verdict = findings.study, findings.scenario, findings.verdict
        of_sweep, keys = findings.collected.of_sweep, findings.collected.keys
        # A study whose file is missing is read as one of sand.
        reference = study.reference if isinstance(study, SolidificationStudy) else {}
        best = _run_of(of_sweep.summary, verdict) if study.seeks_best else ""
        pictured_run = choose_pictured_run(reference, of_sweep, best)
        pages = solid_pages(
            findings.study_folder, reference, scenario, of_sweep, verdict, pictured_run
        )
        return KindPages(
            "solidification.html",
            solid_method(scenario, keys),
            "the end of the run",
            {"pages": pages},
            {
                **pictures(fields=pages.fields),
                **numbered("error_cost", pages.error_cost),
                **curve_figures(pages.curves),
            },
            answer="" if study.seeks_best else pages.answer,
            grounds=pages.grounds,
            steps=_steps(scenario, bool(pages.reference)),
        )


def _steps(scenario: Solidification, has_reference: bool) -> tuple[NextStep, ...]:
    """Finer elements, where no reference tells how good these are."""
    if has_reference:
        text = "Take these elements for a casting of this kind, and check them once by finer ones."
        return (NextStep(text),)
    finer = f"scenario: {{element_m: {scenario.element_m / 2:g}}}"
    return (NextStep("See whether the result stays with elements half as large:", finer),)


def _run_of(summary: pd.DataFrame, verdict: Verdict) -> str:
    """The best run of the objective; empty where none finished."""
    return rank_runs(summary, verdict.measure, verdict.better).get("best", "")
