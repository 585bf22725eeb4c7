"""The report of a study: one HTML file that opens offline."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd
from jinja2 import Environment

from sandmould.bad_input import BadInputError
from sandmould.definition.certificate import frequency_among
from sandmould.definition.run import Run
from sandmould.definition.study import Study
from sandmould.definition.sweep import points
from sandmould.drawing.animation import BUDGET_BYTES
from sandmould.drawing.chart import NARROW, SMALL, WIDE, Chart, lay_out
from sandmould.drawing.figure_files import numbered, page_environment, write_figures
from sandmould.drawing.small_multiples import small_multiples
from sandmould.drawing.thinning import drawn_note, drawn_part, listed_settings
from sandmould.kinds.kind import AnyScenario
from sandmould.kinds.registry import kind_named
from sandmould.report.agreement import AgreementPages, agreement_pages
from sandmould.report.answer import (
    FirstScreen,
    figures_of,
    optimum_choice,
    optimum_headline,
    table_of,
)
from sandmould.report.bed_mode import BedMode
from sandmould.report.curves import objective_charts, pictured_runs
from sandmould.report.estimate_section import EstimatePages, estimate_figures, estimate_pages
from sandmould.report.kinds.kind import Findings, KindPages
from sandmould.report.kinds.registry import report_of
from sandmould.report.method import own_measures_method, provenance_rows, statistics_method
from sandmould.report.optimum import OptimumPages, effort_sentence, optimum_pages, with_surface
from sandmould.report.robustness import RobustnessPages
from sandmould.report.tables import KeyNumber, data_files, key_numbers, runs_table, settings_table
from sandmould.runs.columns import DETAIL, RUN, finished
from sandmould.runs.files import replaced, write_text
from sandmould.runs.formatting import name_of, setting_text
from sandmould.runs.templates import Note, notes
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.answer import Asked
from sandmould.statistics.decision import Evidence, decide
from sandmould.statistics.settings import setting_rows
from sandmould.statistics.verdict import compare_settings
from sandmould.study.collect import Collected, read_collected, read_provenance, read_study
from sandmould.study.plan.ownership import owner_of, shipped_name
from sandmould.study.plan.plan_files import (
    FIGURES,
    SPHERES,
    STUDY_FILE,
    VERDICT_FILE,
    beyond_line,
    read_run,
)
from sandmould.study.plan.stand_ins import stand_ins
from sandmould.study.rounds.round_log import read_rounds
from sandmould.wording import next_steps
from sandmould.wording.answer import (
    detail_sentences,
    first_sentence,
    limit_sentences,
    main_effect_sentences,
    reasons_text,
)

LIMIT_BYTES = 15_000_000


def write_report(study_folder: Path, out: Path) -> None:
    """Write the report of a study, under 15 MB and without a single outside address.

    Its main figures are written as files too, into ``figures`` of the study's folder, its first
    sentence into ``VERDICT_FILE``, and films of more spheres than it holds into ``SPHERES``.

    Parameters
    ----------
    study_folder : Path
        ``results/<study>`` with its collected tables; runs may be missing, unfinished or broken.
    out : Path
        The HTML file; links to the data lead from its folder.

    Raises
    ------
    OSError, ValueError
        When a collected table cannot be read, or no run has a readable scenario.
    """
    study = read_study(study_folder)
    collected = read_collected(study_folder)
    # made first: the page lists it
    (study_folder / FIGURES).mkdir(exist_ok=True)
    page = _page(study_folder, out.absolute().parent, study, collected)
    environment = page_environment()
    for budget in (BUDGET_BYTES, BUDGET_BYTES // 4, BUDGET_BYTES // 20):
        text, figures, beside, first = _render(page, environment, budget)
        if len(text.encode("utf-8")) < LIMIT_BYTES:
            break
    with replaced(out) as partial:
        partial.write_text(text, encoding="utf-8")
        write_figures(study_folder / FIGURES, environment, figures)
        shutil.rmtree(study_folder / SPHERES, ignore_errors=True)
        for name, script in beside.items():
            (study_folder / SPHERES).mkdir(exist_ok=True)
            (study_folder / SPHERES / name).write_text(script, encoding="utf-8")
    write_text(study_folder / VERDICT_FILE, f"{first}\n")


def _page(study_folder: Path, home: Path, study: Study, collected: Collected) -> Findings[Any]:
    objective, keys, summary = study.objective, collected.keys, collected.of_sweep.summary
    seeks_best = study.seeks_best
    any_run = _first_of(study_folder, summary[RUN])
    if any_run is None:
        raise ValueError(f"{study_folder}: no run has a readable scenario.yaml")
    any_scenario = any_run.scenario
    is_controlled = bool(read_rounds(study_folder, study).certified_hz)
    notes = report_of(any_scenario).notes(any_scenario, collected, seeks_best, is_controlled)
    if not (study_folder / STUDY_FILE).exists():
        notes = (*notes, f"{STUDY_FILE} is missing: title and objective are the defaults.")
    verdict = compare_settings(summary, keys, objective.measure, objective.better)
    pictured_run = next(iter(pictured_runs(study_folder, summary, verdict).values()), "")
    listed = {setting.label for setting in listed_settings(verdict)}
    by_setting = {}
    for values, rows in setting_rows(summary, keys):
        label, own_runs = setting_text(values), summary.iloc[rows]
        if label in listed and (own := _first_of(study_folder, own_runs[RUN])):
            by_setting[label] = own.scenario, own_runs
    by_lot = kind_named(study.kind).draws_by_lot
    varied = tuple(key for key in keys if summary[key].astype(str).nunique() > 1)
    asked = Asked(
        objective.measure, objective.better, varied, objective.goal, by_lot, objective.beside
    )
    drives = _drives(by_setting)
    of_varied = {
        setting_text({key: s.values[key] for key in varied}): drives[s.label]
        for s in verdict.settings
        if s.label in drives
    }
    curves, placeholders = collected.of_sweep.curves, stand_ins(any_run)
    answer = decide(asked, Evidence(summary, curves, of_varied, placeholders, study.table_limit_at))
    relative = os.path.relpath(study_folder.absolute(), home)
    href = "" if relative == "." else quote(Path(relative).as_posix()) + "/"
    shown = _first_of(study_folder, [pictured_run] if pictured_run else []) or any_run
    scenario = shown.scenario
    return Findings(
        study_folder, href, study, collected, verdict, answer, scenario, by_setting, notes
    )


def _drives(by_setting: Mapping[str, tuple[AnyScenario, pd.DataFrame]]) -> dict[str, BoxDrive]:
    """Drives of the settings that have a vibrating table, by label."""
    every = {
        label: report_of(scenario).drive(scenario, runs)
        for label, (scenario, runs) in by_setting.items()
    }
    return {label: drive for label, drive in every.items() if drive is not None}


def _first_of(study_folder: Path, runs: Iterable[str]) -> Run | None:
    """The first run whose file can be read."""
    for run in runs:
        with contextlib.suppress(BadInputError, OSError):
            return read_run(study_folder / "runs" / str(run) / "scenario.yaml")
    return None


def _render(
    page: Findings[Any], environment: Environment, film_budget_bytes: int
) -> tuple[str, dict[str, Chart | bytes], Mapping[str, str], str]:
    """The page, its figures for files, scripts beside it, and the sentence that answers."""
    of_sweep, keys, verdict = page.collected.of_sweep, page.collected.keys, page.verdict
    answer = page.answer
    summary = page.collected.summary
    seeks_best = page.study.seeks_best
    agreement = agreement_pages(page.collected, page.study)
    estimate = estimate_pages(page)
    kind = report_of(page.scenario)
    robustness = kind.robustness(page)
    mode = robustness.mode if robustness else kind.mode(page)
    optimum = optimum_pages(page.study_folder, page.study, of_sweep.summary, robustness, mode)
    details = detail_sentences(answer)
    if page.study.adds_replicates:
        rounds = read_rounds(page.study_folder, page.study)
        details = (*details, effort_sentence(rounds, page.study, of_sweep.summary))
    drawn, drawn_verdict = drawn_part(of_sweep, verdict)
    charts = objective_charts(drawn.summary, drawn_verdict, keys)
    if optimum and optimum.optimum and len(keys) == 1:
        charts = tuple(with_surface(c, optimum.optimum, page.study) for c in charts)
    provenance = [read_provenance(page.study_folder / "runs" / str(r)) for r in summary[RUN]]
    of_kind = kind.pages(page, film_budget_bytes)
    method: tuple[Note, ...] = (
        *of_kind.method,
        *own_measures_method(page.study.own_measures),
        *statistics_method(
            page.study.objective, of_kind.ends, kind_named(page.study.kind).draws_by_lot
        ),
    )
    first = _first_screen(page, optimum, agreement, estimate, robustness, of_kind)
    statement = optimum or (agreement if agreement and agreement.is_question else estimate)
    is_verdict = statement is None or (seeks_best and optimum is None)
    text = environment.get_template(of_kind.template).render(
        title=page.study.title or page.study_folder.name,
        study_name=page.study_folder.name,
        verdict=verdict,
        measure_name=name_of(verdict.measure),
        keys=keys,
        seeks_best=seeks_best,
        agreement=agreement,
        estimate=estimate,
        optimum=optimum,
        robustness=robustness,
        answer=first,
        details=details,
        limits=(*limit_sentences(answer), *page.notes),
        statement=details if is_verdict or statement is None else statement.sentences,
        key_numbers=key_numbers(summary),
        objective_charts=[_both_sizes(c) for c in charts],
        drawn_note=drawn_note(of_sweep, verdict),
        settings=settings_table(verdict, _drives(page.by_setting)),
        runs=runs_table(summary, keys, verdict, f"{page.href}runs"),
        method=method,
        provenance=provenance_rows(provenance),
        files=data_files(page.study_folder, page.href),
        both_sizes=_both_sizes,
        multiples=small_multiples,
        half_sizes=lambda chart: (lay_out(chart, SMALL), lay_out(chart, NARROW)),
        advice=[] if optimum else _beside_mode(page, mode),
        found=(*main_effect_sentences(answer), *of_kind.findings),
        warning=of_kind.warning,
        picture=of_kind.picture,
        reported_best=page.study.objective.reported_best,
        **of_kind.context,
    )
    of_estimate = estimate_figures(estimate) if estimate else {}
    figures = {**numbered("objective", charts), **of_estimate, **of_kind.figures}
    return text, figures, of_kind.beside, first.headline


def _beyond_table(study: Study, scenario: Any, collected: Collected) -> tuple[Note, ...]:
    """Points of the sweep that the user's table cannot do: no run was planned of them."""
    keys = study.sweep.swept
    if not study.table_limits or not keys:
        return ()
    # by the sweep's own keys: the runs of a cross-check have their engine besides
    there = {setting_text(at) for at, _ in setting_rows(collected.of_sweep.summary, keys)}
    every = ({key: point[key] for key in keys} for point in points(study.sweep, scenario))
    left_out = [point for point in every if setting_text(point) not in there]
    line = beyond_line(left_out, study.table_limits).strip()
    return (Note("Table", line),) if line else ()


def _first_screen(
    page: Findings[Any],
    optimum: OptimumPages | None,
    agreement: AgreementPages | None,
    estimate: EstimatePages | None,
    robustness: RobustnessPages | None,
    of_kind: KindPages,
) -> FirstScreen:
    """The first screen."""
    study, collected, answer = page.study, page.collected, page.answer
    summary = collected.of_sweep.summary
    headline, is_sound = first_sentence(answer), answer.is_sound
    steps = next_steps.answer_steps(study, answer)
    figures: tuple[KeyNumber, ...] = ()
    table = None
    if optimum is not None:
        headline, is_sound = optimum_headline(
            optimum, robustness, answer, summary, study.certificate.sand_wave_speed is not None
        )
        assessed = robustness.assessment if robustness else None
        steps = next_steps.optimum_steps(study, optimum.optimum, assessed)
        is_artefact = assessed is not None and assessed.is_artefact
        figures = optimum_choice(optimum, summary, answer.verdict, is_artefact)
    elif agreement is not None and agreement.is_question:
        headline, is_sound = agreement.sentences[0], agreement.sound
        steps = [next_steps.step("take_cheapest" if agreement.sound else "differ")]
    elif estimate is not None:
        is_sound = is_sound and estimate.sound
        headline = of_kind.answer or estimate.headline or headline
        steps += next_steps.sand_steps(study, is_sound)
    else:
        figures, table = figures_of(answer, summary), table_of(answer)
    grounds = (
        *notes("unused.j2", reasons=reasons_text(answer.left_out), planned=answer.planned),
        *_beyond_table(study, page.scenario, collected),
        *of_kind.grounds,
        *([Note("Tests", robustness.sentences[0])] if robustness else []),
    )
    lost = collected.summary[~finished(collected.summary)]
    causes = dict(zip(lost[RUN].astype(str), lost[DETAIL].fillna("").astype(str), strict=True))
    steps = [*next_steps.failed_steps(causes), *steps, *of_kind.steps]
    steps += next_steps.certificate_steps(study, answer)
    if is_sound and study.seeks_best and not steps:
        steps.append(of_kind.at_last or next_steps.step("try", is_sand=study.kind == "sand"))
    owner = owner_of(page.study_folder)
    after = next_steps.with_file(steps, owner, shipped_name(owner), page.study_folder.name)
    return FirstScreen(headline, is_sound, figures, table, grounds, after)


def _beside_mode(page: Findings[Any], mode: BedMode | None) -> list[str]:
    """The best of swept frequencies over the first mode of the bed."""
    key, best = frequency_among(page.collected.keys), page.verdict.best
    if mode is None or best is None or not key or not page.study.seeks_best:
        return []
    return [mode.beside(float(best.values[key]))]


def _both_sizes(chart: Any) -> tuple[Any, Any]:
    """A chart laid out for a wide page and for a phone."""
    return lay_out(chart, WIDE), lay_out(chart, NARROW)
