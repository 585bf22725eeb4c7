"""How a number of ours stands beside what a paper gives."""

from __future__ import annotations

import math

from benchmarks.frame import thousands
from benchmarks.reproduction.ledger import LedgerRow, Theirs
from benchmarks.reproduction.our_number import OurNumber
from sandmould.runs.formatting import number, with_margin

AGREES, HOLDS, DIFFERS, UNRESOLVED = "agrees", "holds", "differs", "not resolved"
BETTER, WORSE, POSSIBLE, NO_INTERVAL = "better", "worse", "not ruled out", "no interval"
NOT_COMPUTED, NOT_COMPARED = "not computed", "not compared"
PICTURE, WORDS, TESTED, DEFINED = "picture", "in words", "tested", "defined"
TAKEN, MEASURED = "taken over", "their measurement"
STATES = {
    AGREES: "ours meets their number or range: with several fillings our whole 95 % interval",
    HOLDS: "theirs is a bound or a sign and ours lies on that side, which says less",
    DIFFERS: "it does not",
    BETTER: "they tell a fault, and ours has less of it",
    WORSE: "they tell a fault, and ours has as much of it, or more",
    UNRESOLVED: "our interval reaches over an end of their range",
    POSSIBLE: "theirs lies on the top of our best, between settings that are ruled out",
    NO_INTERVAL: "two numbers without a spread: the difference stands, no verdict",
    TAKEN: "a number that is put in, the same in our study",
    PICTURE: "theirs is in a picture and not in the text, so that nothing can be compared",
    WORDS: "theirs is words; ours stands beside them",
    TESTED: "a test holds it; no record has a number",
    DEFINED: "a drawing that defines something, with the tests that check it",
    MEASURED: "what they measured or photographed; nothing to compute",
    NOT_COMPUTED: "nothing of ours",
    NOT_COMPARED: "a record is there by now, and no number of it is in this list",
}
"""What each state means."""
_CLOSE = 1e-9
"""Numbers that are put in differ by round-off alone."""


def state_of(row: LedgerRow, ours: OurNumber | None) -> str:
    """How a row stands.

    Parameters
    ----------
    row : LedgerRow
    ours : OurNumber, optional
        Our number where the row has exactly one.
    """
    if row.kind in ("drawing", "measurement"):
        return DEFINED if row.kind == "drawing" else MEASURED
    if not (row.ours or row.figures or row.tests):
        return NOT_COMPUTED
    if row.theirs.picture:
        return PICTURE
    if row.tests and not row.ours:
        return TESTED
    if (theirs := row.theirs.interval) is None or ours is None:
        return WORDS
    if row.kind == "input":
        return TAKEN if math.isclose(ours.best, theirs[0], rel_tol=_CLOSE) else DIFFERS
    if theirs[0] == theirs[1]:
        if ours.low == ours.high:
            return AGREES if difference_text(row.theirs, ours) == "0" else NO_INTERVAL
        if not ours.low <= theirs[0] <= ours.high:
            return DIFFERS
        return POSSIBLE if row.ours[0].take == "best" else AGREES
    if theirs[0] <= ours.low and ours.high <= theirs[1]:
        if row.theirs.fault:
            return WORSE
        return HOLDS if math.isinf(theirs[0]) or math.isinf(theirs[1]) else AGREES
    if ours.low <= theirs[1] and ours.high >= theirs[0]:
        return UNRESOLVED
    return BETTER if row.theirs.fault else DIFFERS


def difference_text(theirs: Theirs, ours: OurNumber | None) -> str:
    """Ours less theirs, with its share; empty where there is none to tell."""
    ends = theirs.interval
    if ends is None or ours is None:
        return ""
    if any(math.isclose(ours.best, end, rel_tol=_CLOSE) for end in ends):
        return "0"
    if ends[0] < ours.best < ends[1]:
        return "holds" if math.isinf(ends[0]) or math.isinf(ends[1]) else "inside"
    end = ends[0] if ours.best < ends[0] else ends[1]
    off = ours.best - end
    share = f" ({number(100 * abs(off / end), 2)} %)" if end else ""
    return f"{'+' if off > 0 else ''}{number(off)} {theirs.unit}".rstrip() + share


def theirs_text(theirs: Theirs) -> str:
    """What the paper gives."""
    if theirs.picture:
        return f"in a picture; text: {theirs.says}" if theirs.says else "in a picture, not in text"
    ends = theirs.interval
    if ends is None:
        return theirs.says
    low, high = (_as_printed(end) for end in ends)
    if theirs.value is not None:
        text = low
    elif math.isinf(ends[0]):
        text = f"below {high}"
    else:
        text = f"above {low}" if math.isinf(ends[1]) else f"{low} to {high}"
    text = f"{text} {theirs.unit}".rstrip()
    return f"{text}; {theirs.says}" if theirs.says else text


def _as_printed(value: float) -> str:
    """A number of a paper, with no digit more or less."""
    is_long = 1e4 <= abs(value) < math.inf
    return thousands(value) if is_long else f"{value:.10g}".replace("-", "−")


def ours_text(row: LedgerRow, place: int, ours: OurNumber) -> str:
    """A number of ours with its interval and how many runs it rests on.

    Parameters
    ----------
    row : LedgerRow
    place : int
        Which of its sources.
    ours : OurNumber
    """
    source, unit = row.ours[place], row.theirs.unit
    if row.kind == "input":
        return f"{_as_printed(float(f'{ours.best:.10g}'))} {unit}".rstrip()
    text = _with_interval(ours, unit, source.digits, source.take == "best")
    return f"{source.name} {text}".lstrip()


def _with_interval(ours: OurNumber, unit: str, digits: int, is_best: bool) -> str:
    runs = f", {ours.n} runs" if ours.n > 1 and ours.low != ours.high else ""
    if is_best:
        text = f"best at {number(ours.best, digits)} {unit}".rstrip()
        if ours.low == ours.high:
            return text + runs
        ends = f"{number(ours.low, digits)} and {number(ours.high, digits)}"
        return f"{text}, its top between {ends}{runs}"
    if ours.low == ours.high:
        return f"{number(ours.best, digits)} {unit}".rstrip()
    return f"{with_margin(ours.best, ours.half_width)} {unit}".rstrip() + runs
