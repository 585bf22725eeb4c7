"""What the controls of an optimum say, and which frequency may be recommended, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sandmould.runs.formatting import listed, number
from sandmould.runs.templates import sentences, worded
from sandmould.statistics.recommendation import Recommendation
from sandmould.statistics.robustness import MUST_HOLD, NUMERICS, OptimumShift, Robustness
from sandmould.statistics.spring_dependence import HoldVerdict, Shape, SpringCurve

_SHAPES: dict[Shape, str] = {
    "rising": "no frequency is better than the highest one",
    "falling": "no frequency is better than the lowest one",
    "open": "no frequency is better than both ends",
    "no result": "too few runs can be used",
}


def robustness_sentences(robustness: Robustness) -> tuple[str, ...]:
    """What the optimum belongs to, then the reasons for it."""
    moved = robustness.moved
    held = [m for m in robustness.shifts if m.case.control in MUST_HOLD and m.verdict != "held"]
    why = [f"{m.name} {'moves it' if m in moved else 'does not tell'}" for m in held]
    own = robustness.springs.own if robustness.springs else None
    why += ["the springs do not tell"] if own and own.dependence == "unresolved" else []
    why += [f"{control.replace('_', ' ')} was not asked" for control in robustness.lacking]
    ways = {way: _names(tuple(m for m in moved if m.verdict == way)) for way in ("up", "down")}
    return sentences(
        "robustness.j2",
        it=robustness,
        numerics=_names(robustness.moved_by(*NUMERICS)),
        held=_names(robustness.moved_by("hold")),
        column=_names(tuple(m for m in moved if m.follows_depth)),
        why=why,
        ways=[f"{way} with {names}" for way, names in ways.items() if names],
        untold=_names(robustness.untold),
        springs=[spring_sentence(hold) for hold in robustness.springs.holds]
        if robustness.springs
        else [],
    )


def spring_sentence(found: HoldVerdict) -> str:
    """What becomes of the optimum with one amplitude held while the springs change."""
    soft, stiff = found.curves[0], found.curves[-1]
    return worded(
        "springs.j2", it=found, held=held_text(found.hold), lacking=list(_lacking(found)),
        places=[] if found.lacking else [_at(soft), _at(stiff)],
    )  # fmt: skip


def recommendation_sentence(found: Recommendation) -> str:
    """A frequency for the table, or why none is named."""
    return worded("recommendation.j2", it=found, held=held_text(found.hold))


def held_text(hold: str) -> str:
    """What a study holds."""
    return f"with the {'moment of the ' if hold == 'unbalance' else ''}{hold} held"


def _names(shifts: tuple[OptimumShift, ...]) -> str:
    return listed([m.name for m in shifts])


def _lacking(found: HoldVerdict) -> Iterator[str]:
    """Why curves have no optimum inside, those that lack it for one reason together."""
    for shape in dict.fromkeys(curve.limbs.shape for curve in found.lacking):
        some = [curve for curve in found.lacking if curve.limbs.shape == shape]
        said = f"{_SHAPES[shape]} with springs {listed([f'x{c.factor:g}' for c in some])}"
        seen = [c.limbs.seen for c in some if math.isfinite(c.limbs.seen)]
        yield f"{said} (a drop below {number(max(seen), 2)} would not show)" if seen else said


def _at(curve: SpringCurve) -> str:
    best, low, high = (number(f) for f in curve.place_hz)
    return f"{best} Hz ({low} to {high}) with springs x{curve.factor:g}"
