"""How a cavity fills: over what is swept at several times, its two limbs, and how long it takes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy
from numpy.typing import NDArray

from sandmould.analysis.spectrum import Limb, fit_limbs
from sandmould.definition.study import Study
from sandmould.drawing.chart import Chart, Line, tints
from sandmould.report.curves import are_on_a_scale, reported_lines, runs_by_setting
from sandmould.runs.columns import RUN, VIBRATION_TIME_S, during_vibration
from sandmould.runs.formatting import name_of, number, titled, value_text, with_margin
from sandmould.runs.templates import worded
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.evidence import left_out
from sandmould.statistics.mean_tests import CONFIDENCE
from sandmould.statistics.settings import Setting
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected

SHARES = (0.125, 0.25, 0.5, 1.0)
"""Of the vibration: the times of the chart."""
_EARLY = 1 + SHARES.index(0.25)
"""Time that rates are taken over: before a cavity that fills fast is full."""


@dataclass(frozen=True)
class FillingPages:
    """What the report says of the filling of a cavity."""

    chart: Chart
    """Fill over the swept key at several times, as figure 16 of the paper."""
    limbs: str


def filling_pages(
    study: Study, collected: Collected, verdict: Verdict, scenario: Scenario
) -> FillingPages | None:
    """Say how a cavity fills; None for studies of something else."""
    best, measure = verdict.best, verdict.measure
    if best is None or not scenario.vibrations or not measure.endswith("_fill_fraction"):
        return None
    shaken = _shaken(collected, measure)
    if measure not in shaken or shaken.empty:
        return None
    keys = collected.keys
    settings = [s for s in verdict.settings if s.n]
    if not are_on_a_scale(verdict, keys) or len(settings) < 3:
        return None
    table = _fill_at_times(collected.summary, shaken, settings, keys[0], measure)
    return FillingPages(_chart(table, study, keys[0], measure), _limbs(table, keys[0], measure))


def _shaken(collected: Collected, measure: str) -> pd.DataFrame:
    """Curves of usable runs during vibration."""
    summary, curves = collected.summary, collected.curves
    used = summary.loc[left_out(summary, measure) == "", RUN]
    return during_vibration(curves[curves[RUN].isin(used)])


@dataclass(frozen=True)
class _AtTimes:
    x: NDArray[np.float64]
    """(s,) the swept values, ascending."""
    time_s: NDArray[np.float64]
    """(t,) from the start of vibration; the first is 0."""
    mean: NDArray[np.float64]
    """(s, t)."""
    gained_se: NDArray[np.float64]
    """(s, t) standard error of what was gained since the start; NaN for a single run."""


def _fill_at_times(
    summary: pd.DataFrame,
    shaken: pd.DataFrame,
    settings_with_runs: list[Setting],
    key: str,
    measure: str,
) -> _AtTimes:
    clock_s = shaken[VIBRATION_TIME_S].to_numpy(dtype=np.float64)
    fill = shaken[measure].to_numpy(dtype=np.float64)
    rows_of = shaken.groupby(RUN).indices
    runs_at = runs_by_setting(summary[[RUN, key]], [key])
    last_s = float(shaken.groupby(RUN)[VIBRATION_TIME_S].max().min())
    time_s = last_s * np.array([0.0, *SHARES])
    settings = sorted(settings_with_runs, key=lambda s: float(s.values[key]))
    mean, error = [], []
    for setting in settings:
        runs = []
        for run in runs_at[setting.label][RUN]:
            if run in rows_of:
                rows = rows_of[run]
                runs.append(np.interp(time_s, clock_s[rows], fill[rows]))
        values = np.array(runs)
        gained = values - values[:, :1]
        mean.append(values.mean(axis=0))
        few = len(values) < 2
        sd = np.full(len(time_s), math.nan) if few else gained.std(axis=0, ddof=1)
        error.append(sd / math.sqrt(len(values)))
    x = np.array([float(s.values[key]) for s in settings])
    return _AtTimes(x, time_s, np.array(mean), np.array(error))


def _chart(table: _AtTimes, study: Study, key: str, measure: str) -> Chart:
    colours = tints(len(table.time_s), True)
    lines = []
    for time_s, mean, tint in zip(table.time_s, table.mean.T, colours, strict=True):
        xy, time = np.column_stack([table.x, mean]), f"{number(time_s, 2)} s"
        lines.append(Line(xy, tint, "mean", time, f"after {time} of vibration"))
    low, high = float(np.nanmin(table.mean)), float(np.nanmax(table.mean))
    lines += reported_lines(study, key, low, high)
    alt = f"{name_of(measure)} against {titled(key)} at {len(table.time_s)} times of the vibration."
    ticks = tuple(table.x.tolist()) if len(table.x) <= 12 else ()
    return Chart(titled(key), name_of(measure), alt, tuple(lines), x_ticks=ticks)


def _limbs(table: _AtTimes, key: str, measure: str) -> str:
    """How the rate of filling rises and falls with the swept key, as power laws."""
    gained = table.mean[:, _EARLY] - table.mean[:, 0]
    given = {"measure": measure, "key": key, "early_s": table.time_s[_EARLY]}
    if not (gained > 0).any():
        return worded("limbs.j2", **given, turn="")
    limbs = fit_limbs(table.x, gained, table.gained_se[:, _EARLY])
    sides = (
        ("Up to there", "rises", limbs.rise and _exponent(limbs.rise)),
        ("From there", "falls", limbs.fall and _exponent(limbs.fall)),
    )
    return worded("limbs.j2", **given, turn=value_text(key, limbs.turn), sides=sides)


def _exponent(limb: Limb) -> str:
    """An exponent with its 95 % interval, two degrees of freedom less than points."""
    reach = float(scipy.special.stdtrit(limb.points - 2, 0.5 + CONFIDENCE / 2)) * limb.se
    return f"{with_margin(limb.exponent, reach)} ({limb.points} settings)"
