"""Charts of a study: a measure against time of every run, the objective against the settings.

And which runs are looked at besides.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.definition.study import Study
from sandmould.drawing.chart import PLAIN, Chart, Line, Mark, Tint, thinned, tints
from sandmould.drawing.figure_files import numbered
from sandmould.drawing.thinning import drawn_part
from sandmould.kinds.sand.moments import list_moments
from sandmould.runs.columns import OUTCOME, RUN, TIME_S, VIBRATION_TIME_S, during_vibration
from sandmould.runs.formatting import (
    display_scale,
    is_number,
    name_of,
    number,
    runs_text,
    setting_text,
    titled,
    value_text,
    with_margin,
)
from sandmould.statistics.evidence import left_out, shown_values, usable_values
from sandmould.statistics.settings import WIDE_KEY, Setting, group_settings, spans
from sandmould.statistics.verdict import FEW, Verdict, compare_settings, rank_runs
from sandmould.study.collect import Collected
from sandmould.wording.answer import why_unused

_POINTS = 12_000
"""Points of all curves of one chart; more would only make the page heavy."""
_SHOWN_BELOW = 0.01
"""Share of the least end to which a logarithmic axis reaches down: curves may begin at nothing."""
_MOST_LABELS = 18
_MOST_ROWS = 30


def setting_tints(verdict: Verdict, keys: Sequence[str]) -> dict[str, Tint]:
    """Colour of each setting by label: a run of colours along a scale, else one for each."""
    n = len(verdict.settings)
    if are_on_a_scale(verdict, keys):
        return dict(zip((s.label for s in verdict.settings), tints(n, True), strict=True))
    if n <= 7:
        return dict(zip((s.label for s in verdict.settings), tints(n, False), strict=True))
    best = verdict.best.label if verdict.best else ""
    return {s.label: tints(1, False)[0] if s.label == best else PLAIN for s in verdict.settings}


def reported_lines(study: Study, key: str, low: float, high: float) -> list[Line]:
    """Upright lines where others found the best value of the swept key; labels at their foot.

    There is room: under a best value the chart is empty.
    """
    return [
        Line(
            np.array([[reported.value, high], [reported.value, low]]), PLAIN,
            label=value_text(key, reported.value), title=f"best by {reported.by}",
        )
        for reported in study.objective.reported_best
    ]  # fmt: skip


def are_on_a_scale(verdict: Verdict, keys: Sequence[str]) -> bool:
    """Whether the settings are several numbers of one key."""
    values = [s.values[key] for s in verdict.settings for key in keys]
    numbers = all(is_number(v) and math.isfinite(v) for v in values)
    return len(keys) == 1 and len(values) > 1 and numbers


def runs_by_setting(summary: pd.DataFrame, keys: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Rows of the summary at every setting, by its label."""
    return {setting_text(values): rows for values, rows in group_settings(summary, keys)}


def pictured_runs(study_folder: Path, summary: pd.DataFrame, verdict: Verdict) -> dict[str, str]:
    """Runs to be looked at, by role: of the best setting, median and worst, or what there is.

    Of the best setting it is the run in the middle, not the luckiest. Where one run can be used it
    is the only one. Where none can, that with most snapshots stands alone: to see how it failed.
    """
    ranks = rank_runs(summary, verdict.measure, verdict.better)
    if "best" in ranks and verdict.best is not None:
        rows = runs_by_setting(summary, list(verdict.best.values))[verdict.best.label]
        own = rank_runs(rows, verdict.measure, verdict.better)
        best = own.get("median", own["best"])
        others = {role: run for role, run in ranks.items() if role != "best" and run != best}
        ranks = {"best": best, **others}
    with_snapshots = {
        r: run for r, run in ranks.items() if list_moments(study_folder / "runs" / run)
    }
    if with_snapshots:
        return with_snapshots if len(ranks) > 1 else {"only": next(iter(with_snapshots.values()))}
    count = {str(r): len(list_moments(study_folder / "runs" / str(r))) for r in summary[RUN]}
    longest = max(count, key=lambda r: count[r], default="")
    return {"longest": longest} if count.get(longest) else {}


def time_chart(
    curves: pd.DataFrame, summary: pd.DataFrame, verdict: Verdict, keys: Sequence[str], measure: str
) -> Chart | None:
    """A measure over the time of vibration: each run thin, means thick; None if unknown."""
    if measure not in curves or not curves[measure].notna().any():
        return None
    shaken = during_vibration(curves)
    clock = VIBRATION_TIME_S if len(shaken) else TIME_S
    charted = shaken if len(shaken) else curves
    factor, what = display_scale(measure)
    xy_all = charted[[clock, measure]].to_numpy(dtype=np.float64) * [1.0, factor]
    log_y = not (xy_all[:, 1] < 0.0).any() and _ends_wide(summary, verdict, keys, measure)
    if log_y:
        least = factor * float(usable_values(summary, measure).min())
        xy_all[:, 1] = np.maximum(xy_all[:, 1], _SHOWN_BELOW * least)
    by_run = {str(run): xy_all[rows] for run, rows in charted.groupby(RUN).indices.items()}
    stride = len(charted) // _POINTS
    colour = setting_tints(verdict, keys)
    labelled = _labelled(verdict)
    lines: list[Line] = []
    means: list[Line] = []
    rows_of = runs_by_setting(summary, keys)
    for setting in verdict.settings:
        rows = rows_of[setting.label]
        tint = colour[setting.label]
        complete: list[NDArray[np.float64]] = []
        reasons = left_out(rows, measure)
        for run, why, outcome in zip(rows[RUN], reasons, rows[OUTCOME], strict=True):
            if str(run) not in by_run:
                continue
            xy = by_run[str(run)]
            ended = f", {why_unused(why) or outcome}" if why else ""
            title = f"{run}: {setting.label}{ended}"
            lines.append(Line(thinned(xy, stride), tint, title=title, group=setting.label))
            if not why:
                complete.append(xy[np.isfinite(xy).all(axis=1)])
        mean = _mean_curve(complete)
        if mean is not None:
            label = setting.label if setting.label in labelled else ""
            title = f"{setting.label}, mean of {len(complete)}"
            means.append(Line(thinned(mean, stride), tint, "mean", label, title, setting.label))
    when = "time of vibration, s" if clock == VIBRATION_TIME_S else "time, s"
    return Chart(when, what, _alt(what, when, means), tuple(lines + means), log_y=log_y)


def measure_curves(
    collected: Collected, verdict: Verdict, measures: Sequence[str]
) -> tuple[Chart, ...]:
    """Charts of measures against time, those that no run has left out."""
    drawn, part = drawn_part(collected, verdict)
    every = (
        time_chart(drawn.curves, drawn.summary, part, collected.keys, each) for each in measures
    )
    return tuple(chart for chart in every if chart is not None)


def curve_figures(curves: Iterable[Chart]) -> dict[str, Chart]:
    """Measures over time, as files."""
    return numbered("curves", curves)


def _ends_wide(summary: pd.DataFrame, verdict: Verdict, keys: Sequence[str], measure: str) -> bool:
    """Whether settings end so far apart in a measure that its logarithm is drawn."""
    if measure == verdict.measure:
        return verdict.is_wide
    return measure in summary and compare_settings(summary, keys, measure).is_wide


def _labelled(verdict: Verdict) -> set[str]:
    """Settings named in the chart: all, or of too many the ends and the two best."""
    if len(verdict.settings) <= _MOST_LABELS:
        return {s.label for s in verdict.settings}
    chosen = [verdict.settings[0], verdict.settings[-1], verdict.best, verdict.runner_up]
    return {s.label for s in chosen if s is not None}


def _mean_curve(curves: Sequence[NDArray[np.float64]]) -> NDArray[np.float64] | None:
    """Mean of curves at the times of the first, as far as all of them reach."""
    curves = [c for c in curves if len(c)]
    if not curves:
        return None
    start, end = max(c[0, 0] for c in curves), min(c[-1, 0] for c in curves)
    time = curves[0][:, 0]
    # times of replicates differ by a step of the engine, never by an interval
    slack = 1e-3 * (end - start)
    time = time[(time >= start - slack) & (time <= end + slack)]
    values = np.mean([np.interp(time, c[:, 0], c[:, 1]) for c in curves], axis=0)
    return np.column_stack([time, values])


def _alt(what: str, when: str, means: Sequence[Line]) -> str:
    ends = "; ".join(
        f"{m.title} ends at {number(m.xy[-1, 1])}" for m in means[:_MOST_LABELS] if len(m.xy)
    )
    return f"Curves of {what} against {when}. {ends}."


def objective_charts(
    summary: pd.DataFrame, verdict: Verdict, keys: Sequence[str]
) -> tuple[Chart, ...]:
    """The objective of every run and the mean of each setting with its 95 % interval.

    Over its axis for one numeric key, in rows for other settings, and for many settings of
    several keys as one cloud of points a key.

    Empty where no run has a value or nothing is swept.
    """
    if not keys or not shown_values(summary, verdict.measure).notna().any():
        return ()
    if are_on_a_scale(verdict, keys):
        return (_scale_chart(summary, verdict, keys[0]),)
    if len(verdict.settings) <= _MOST_ROWS:
        return (_row_chart(summary, verdict),)
    values = usable_values(summary, verdict.measure)
    factor, what = display_scale(verdict.measure)
    (tint,), charts = tints(1, False), []
    for key in (k for k in keys if pd.api.types.is_numeric_dtype(summary[k])):
        alt = f"{name_of(verdict.measure)} of every run against {titled(key)}."
        marks = tuple(
            Mark(float(x), factor * float(y), "run", tint, title=f"{run}: {number(y)}")
            for run, x, y in zip(summary[RUN], summary[key], values, strict=True)
            if math.isfinite(y)
        )
        log_x = spans(summary[key], WIDE_KEY)
        chart = Chart(titled(key), what, alt, marks=marks, log_x=log_x, log_y=verdict.is_wide)
        charts.append(chart)
    return tuple(charts)


def _scale_chart(summary: pd.DataFrame, verdict: Verdict, key: str) -> Chart:
    """Points over a numeric key, means joined by a line."""
    colour = setting_tints(verdict, [key])
    places = [float(s.values[key]) for s in verdict.settings]
    factor, what = display_scale(verdict.measure)
    marks: list[Mark] = []
    rows_of = runs_by_setting(summary, [key])
    for setting, x in zip(verdict.settings, places, strict=True):
        tint = colour[setting.label]
        for place, mark in enumerate(_run_marks(rows_of[setting.label], verdict, tint)):
            # side by side to the left of the mean
            shift_px = -9.0 - min(place * 3.5, 21.0)
            marks.append(replace(mark, x=x, shift_px=shift_px))
        if setting.n:
            marks.append(_mean_mark(setting, x, factor * setting.mean, tint, factor))
    joined = [(x, factor * s.mean) for s, x in zip(verdict.settings, places, strict=True) if s.n]
    line = (Line(np.array(joined), PLAIN, "joined", title="means"),) if joined else ()
    return Chart(
        titled(key),
        what,
        _settings_alt(verdict),
        line,
        tuple(marks),
        x_ticks=tuple(places) if len(places) <= 12 else (),
        log_x=spans(places, WIDE_KEY),
        log_y=verdict.is_wide,
    )


def _row_chart(summary: pd.DataFrame, verdict: Verdict) -> Chart:
    """One row a setting, the highest mean on top."""
    factor, what = display_scale(verdict.measure)
    ranked = sorted(verdict.settings, key=lambda s: -s.mean if s.n else math.inf)
    marks: list[Mark] = []
    rows_of = runs_by_setting(summary, list(ranked[0].values))
    for row, setting in enumerate(ranked):
        tint = tints(1, False)[0] if setting is verdict.best else PLAIN
        marks += [
            replace(m, x=m.y, y=row)
            for m in _run_marks(rows_of[setting.label], verdict, tint)
            if m.kind != "failed"
        ]
        if setting.n:
            marks.append(_mean_mark(setting, factor * setting.mean, row, tint, factor))
    return Chart(
        what,
        "",
        _settings_alt(verdict),
        marks=tuple(marks),
        rows=tuple(s.label for s in ranked),
        log_x=verdict.is_wide,
    )


def _run_marks(rows: pd.DataFrame, verdict: Verdict, tint: Tint) -> list[Mark]:
    """Marks of a setting's runs, given their rows; x is left to the caller."""
    values = shown_values(rows, verdict.measure)
    factor = display_scale(verdict.measure)[0]
    marks = []
    reasons = left_out(rows, verdict.measure)
    for run, why, outcome, value in zip(rows[RUN], reasons, rows[OUTCOME], values, strict=True):
        because = why_unused(why) or outcome
        if math.isfinite(value):
            title = f"{run}: {number(value)}{f', {because}' if why else ''}"
            kind = "doubtful" if why else "run"
            marks.append(Mark(math.nan, factor * value, kind, tint, title=title))
        else:
            marks.append(Mark(math.nan, math.nan, "failed", tint, title=f"{run}: {because}"))
    return marks


def _mean_mark(setting: Setting, x: float, y: float, tint: Tint, factor: float) -> Mark:
    reach = setting.ci_half_width
    mean = with_margin(setting.mean, reach)
    title = f"{setting.label}: mean {mean}, {runs_text(setting.n)}"
    # Student's t of two runs is 13 standard errors: a bar that tells nothing of the sand.
    drawn = factor * reach if setting.n >= FEW else math.nan
    return Mark(x, y, "mean", tint, drawn, title)


def _settings_alt(verdict: Verdict) -> str:
    parts = [f"{s.label}: {number(s.mean)}, {runs_text(s.n)}" for s in verdict.settings if s.n]
    return f"Mean {name_of(verdict.measure)} by setting. {'; '.join(parts)}."
