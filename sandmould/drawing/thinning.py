"""A study of thousands of runs on one page: which of them are drawn and listed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from sandmould.drawing.animation import evenly
from sandmould.runs.columns import RUN
from sandmould.runs.formatting import setting_text
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.settings import Setting, setting_rows
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected

MOST_SETTINGS = 120
"""Settings in a chart or a table: more curves hide each other, and nobody reads more rows."""
MOST_RUNS = 600
"""Runs in a chart, and rows of the table of runs: a browser sorts these at once."""


def drawn_part(collected: Collected, verdict: Verdict) -> tuple[Collected, Verdict]:
    """What charts show: everything, or settings evenly over the sweep with the two best.

    Means, intervals and comparisons are those of all runs.
    """
    summary, settings = collected.summary, verdict.settings
    if len(settings) <= MOST_SETTINGS and len(summary) <= MOST_RUNS:
        return collected, verdict
    # over the whole sweep in its order, the two best among them
    labels = {settings[place].label for place in evenly(len(settings), MOST_SETTINGS - 2).tolist()}
    labels |= {s.label for s in (verdict.best, verdict.runner_up) if s is not None}
    chosen = tuple(s for s in settings if s.label in labels)
    each = max(1, MOST_RUNS // len(chosen))
    rows = {setting_text(at): own[:each] for at, own in setting_rows(summary, collected.keys)}
    drawn = summary.iloc[np.concatenate([rows[setting.label] for setting in chosen])]
    curves = collected.curves[collected.curves[RUN].isin(set(drawn[RUN]))]
    return replace(collected, summary=drawn, curves=curves), replace(verdict, settings=chosen)


def drawn_note(collected: Collected, verdict: Verdict) -> str:
    """Say what the charts leave out; empty where they show everything."""
    drawn, of = drawn_part(collected, verdict)
    if drawn is collected:
        return ""
    settings = f"{len(of.settings)} of {len(verdict.settings)} settings"
    return (
        f"Charts show {settings}, evenly over the sweep with the two best. They draw "
        f"{len(drawn.summary)} of {len(collected.summary)} runs. Means and intervals of settings "
        "are those of all their runs."
    )


def listed_settings(verdict: Verdict) -> tuple[Setting, ...]:
    """Settings that a table lists: all, or the best and those that come nearest to it."""
    if len(verdict.settings) <= MOST_SETTINGS:
        return verdict.settings
    nearest = [c.other for c in verdict.comparisons[: MOST_SETTINGS - 1]]
    labels = {*nearest, verdict.best.label if verdict.best else ""}
    return tuple(s for s in verdict.settings if s.label in labels) or verdict.settings[:1]


def listed_runs(summary: pd.DataFrame, verdict: Verdict) -> pd.DataFrame:
    """Rows that the table of runs lists: all, or those that failed and then the best."""
    if len(summary) <= MOST_RUNS:
        return summary
    values = usable_values(summary, verdict.measure)
    best_first = values.sort_values(ascending=verdict.better == "smaller", kind="stable").index
    failed = summary.index[values.isna()]
    order = [*failed, *best_first.difference(failed, sort=False)]
    return summary.loc[sorted(order[:MOST_RUNS])]


def listed_note(listed: int, total: int, what: str, how: str) -> str:
    """Say what a table leaves out; empty where it lists everything."""
    return f"Listed are {listed} of {total} {what}: {how}." if listed < total else ""
