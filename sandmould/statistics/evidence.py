"""Which runs of a study may count, and why the others are left out.

A run is evidence of a measure where it finished, has a value of it, and bent its pattern, if it
has one, by a loop that holds. Every mean, interval and recommendation rests on such runs alone. A
run whose loop lags, goes in cycles or diverged does not count, however small its value is. Its
value is shown.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np
import pandas as pd

from sandmould.runs.columns import DETAIL, LOOP, LOOP_ERROR, finished

UNTRUSTED = ("lags", "cycles", "diverged")
"""States of a loop whose shape is no answer."""
ONE_WAY = "one way"
OF_THE_LOOP = frozenset(
    {
        "pattern_residual_fraction", "pattern_force_left_fraction", "pattern_moment_left_fraction",
        "pattern_factor", "pattern_gain", "pattern_windows", "pattern_passes", "pattern_work_j",
        "pattern_energy_j", "pattern_stored_fraction", "pattern_predicted_gain",
        "pattern_predicted_limit", "pattern_outside_fraction", LOOP_ERROR,
    }
)  # fmt: skip
"""Measures of the loop itself: to learn how it fails, runs whose loop fails are the evidence."""
NOT_FINISHED, NO_VALUE = "did not finish", "no value"


def loop_fails(summary: pd.DataFrame, measure: str) -> pd.Series[bool]:
    """Whether a run finished and its loop alone keeps it from counting.

    ``measure``: what it would be evidence of: measures of the loop itself need no loop that holds.
    """
    if LOOP not in summary or measure in OF_THE_LOOP:
        return pd.Series(False, index=summary.index)
    return summary[LOOP].isin(UNTRUSTED) & finished(summary)


def left_out(summary: pd.DataFrame, measure: str) -> pd.Series[str]:
    """Why each run is no evidence of a measure; empty where it is.

    Gives ``NOT_FINISHED``, a state in ``UNTRUSTED``, ``NO_VALUE`` or an empty text, by row.
    """
    why = pd.Series("", index=summary.index, dtype=object)
    why[_numbers(summary, measure).isna()] = NO_VALUE
    fails = loop_fails(summary, measure)
    why[fails] = summary.loc[fails, LOOP] if LOOP in summary else NO_VALUE
    why[~finished(summary)] = NOT_FINISHED
    return why


def left_out_counts(summary: pd.DataFrame, measure: str) -> Mapping[str, int]:
    """How many runs are left out, by reason."""
    count = Counter(left_out(summary, measure))
    return {why: count[why] for why in (NOT_FINISHED, *UNTRUSTED, NO_VALUE) if count[why]}


def why_no_value(summary: pd.DataFrame, measure: str) -> str:
    """What the first run that finished without a value says of itself; empty for nothing."""
    if DETAIL not in summary:
        return ""
    details = summary.loc[left_out(summary, measure) == NO_VALUE, DETAIL].dropna()
    return next((text for text in details.astype(str) if text), "")


def usable_values(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    """Measure of each run, NaN where the run is no evidence of it."""
    return _numbers(summary, measure).where(left_out(summary, measure) == "")


def shown_values(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    """Measure of each run that finished, whether or not its loop holds."""
    return _numbers(summary, measure).where(finished(summary))


def one_way_runs(summary: pd.DataFrame) -> int:
    """How many runs never let the sand feel the pattern give way."""
    return int((summary[LOOP] == ONE_WAY).sum()) if LOOP in summary else 0


def _numbers(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    if measure not in summary:
        return pd.Series(np.nan, index=summary.index)
    return pd.to_numeric(summary[measure], errors="coerce")
