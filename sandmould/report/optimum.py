"""The report's answer of a study that looks for an optimum: where it lies, how flat it is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pandas as pd

from sandmould.definition.certificate import frequency_key
from sandmould.definition.study import Study
from sandmould.drawing.chart import PLAIN, Chart, Line, tints
from sandmould.report.bed_mode import BedMode
from sandmould.report.curves import reported_lines
from sandmould.report.robustness import RobustnessPages
from sandmould.runs.columns import CPU_S, total_s
from sandmould.runs.formatting import display_scale, number, unit_of, with_margin
from sandmould.runs.templates import sentences, worded
from sandmould.statistics.emulator import TooFewRunsError
from sandmould.statistics.mean_tests import CONFIDENCE
from sandmould.statistics.optimum import Optimum, find_optimum
from sandmould.statistics.recommendation import Recommendation, Why, recommend
from sandmould.study.rounds.round_log import RoundLog, read_rounds
from sandmould.wording.robustness import recommendation_sentence, robustness_sentences

WRONG = {"frequency_hz": 10.0}
"""By how much a key may be set wrong in a foundry; others by a tenth of their range."""
SHARE_LOST = 0.05
"""Of the best value, what counts as no worse where the study sets no margin."""
TWO_SIDED = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2)
"""Standard errors on either side of a mean that its interval holds."""


@dataclass(frozen=True)
class OptimumPages:
    """What the report says of the optimum."""

    sentences: tuple[str, ...]
    sound: bool
    """Whether the optimum lies inside the sweep, as narrow as asked."""
    optimum: Optimum | None
    recommendation: Recommendation | None = None
    """A frequency for the table, or why none is named; None where its controls were not run."""


def optimum_pages(
    study_folder: Path,
    study: Study,
    summary: pd.DataFrame,
    robustness: RobustnessPages | None = None,
    mode: BedMode | None = None,
) -> OptimumPages | None:
    """Say where the optimum of a study with rounds or controls lies; None for others.

    What ``robustness`` says comes first where the optimum is an artefact, or where no frequency is
    recommended; ``mode`` is told beside a frequency.
    """
    if not (study.refine.adds_points or study.certificate.controls):
        return None
    log, objective = read_rounds(study_folder, study), study.objective
    keys = study.sweep.swept
    try:
        optimum = find_optimum(summary, keys, objective.measure, objective.better)
    except TooFewRunsError as error:
        return OptimumPages((f"No optimum can be told: {error}.",), False, None)
    ends = [key for key in keys if optimum.at_end(key)]
    wide = [
        key
        for key, width in study.refine.interval.items()
        if optimum.interval(key)[1] - optimum.interval(key)[0] > width
    ]
    mean, se = optimum.value
    said = [
        *sentences(
            "optimum_found.j2",
            it=optimum,
            measure=objective.measure,
            ends=ends,
            value=with_margin(mean, TWO_SIDED * se),
            flats=[_flat(optimum, study, key) for key in keys],
            reported=objective.reported_best if len(keys) == 1 else (),
        )
    ]
    if mode and (key := frequency_key(study.sweep)):
        said.insert(1, mode.beside(optimum.setting[key]))
    if study.refine.rounds:
        said.append(effort_sentence(log, study, summary))
    sound = not ends and not wide and not optimum.is_vague
    advised = None
    if robustness is not None:
        opening = robustness_sentences(robustness.assessment)[:1]
        advised = _advised(optimum, study, robustness)
        told = [*opening, *([recommendation_sentence(advised)] if advised else [])]
        is_first = robustness.assessment.is_artefact or (
            advised is not None and advised.interval_hz is None
        )
        said = [*told, *said] if is_first else [said[0], *told, *said[1:]]
        is_advised = advised is not None and advised.interval_hz is not None
        sound = sound and is_advised and robustness.assessment.is_sound
    return OptimumPages(tuple(said), sound, optimum, advised)


def _advised(optimum: Optimum, study: Study, robustness: RobustnessPages) -> Recommendation | None:
    """A frequency for the table, where the springs allow one."""
    key = frequency_key(study.sweep)
    if robustness.mode is None or robustness.assessment.springs is None or not key:
        return None
    if optimum.at_end(key):
        return Recommendation(None, Why.AT_END)
    sand = study.certificate.sand_wave_speed
    return recommend(robustness.assessment, optimum.interval(key), robustness.mode.wave_speed, sand)


def _flat(optimum: Optimum, study: Study, key: str) -> dict[str, Any]:
    """How far a key may be off without harm, and what a usual error costs."""
    set_margin = study.equivalence.margins.get(study.objective.measure)
    margin = set_margin or SHARE_LOST * abs(optimum.value[0])
    off = WRONG.get(key.rsplit(".", 1)[-1])
    if off is None:
        values = optimum.points[:, optimum.keys.index(key)]
        off = float(f"{0.1 * (values.max() - values.min()):.1g}")
    losses = {"low": optimum.loss(key, -off), "high": optimum.loss(key, off)}
    return {
        "key": key,
        "reach": optimum.no_worse(key, margin),
        "margin": margin,
        "is_set": bool(set_margin),
        "off": off,
        "losses": {side: loss for side, loss in losses.items() if not math.isnan(loss)},
    }


def effort_sentence(log: RoundLog, study: Study, summary: pd.DataFrame) -> str:
    """What the rounds added to the sweep, and why they ended."""
    return worded(
        "effort.j2",
        rounds=len(log.rounds),
        added=len(log.runs),
        swept=study.sweep.number_of_points * study.replicates,
        spent_h=total_s(summary, CPU_S) / 3600,
        ended=log.ended,
    )


def with_surface(chart: Chart, optimum: Optimum, study: Study) -> Chart:
    """The objective's chart over one key with fit, error, interval and what others found best."""
    mean, se = optimum.surface
    factor = display_scale(study.objective.measure)[0]
    x, tint = optimum.points[:, 0], tints(1, False)[0]
    lines = [Line(np.column_stack([x, factor * mean]), tint, "mean", title="fitted mean")]
    for sign in (-1.0, 1.0):
        edge = factor * (mean + sign * TWO_SIDED * se)
        lines.append(Line(np.column_stack([x, edge]), PLAIN, title="95 % of the fitted mean"))
    key = optimum.keys[0]
    reach = factor * TWO_SIDED * se
    foot, top = float((factor * mean - reach).min()), float((factor * mean + reach).max())
    lines += reported_lines(study, key, foot, top)
    low, high = optimum.interval(key)
    alt = (
        f"{chart.alt} The fitted curve is best at {number(optimum.setting[key])} {unit_of(key)}, "
        f"95 % interval {number(low)} to {number(high)}."
    )
    # the fit is one of the values, not of their logarithms
    return replace(chart, lines=tuple(lines), band=(low, high), alt=alt, log_y=False)
