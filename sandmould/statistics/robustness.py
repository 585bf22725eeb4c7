"""What the controls say together: whether the optimum is of the sand or of the model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import pandas as pd
from scipy import stats

from sandmould.runs.columns import PART, RUN, SWEEP, finished
from sandmould.runs.formatting import listed, number
from sandmould.statistics.config import Objective
from sandmould.statistics.settings import CONFIDENCE
from sandmould.statistics.verdict import finished_values

Moved = Literal["up", "down", "held", "unclear", "no result"]
Kind = Literal[
    "rearrangement of grains", "column resonance of the springs",
    "artefact of what is held constant", "artefact of the numerics", "unresolved",
]  # fmt: skip
SHARE = 0.05
"""Of the measure at the optimum, the margin where the study sets none."""
MUST_HOLD = ("hold", "stiffness", "time_step", "engine")
"""Controls that move nothing where the optimum belongs to the sand."""
_PREFIX = "control: "
_SPECTRUM = "spectrum"


@dataclass(frozen=True)
class Movement:
    """Where the optimum goes under one case of a control."""

    control: str
    value: str
    means: tuple[float, ...]
    """Of the measure at the three frequencies; NaN where none was run."""
    shift: float
    """Gain of the upper over the lower frequency, less that of the sweep, better being positive."""
    ci: tuple[float, float]
    judged: Moved

    @property
    def name(self) -> str:
        """As sentences name it."""
        what = self.control.replace("_", " ")
        return f"{self.value} held" if self.control == "hold" else f"{what} {self.value}"


@dataclass(frozen=True)
class Certified:
    """The judgement of a certificate."""

    kind: Kind
    sentences: tuple[str, ...]
    sweep: tuple[float, ...]
    """Means of the sweep's own runs at the three frequencies."""
    movements: tuple[Movement, ...]
    margin: float

    @property
    def is_artefact(self) -> bool:
        """Whether the optimum is none of the sand's."""
        return self.kind not in ("rearrangement of grains", "unresolved")


def certify(
    summary: pd.DataFrame,
    key: str,
    certified_hz: Sequence[float],
    objective: Objective,
    margin: float | None,
) -> Certified:
    """Judge the controls of a study.

    The noise of a run is pooled over all points, whose replicates count as independent.

    Parameters
    ----------
    summary : DataFrame
        One row a run, the controls among them.
    key : str
        The swept frequency.
    certified_hz : sequence of float, Hz
    objective : Objective
    margin : float or None
        Shift that counts as none, in the unit of the measure; None for ``SHARE`` of its mean at
        the optimum.
    """
    measure = objective.measure
    sign = 1.0 if objective.better == "larger" else -1.0
    table = pd.DataFrame(
        {
            "part": summary.get(PART, SWEEP),
            "hz": summary[key].astype(float),
            "value": sign * finished_values(summary, measure),
        }
    ).dropna(subset=["value"])
    groups = table.groupby([PART, "hz"])["value"]
    freedom = int((groups.count() - 1).sum())
    squares = groups.var(ddof=1).fillna(0.0) * (groups.count() - 1)
    sd = math.sqrt(float(squares.sum()) / freedom) if freedom else math.nan
    mean, count = groups.mean().to_dict(), groups.count().to_dict()
    sweep = tuple(mean.get((SWEEP, f), math.nan) for f in certified_hz)
    margin = margin or SHARE * abs(sweep[1])
    parts = [p for p in summary.get(PART, pd.Series(dtype=str)).unique()
             if str(p).startswith(_PREFIX)]  # fmt: skip
    moves = []
    for part in map(str, parts):
        control, _, value = part.removeprefix(_PREFIX).partition(" ")
        if control == _SPECTRUM:
            continue
        ends = [(p, f) for p in (part, SWEEP) for f in (certified_hz[0], certified_hz[2])]
        known = [mean.get(end, math.nan) for end in ends]
        shift = (known[1] - known[0]) - (known[3] - known[2])
        ci, judged = (math.nan, math.nan), _judged_without(shift)
        if math.isfinite(shift) and freedom:
            error = sd * math.sqrt(sum(1.0 / count[end] for end in ends))
            reach = float(stats.t.ppf(0.5 + CONFIDENCE / 2, freedom)) * error
            ci = (shift - reach, shift + reach)
            judged = _judged(ci, margin)
        means = tuple(sign * mean.get((part, f), math.nan) for f in certified_hz)
        moves.append(Movement(control, value, means, shift, ci, judged))
    kind, said = _together(moves, certified_hz[1])
    return Certified(kind, said, tuple(sign * v for v in sweep), tuple(moves), margin)


def _judged_without(shift: float) -> Moved:
    return "no result" if math.isnan(shift) else "unclear"


def _judged(ci: tuple[float, float], margin: float) -> Moved:
    """Held where the interval lies inside the margin, moved where zero lies outside it.

    A shift that is there but smaller than the margin is held: it does not matter.
    """
    low, high = ci
    if -margin < low and high < margin:
        return "held"
    if low > 0.0:
        return "up"
    return "down" if high < 0.0 else "unclear"


def _together(moves: Sequence[Movement], best_hz: float) -> tuple[Kind, tuple[str, ...]]:
    """The verdict, and the reasons for it."""
    at = f"The optimum at {number(best_hz)} Hz"
    moved = [m for m in moves if m.judged in ("up", "down")]
    open_ = [m for m in moves if m.judged in ("unclear", "no result")]
    said = [f"{_listed(moved)}."] if moved else []
    said += [f"Not told: {listed([m.name for m in open_])}."] if open_ else []
    numerics = [m for m in moved if m.control in ("time_step", "engine")]
    as_springs = [m for m in moved if _as_springs(m, "stiffness", {"x10": "up", "x0.1": "down"})]
    as_column = [m for m in moved if _as_springs(m, "bed_depth", {"x2": "down", "x0.5": "up"})]
    held = [m for m in moved if m.control == "hold"]
    if numerics:
        first = f"{at} is an artefact of the numerics: it moves with {_names(numerics)}."
        return "artefact of the numerics", (first, *said)
    if as_springs and as_column:
        first = (
            f"{at} is a resonance of the column of springs, not of the sand: it moves with "
            f"{_names([*as_springs, *as_column])} as c/(4 H) does."
        )
        return "column resonance of the springs", (first, *said)
    if held:
        first = f"{at} is an artefact of what is held constant: it moves with {_names(held)}."
        return "artefact of what is held constant", (first, *said)
    wanted = [m for m in moves if m.control in MUST_HOLD]
    asked = {m.control for m in wanted}
    missing = [c.replace("_", " ") for c in MUST_HOLD if c not in asked]
    if not missing and all(m.judged == "held" for m in wanted):
        first = (
            f"{at} belongs to the sand: neither what is held constant nor stiffness, time step or "
            "engine moves it by more than the margin."
        )
        return "rearrangement of grains", (first, *said)
    why = [f"{m.name} {'moves it' if m in moved else 'does not tell'}" for m in wanted
           if m.judged != "held"]  # fmt: skip
    why += [f"{c} was not asked" for c in missing]
    first = f"Whether the optimum at {number(best_hz)} Hz belongs to the sand is unresolved: "
    return "unresolved", (f"{first}{listed(why)}.", *said)


def _as_springs(move: Movement, control: str, direction: dict[str, str]) -> bool:
    return move.control == control and direction.get(move.value) == move.judged


def _names(moves: Sequence[Movement]) -> str:
    return listed([m.name for m in moves])


def _listed(moves: Sequence[Movement]) -> str:
    up, down = ([m for m in moves if m.judged == way] for way in ("up", "down"))
    said = [f"{way} with {_names(some)}" for way, some in (("up", up), ("down", down)) if some]
    return f"It moves {' and '.join(said)}"


def shaken_runs(summary: pd.DataFrame) -> list[str]:
    """Runs of the small shake."""
    if PART not in summary:
        return []
    chosen = summary[summary[PART].astype(str).str.startswith(f"{_PREFIX}{_SPECTRUM}")]
    complete = chosen[finished(chosen)]
    return [str(run) for run in complete[RUN]]
