"""Robustness of an optimum: whether its controls show it to be of the sand or of the model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import pandas as pd
import scipy

from sandmould.runs.columns import PART, RUN, SWEEP, finished
from sandmould.statistics.config import SPRINGS, ControlCase, Objective
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.mean_tests import CONFIDENCE
from sandmould.statistics.spring_dependence import FOLLOWS, SHARE, STAYS, SpringCheck

ShiftVerdict = Literal["up", "down", "held", "unclear", "no result"]
Cause = Literal[
    "rearrangement of grains", "follows the springs", "bed resonance", "no inner optimum",
    "held artefact", "numerics artefact", "unresolved",
]  # fmt: skip
MUST_HOLD = ("hold", "time_step", "engine")
"""Controls that, with the springs, move nothing where the optimum belongs to the grains."""
NUMERICS = ("time_step", "engine")
_SPECTRUM = "spectrum"


@dataclass(frozen=True)
class OptimumShift:
    """Where the optimum goes under one case of a control."""

    case: ControlCase
    means: tuple[float, ...]
    """Of the measure at the three frequencies; NaN where none was run."""
    shift: float
    """Gain of the upper over the lower frequency, less that of the sweep, better being positive."""
    ci: tuple[float, float]
    verdict: ShiftVerdict

    @property
    def name(self) -> str:
        """As sentences name it."""
        return self.case.name

    @property
    def follows_depth(self) -> bool:
        """Whether it goes as the resonance of a column, c/(4 H): down with a deeper bed."""
        if self.case.factor is None or self.case.control != "bed_depth":
            return False
        return self.verdict == ("down" if self.case.factor > 1.0 else "up")


@dataclass(frozen=True)
class Robustness:
    """What the controls of an optimum say together."""

    cause: Cause
    best_hz: float
    lacking: tuple[str, ...]
    """Controls that the cause needs and that were not asked for."""
    sweep: tuple[float, ...]
    """Means of the sweep's own runs at the three frequencies."""
    shifts: tuple[OptimumShift, ...]
    margin: float
    springs: SpringCheck | None
    """None where that control was not run."""

    @property
    def is_artefact(self) -> bool:
        """Whether the optimum is none of the sand's, or none at all."""
        return self.cause.endswith("artefact") or self.cause == "no inner optimum"

    @property
    def moved(self) -> tuple[OptimumShift, ...]:
        """Cases that move it."""
        return tuple(m for m in self.shifts if m.verdict in ("up", "down"))

    def moved_by(self, *controls: str) -> tuple[OptimumShift, ...]:
        """Cases of some controls that move it."""
        return tuple(m for m in self.moved if m.case.control in controls)

    @property
    def untold(self) -> tuple[OptimumShift, ...]:
        """Cases that do not tell whether they move it."""
        return tuple(m for m in self.shifts if m.verdict in ("unclear", "no result"))

    @property
    def follows_springs(self) -> bool:
        """Whether the best frequency goes with the hardness of the sand."""
        return self.springs is not None and self.springs.own.dependence == FOLLOWS

    @property
    def is_sound(self) -> bool:
        """Whether the optimum is one, and the controls say what it belongs to."""
        return not self.is_artefact and self.cause != "unresolved"


def assess_robustness(
    summary: pd.DataFrame,
    key: str,
    certified_hz: Sequence[float],
    objective: Objective,
    margin: float | None,
    cases: Sequence[ControlCase],
    springs: SpringCheck | None = None,
) -> Robustness:
    """Classify an optimum by its controls.

    The noise of a run is pooled over all points, whose replicates count as independent.

    Parameters
    ----------
    summary : DataFrame
        One row a run, the controls among them.
    key : str
        The swept frequency.
    certified_hz : sequence of float, Hz
    margin : float or None
        Shift that counts as none, in the unit of the measure; None for ``SHARE`` of its mean at
        the optimum.
    cases : sequence of ControlCase
        Of all controls; those without runs in the summary are left out.
    springs : SpringCheck, optional
        What the control of the springs says.
    """
    measure = objective.measure
    sign = 1.0 if objective.better == "larger" else -1.0
    table = pd.DataFrame(
        {
            PART: summary.get(PART, SWEEP),
            "hz": summary[key].astype(float),
            "value": sign * usable_values(summary, measure),
        }
    ).dropna(subset=["value"])
    # Other springs at other accelerations have a noise of their own.
    of_springs = {case.part for case in cases if case.control == SPRINGS}
    table = table[~table[PART].isin(of_springs)]
    groups = table.groupby([PART, "hz"])["value"]
    freedom = int((groups.count() - 1).sum())
    squares = groups.var(ddof=1).fillna(0.0) * (groups.count() - 1)
    sd = math.sqrt(float(squares.sum()) / freedom) if freedom else math.nan
    mean, count = groups.mean().to_dict(), groups.count().to_dict()
    sweep = tuple(mean.get((SWEEP, f), math.nan) for f in certified_hz)
    margin = margin or SHARE * abs(sweep[1])
    by_part = {case.part: case for case in cases if case.control not in (_SPECTRUM, SPRINGS)}
    planned = summary[PART].astype(str).unique() if PART in summary else ()
    shifts = []
    for part in (p for p in planned if p in by_part):
        ends = [(p, f) for p in (part, SWEEP) for f in (certified_hz[0], certified_hz[2])]
        lower, upper, sweep_lower, sweep_upper = (mean.get(end, math.nan) for end in ends)
        shift = (upper - lower) - (sweep_upper - sweep_lower)
        ci = (math.nan, math.nan)
        verdict: ShiftVerdict = "no result" if math.isnan(shift) else "unclear"
        if math.isfinite(shift) and freedom:
            error = sd * math.sqrt(sum(1.0 / count[end] for end in ends))
            reach = float(scipy.special.stdtrit(freedom, 0.5 + CONFIDENCE / 2)) * error
            ci = (shift - reach, shift + reach)
            verdict = _of_interval(ci, margin)
        means = tuple(sign * mean.get((part, f), math.nan) for f in certified_hz)
        shifts.append(OptimumShift(by_part[part], means, shift, ci, verdict))
    cause, lacking = _together(shifts, springs)
    of_sweep = tuple(sign * v for v in sweep)
    return Robustness(cause, certified_hz[1], lacking, of_sweep, tuple(shifts), margin, springs)


def _of_interval(ci: tuple[float, float], margin: float) -> ShiftVerdict:
    """Held where the interval lies inside the margin, moved where zero lies outside it.

    A shift that is there but smaller than the margin is held: it does not matter.
    """
    low, high = ci
    if -margin < low and high < margin:
        return "held"
    if low > 0.0:
        return "up"
    return "down" if high < 0.0 else "unclear"


def _together(
    shifts: Sequence[OptimumShift], springs: SpringCheck | None
) -> tuple[Cause, tuple[str, ...]]:
    """What the optimum belongs to, and which controls that were not asked would say."""
    moved = [m for m in shifts if m.verdict in ("up", "down")]
    own = springs.own if springs else None
    if any(m.case.control in NUMERICS for m in moved):
        return "numerics artefact", ()
    if own and own.dependence == "none":
        return "no inner optimum", ()
    if own and own.dependence == FOLLOWS:
        is_column = any(m.follows_depth for m in moved)
        return "bed resonance" if is_column else "follows the springs", ()
    if any(m.case.control == "hold" for m in moved):
        return "held artefact", ()
    wanted = [m for m in shifts if m.case.control in MUST_HOLD]
    asked = {m.case.control for m in wanted} | ({SPRINGS} if own else set())
    lacking = tuple(c for c in (*MUST_HOLD, SPRINGS) if c not in asked)
    stays = own is not None and own.dependence == STAYS
    if not lacking and stays and all(m.verdict == "held" for m in wanted):
        return "rearrangement of grains", ()
    return "unresolved", lacking


def shaken_runs(summary: pd.DataFrame, cases: Sequence[ControlCase]) -> list[str]:
    """Finished runs of the small shake."""
    if PART not in summary:
        return []
    parts = [case.part for case in cases if case.control == _SPECTRUM]
    shaken = summary[summary[PART].isin(parts) & finished(summary)]
    return [str(run) for run in shaken[RUN]]
