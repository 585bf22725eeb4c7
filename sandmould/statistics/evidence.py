"""Which runs of a study may count, and why the others are left out.

A run is evidence of a measure where it finished, has a value of it, and bent its pattern, if it
has one, by a loop that can be trusted. Every mean, interval and recommendation rests on such runs
alone, with one exception. Where a loop lags or goes in cycles, how far the shape may be off is
known: the error of the loop. A length of the pattern then counts in a comparison of settings, as
long as its error is less than the pattern's displacement. The error does not shrink with the number
of runs, so it is added to every interval that the run enters: a difference is told from chance only
where it is larger than what fillings scatter and loops leave open together.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pandas as pd

from sandmould.runs.columns import LOOP, LOOP_ERROR, finished
from sandmould.runs.formatting import display_number, listed

UNTRUSTED = {"lags": "lags", "cycles": "goes in cycles", "diverged": "diverged"}
"""States of a loop whose shape is no answer, and how a sentence says them."""
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
OF_THE_SHAPE = frozenset(
    {
        "pattern_tip_deflection_m", "pattern_largest_displacement_m", "pattern_distance_largest_m",
        "pattern_distance_rms_m", "pattern_tip_answered_m", "pattern_tip_filled_m",
        "pattern_tip_recovered_m",
    }
)  # fmt: skip
"""Lengths of the pattern: its displacement times the error of the loop is how far they may be off.
"""
MOST_ERROR = 1.0
"""Error of a loop, over the displacement of its pattern, at which its shape tells nothing."""
_DISPLACEMENTS = ("pattern_largest_displacement_m", "pattern_tip_filled_m")
"""The larger one is what the error of a loop is a share of."""
NOT_FINISHED, NO_VALUE = "did not finish", "no value"


def loop_errors(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    """How far the loop of each run leaves its value open, in the unit of the measure.

    Parameters
    ----------
    summary : DataFrame
        One row a run.
    measure : str

    Returns
    -------
    Series of float
        0 where the loop holds, or where the measure is one of the loop itself; NaN where a loop
        that does not hold tells no error of the measure.
    """
    errors = pd.Series(0.0, index=summary.index)
    if LOOP not in summary or measure in OF_THE_LOOP:
        return errors
    untrusted = summary[LOOP].isin(list(UNTRUSTED))
    if measure not in OF_THE_SHAPE:
        return errors.mask(untrusted)
    lengths = [_numbers(summary, c).abs() for c in _DISPLACEMENTS]
    length = pd.concat(lengths, axis=1).max(axis=1)
    return errors.mask(untrusted, _numbers(summary, LOOP_ERROR) * length)


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
    errors = loop_errors(summary, measure)
    if (errors != 0.0).any():
        too_large = errors.isna() | (_numbers(summary, LOOP_ERROR) >= MOST_ERROR)
        unknown = (errors != 0.0) & too_large
        why[unknown] = summary.loc[unknown, LOOP]
    why[~finished(summary)] = NOT_FINISHED
    return why


def loop_barred(summary: pd.DataFrame, measure: str) -> pd.Series[bool]:
    """Whether a run finished and its loop alone keeps it from counting."""
    return barred(summary, measure).isin(list(UNTRUSTED))


def left_out(summary: pd.DataFrame, measure: str) -> pd.Series[str]:
    """Why each run is no evidence of a measure, ``NO_VALUE`` among the reasons; see ``barred``."""
    why = barred(summary, measure)
    return why.where((why != "") | _numbers(summary, measure).notna(), NO_VALUE)


def usable_values(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    """Measure of each run, NaN where the run is no evidence of it or its loop leaves it open."""
    return bounded_values(summary, measure).where(loop_errors(summary, measure) == 0.0)


def bounded_values(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    """Measure of each run that counts in a comparison, with ``loop_errors`` as its error."""
    return _numbers(summary, measure).where(barred(summary, measure) == "")


def shown_values(summary: pd.DataFrame, measure: str) -> pd.Series[float]:
    """Measure of each run that finished, whether or not its loop holds."""
    return _numbers(summary, measure).where(finished(summary))


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


def error_text(measure: str, error: float) -> str:
    """How far a value of a measure may be off by its loop."""
    if not np.isfinite(error):
        return "may be off by any amount"
    return f"may be off by {display_number(measure, error, 2)}"


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
