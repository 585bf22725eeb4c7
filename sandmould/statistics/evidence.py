"""Which runs of a study may count, and why the others are left out.

A run is evidence of a measure where it finished, has a value of it, and bent its pattern, if it
has one, by a loop that can be trusted. Every mean, interval and recommendation rests on such runs
alone.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pandas as pd

from sandmould.runs.columns import LOOP, finished
from sandmould.runs.formatting import listed

UNTRUSTED = {"lags": "lags", "cycles": "goes in cycles", "diverged": "diverged"}
"""States of a loop whose shape is no answer, and how a sentence says them."""
ONE_WAY = "one way"
OF_THE_LOOP = frozenset(
    {
        "pattern_residual_fraction", "pattern_force_left_fraction", "pattern_moment_left_fraction",
        "pattern_factor", "pattern_gain", "pattern_windows", "pattern_passes", "pattern_work_j",
        "pattern_energy_j", "pattern_stored_fraction", "pattern_predicted_gain",
        "pattern_predicted_limit", "pattern_outside_fraction",
    }
)  # fmt: skip
"""Measures of the loop itself: to learn how it fails, runs whose loop fails are the evidence."""
NOT_FINISHED, NO_VALUE = "did not finish", "no value"


def barred(summary: pd.DataFrame, measure: str) -> pd.Series[str]:
    """Why each run may not count, whatever its value; empty where it may.

    Parameters
    ----------
    summary : DataFrame
        One row a run.
    measure : str
        What it would be evidence of: measures of the loop itself need no loop that holds.

    Returns
    -------
    Series of str
        ``NOT_FINISHED``, a state in ``UNTRUSTED`` or an empty text, by row.
    """
    why = pd.Series("", index=summary.index, dtype=object)
    if LOOP in summary and measure not in OF_THE_LOOP:
        untrusted = summary[LOOP].isin(list(UNTRUSTED))
        why[untrusted] = summary.loc[untrusted, LOOP]
    why[~finished(summary)] = NOT_FINISHED
    return why


def left_out(summary: pd.DataFrame, measure: str) -> pd.Series[str]:
    """Why each run is no evidence of a measure, ``NO_VALUE`` among the reasons; see ``barred``."""
    why = barred(summary, measure)
    return why.where((why != "") | _numbers(summary, measure).notna(), NO_VALUE)


def usable_values(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    """Measure of each run, NaN where the run is no evidence of it."""
    return _numbers(summary, measure).where(barred(summary, measure) == "")


def _numbers(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    if measure not in summary:
        return pd.Series(np.nan, index=summary.index)
    return pd.to_numeric(summary[measure], errors="coerce")


def reason_text(why: str, outcome: str) -> str:
    """Why one run is not used, as a title or a note says it; empty where it is used."""
    if why == NOT_FINISHED:
        return outcome
    if why in UNTRUSTED:
        return f"not used: its loop {UNTRUSTED[why]}"
    return "not used: no value of the objective" if why else ""


def reasons_sentence(summary: pd.DataFrame, measure: str) -> str:
    """How many runs are left out, by reason, in words; empty where none is."""
    count = Counter(why for why in left_out(summary, measure) if why)
    said = []
    if n := count[NOT_FINISHED]:
        said.append(f"{n} did not finish")
    said += [f"in {n} the loop {how}" for state, how in UNTRUSTED.items() if (n := count[state])]
    if n := count[NO_VALUE]:
        said.append(f"{n} {'has' if n == 1 else 'have'} no value")
    return listed(said)


def one_way_caveat(summary: pd.DataFrame) -> str:
    """Say how many runs never let the sand feel the pattern give way; empty where none."""
    n = int((summary[LOOP] == ONE_WAY).sum()) if LOOP in summary else 0
    if not n:
        return ""
    runs = "the one run" if len(summary) == 1 else f"{n} of {len(summary)} runs"
    return f"In {runs} the loop is one way: the sand never felt the pattern give way."
