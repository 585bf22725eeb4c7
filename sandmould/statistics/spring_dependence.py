"""Whether an optimal frequency follows the springs: where it lies with softer and stiffer ones.

A resonance of the bed goes as the root of the springs, c/(4 H) with c as sqrt(k); an optimum of
the sand's own stays. Either is told only where there is an optimum at all: a frequency inside the
range that is better than both of its ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
import scipy
from numpy.typing import NDArray

from sandmould.runs.columns import PART, SWEEP
from sandmould.statistics.config import SPRINGS, ControlCase, Objective, fewest_points
from sandmould.statistics.contrasts import Contrasts
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.mean_tests import CONFIDENCE
from sandmould.statistics.optimum import Optimum, find_optimum
from sandmould.statistics.settings import number_blocks

Array = NDArray[np.float64]
Shape = Literal["inner", "rising", "falling", "open", "no result"]
Dependence = Literal["follows", "stays", "none", "unresolved"]
FOLLOWS: Dependence = "follows"
STAYS: Dependence = "stays"
SHARE = 0.05
"""Of the measure at the optimum, the margin where the study sets none."""
BLIND = 2.0
"""Margins: runs that cannot tell a drop of so many say nothing of an optimum that they miss."""


@dataclass(frozen=True)
class CurveLimbs:
    """How far a curve falls from a frequency inside the range to both of its ends."""

    shape: Shape
    top_hz: float
    """The inner frequency whose weaker limb is told best; NaN without a result."""
    drop: tuple[float, float]
    """From there to the lowest and to the highest frequency, in the unit of the measure."""
    least: tuple[float, float]
    """Lower bounds of both at 95 %, for the best of all frequencies that could have been chosen."""
    seen: float
    """Drop that would have been told."""


@dataclass(frozen=True)
class SpringCurve:
    """The measure over frequency with springs of one stiffness and one amplitude held."""

    hold: str
    factor: float
    """Of the springs of bed and walls."""
    limbs: CurveLimbs
    optimum: Optimum | None
    """None where too few runs can be used."""

    @property
    def place_hz(self) -> tuple[float, float, float]:
        """Where the fitted mean is best, and the 95 % interval of the optimum."""
        if self.optimum is None:
            return math.nan, math.nan, math.nan
        (key,) = self.optimum.keys
        return (self.optimum.setting[key], *self.optimum.interval(key))


@dataclass(frozen=True)
class HoldVerdict:
    """What becomes of the optimum with one amplitude held while the springs change."""

    hold: str
    dependence: Dependence
    curves: tuple[SpringCurve, ...]
    """Softest springs first."""
    ratio: float
    """Frequency of the optimum with the stiffest springs over that with the softest; NaN where
    either has none."""
    ci: tuple[float, float]
    lacking: tuple[SpringCurve, ...] = ()
    """Curves that have no optimum inside, or do not tell whether they have one."""

    @property
    def root(self) -> float:
        """What the ratio is where the optimum follows the springs."""
        return math.sqrt(self.curves[-1].factor / self.curves[0].factor)


@dataclass(frozen=True)
class SpringCheck:
    """The verdicts of all holds."""

    own: HoldVerdict
    """Of the amplitude that the study holds."""
    others: tuple[HoldVerdict, ...]

    @property
    def holds(self) -> tuple[HoldVerdict, ...]:
        """The study's own first."""
        return (self.own, *self.others)


def assess_springs(
    summary: pd.DataFrame,
    key: str,
    best_hz: float,
    objective: Objective,
    cases: Sequence[ControlCase],
    own_hold: str,
    margin: float | None,
) -> SpringCheck | None:
    """Say for each amplitude held whether there is an optimum, and whether it follows the springs.

    None before the runs of the control are planned.

    Parameters
    ----------
    best_hz : float
        Frequency at which all holds are one motion, run once a stiffness; those of a study with an
        unbalance are not.
    cases : sequence of ControlCase
        Of all controls.
    own_hold : str
        The amplitude that the study holds.
    margin : float or None
        Drop that counts as none, in the unit of the measure; None for ``SHARE`` of its mean at the
        best frequency.
    """
    if PART not in summary:
        return None
    planned = set(summary[PART].astype(str))
    mine = [case for case in cases if case.control == SPRINGS and case.part in planned]
    of_hold = {hold: [c for c in mine if c.hold == hold] for hold in dict.fromkeys(
        case.hold for case in mine)}  # fmt: skip
    if own_hold not in of_hold:
        return None
    table = summary.assign(_block=number_blocks(summary))
    at_best = table[(table[PART] == SWEEP) & (table[key] == best_hz)]
    blind = BLIND * (margin or SHARE * abs(float(usable_values(at_best, objective.measure).mean())))
    verdicts = {}
    for hold, here in of_hold.items():
        curves = [
            _curve(_rows(table, key, best_hz, case, own_hold, mine), key, objective, case)
            for case in here
        ]
        if hold == own_hold:
            # at frequencies of the control alone, so that curves are as well known
            certified = table.loc[table[PART].isin([c.part for c in mine]), key].unique()
            swept = table[(table[PART] == SWEEP) & table[key].isin(certified)]
            own = ControlCase(SPRINGS, "x1", 1.0, hold=hold)
            curves.append(_curve(swept, key, objective, own))
        verdicts[hold] = _judge(hold, sorted(curves, key=lambda curve: curve.factor), blind)
    own_verdict = verdicts.pop(own_hold)
    return SpringCheck(own_verdict, tuple(verdicts.values()))


def _rows(
    table: pd.DataFrame,
    key: str,
    best_hz: float,
    case: ControlCase,
    own_hold: str,
    cases: Sequence[ControlCase],
) -> pd.DataFrame:
    """Runs of a curve, with those at the best frequency that stand for all holds.

    They do where this hold was not run there: the motion of an unbalance is another one.
    """
    is_mine = table[PART] == case.part
    if case.hold != own_hold and not (is_mine & (table[key] == best_hz)).any():
        twins = [c.part for c in cases if c.hold == own_hold and c.factor == case.factor]
        is_mine |= table[PART].isin(twins) & (table[key] == best_hz)
    return table[is_mine]


def _curve(rows: pd.DataFrame, key: str, objective: Objective, case: ControlCase) -> SpringCurve:
    values = usable_values(rows, objective.measure).dropna()
    used = rows.loc[values.index]
    hz = used[key].to_numpy(dtype=np.float64)
    better: Literal["larger", "smaller"] = "smaller" if objective.better == "smaller" else "larger"
    sign = 1.0 if better == "larger" else -1.0
    factor = case.factor or 1.0
    if len(np.unique(hz)) < fewest_points(1):
        none = (math.nan, math.nan)
        limbs = CurveLimbs("no result", math.nan, none, none, math.nan)
        return SpringCurve(case.hold, factor, limbs, None)
    worth = np.asarray(sign * values, dtype=np.float64)
    limbs = find_limbs(hz, used["_block"].to_numpy(), worth)
    # Draws of two curves must not share their random numbers, or their ratio is too certain.
    seed = round(1000 * factor)
    optimum = find_optimum(used, [key], objective.measure, better, seed)
    return SpringCurve(case.hold, factor, limbs, optimum)


def find_limbs(hz: Array, block: NDArray[np.intp], value: Array) -> CurveLimbs:
    """Ask whether some frequency inside the range is better than both of its ends.

    Means are compared with fillings as blocks, which takes the spread between fillings out. That
    one frequency beats both ends is told where it beats either at 95 % (an intersection of two
    tests needs no allowance), with Bonferroni's factor for the choice of the frequency.

    Parameters
    ----------
    hz : (n,) float64, Hz
        Of each run; at least three different ones.
    block : (n,) int
        Filling of each run.
    value : (n,) float64
        The measure, more being better.
    """
    distinct, place = np.unique(hz, return_inverse=True)
    last = len(distinct) - 1
    contrasts = Contrasts(place, np.unique(block, return_inverse=True)[1], value)
    level = 1.0 - (1.0 - CONFIDENCE) / last
    t = float(scipy.special.stdtrit(contrasts.df, level)) if contrasts.df > 0 else math.nan
    drop, error = np.full((2, last + 1), math.nan), np.full((2, last + 1), math.nan)
    for j in range(last + 1):
        for side, end in enumerate((0, last)):
            if j != end:
                drop[side, j], scale = contrasts.difference(j, end)
                error[side, j] = contrasts.sd * scale
    least = drop - t * error
    inner = np.where(np.isnan(least[:, 1:last]), -np.inf, least[:, 1:last]).min(axis=0)
    top = 1 + int(inner.argmax())
    rises, falls = (bool(np.nanmax(np.append(side, -np.inf)) > 0.0) for side in least)
    shape: Shape = "open"
    if inner.max() > 0.0:
        shape = "inner"
    elif not np.isfinite(inner.max()):
        shape = "no result"
    elif rises != falls:
        shape = "rising" if rises else "falling"
    return CurveLimbs(
        shape,
        float(distinct[top]),
        (float(drop[0, top]), float(drop[1, top])),
        (float(least[0, top]), float(least[1, top])),
        float(t * np.nanmax(error[:, top])) if np.isfinite(error[:, top]).any() else math.nan,
    )


def _judge(hold: str, curves: Sequence[SpringCurve], blind: float) -> HoldVerdict:
    """One verdict of the curves of a hold, softest springs first.

    Curves whose runs could not tell a drop of so much do not show that there is no optimum.
    """
    if without := [curve for curve in curves if curve.limbs.shape != "inner"]:
        told = [curve for curve in without if curve.limbs.seen <= blind]
        dependence: Dependence = "none" if told else "unresolved"
        unknown = (math.nan, math.nan)
        lacking = tuple(told or without)
        return HoldVerdict(hold, dependence, tuple(curves), math.nan, unknown, lacking)
    soft, stiff = curves[0], curves[-1]
    logs = _drawn(stiff) - _drawn(soft)
    ends = np.exp(np.quantile(logs, (0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2)))
    low, high = (float(end) for end in ends)
    ratio = stiff.place_hz[0] / soft.place_hz[0]
    root = math.sqrt(stiff.factor / soft.factor)
    border = math.sqrt(root)
    follows, stays = low > border, high < border and low > 1.0 / border
    verdict = FOLLOWS if follows else STAYS if stays else "unresolved"
    return HoldVerdict(hold, verdict, tuple(curves), ratio, (low, high))


def _drawn(curve: SpringCurve) -> Array:
    """Logarithms of the frequencies at which drawn curves are best, (n,) float64."""
    assert curve.optimum is not None
    return np.log(curve.optimum.points[curve.optimum.picks, 0])
