"""The answer of a study, typed: what was asked, what counts, how well it is known, what limits it.

Numbers and names only: ``sandmould.wording`` turns it into sentences.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from sandmould.runs.formatting import FILL, OF_BED
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.config import Aim, Better, Goal
from sandmould.statistics.over_time import Passage
from sandmould.statistics.refining import Refining
from sandmould.statistics.settings import Setting
from sandmould.statistics.verdict import Verdict

TIP = "pattern_tip_deflection_m"
BENDING = (
    TIP,
    "pattern_largest_displacement_m",
    "pattern_distance_largest_m",
    "pattern_distance_rms_m",
)
"""Measures of how far a pattern is bent."""
OUTSIDE = "pattern_outside_tolerance_fraction"
FARTHEST = "pattern_distance_largest_m"
CRUSHED = "pattern_crushed_fraction"
MOST_QUARTERS = 16
"""Quarters of the vibration, four times as long, after which longer is no advice (argued)."""
NEARLY_EMPTY = 0.05
"""Share of what fits below which a few grains are all that a space holds; of another share's target
that which is next to nothing (argued)."""


class Decided(StrEnum):
    """What the runs of a study say of its question."""

    NO_RESULT = "no result"
    VALUE = "value"
    """Of the one setting."""
    RANGE = "range"
    """Of a value over what is swept, where neither end is better."""
    FINEST = "finest"
    """Of sizes that only compute the same more finely."""
    NO_EFFECT = "no effect"
    """The runs of all settings are the same, bit for bit."""
    EQUAL = "equal"
    """The measure is the same at all settings."""
    NONE_REACHES = "none reaches"
    REACHED = "reached"
    """One setting or several reach the target."""
    BEST = "best"
    BEST_AT_END = "at an end"
    OPEN = "open"


@dataclass(frozen=True)
class Asked:
    """The question of a study."""

    measure: str
    better: Better
    keys: tuple[str, ...]
    """What is swept."""
    goal: Goal | None = None
    by_lot: bool = True
    """Whether runs of one setting differ by their seeds."""
    beside: tuple[Aim, ...] = ()
    """What the settings should do well besides."""


@dataclass(frozen=True)
class SweepEnd:
    """An end of the sweep at which the best setting lies."""

    key: str
    value: float
    is_highest: bool


@dataclass(frozen=True)
class Answer:
    """What the runs say, and what that rests on."""

    asked: Asked
    decided: Decided
    verdict: Verdict
    """The evidence: every setting with its mean, and the best against each other one."""
    shares: Mapping[str, Setting] = field(default_factory=dict)
    """Settings by the column of the target, by label; empty without one."""
    reach: tuple[Setting, ...] = ()
    """Settings whose mean reaches the target, the gentlest first."""
    shown: tuple[Setting, ...] = ()
    """Those of them whose whole interval does; all of them where nothing is random."""
    shortest: Setting | None = None
    """That which reaches it first, of those that are shown to if any are, where the runs tell."""
    shortest_s: float = 0.0
    poured: bool = False
    """Whether those settings reach it before the box is shaken."""
    ends: tuple[SweepEnd, ...] = ()
    table_ends: tuple[SweepEnd, ...] = ()
    """Ends beyond which the user's table cannot go."""
    further_runs: int | None = None
    """More runs of each open setting that would decide; None where no number would."""
    numerical_error: float | None = None
    """Of a difference between settings without chance; None where no size tells it."""
    refining: Refining | None = None
    passage: Passage | None = None
    """Of the best setting over its vibration."""
    outside: float | None = None
    """Share of a bending pattern's surface beyond its tolerance at that setting, where known."""
    farthest_m: float | None = None
    """Largest distance of that surface from the drawing, where known."""
    crushed: float = 0.0
    """Largest share of its foam that was above its crushing strength in a run of that setting."""
    left_out: Mapping[str, int] = field(default_factory=dict)
    """Runs that do not count, by reason."""
    no_value: str = ""
    """What the first run without a value says of itself."""
    one_way: int = 0
    """Runs in which the sand never felt the pattern give way."""
    planned: int = 0
    drives: Mapping[str, BoxDrive] = field(default_factory=dict)
    """How the box moves, by label of the setting."""
    stand_ins: tuple[str, ...] = ()
    """Keys of values that are not what they stand for."""
    beside: tuple[Answer, ...] = ()
    """Of what else the runs should do well: other cavities, a pattern."""

    @property
    def is_sound(self) -> bool:
        """Whether the question is answered."""
        return self.decided not in (Decided.NO_RESULT, Decided.OPEN)

    @property
    def best(self) -> Setting | None:
        """The setting with the best mean."""
        return self.verdict.best

    @property
    def used(self) -> tuple[Setting, ...]:
        """Settings with runs that count."""
        return tuple(s for s in self.verdict.settings if s.n)

    @property
    def alike(self) -> tuple[Setting, ...]:
        """The best setting, and those that are not told apart from it."""
        open_ = {c.other for c in self.verdict.comparisons if not c.separated}
        ranked = [self.verdict.setting(c.other) for c in self.verdict.comparisons]
        best = () if self.best is None else (self.best,)
        return (*best, *(s for s in ranked if s.label in open_))

    @property
    def worse(self) -> tuple[Setting, ...]:
        """Settings that are told to be worse than the best."""
        told = [c.other for c in self.verdict.comparisons if c.separated]
        return tuple(self.verdict.setting(label) for label in told)

    @property
    def wanted(self) -> tuple[str, ...]:
        """Labels of the settings that suit it, the best first; none where nothing does."""
        if self.nearly_empty:
            return ()
        if self.decided is Decided.REACHED:
            return tuple(s.label for s in self.reach)
        if self.decided in (Decided.NO_EFFECT, Decided.EQUAL):
            return tuple(s.label for s in self.used)
        is_told = self.asked.by_lot and not self.verdict.resolved
        return tuple(s.label for s in (self.alike if is_told else self.alike[:1]))

    @property
    def common(self) -> tuple[str, ...]:
        """Labels of the settings that suit all that the runs should do well."""
        each = [a.wanted for a in (self, *self.beside) if a.wanted]
        return tuple(s for s in self.wanted if all(s in wanted for wanted in each))

    @property
    def may_reach(self) -> bool:
        """Whether the interval of a mean that misses the target reaches to it."""
        goal, known = self.asked.goal, self.shares.values()
        return goal is not None and any(abs(goal.value - s.mean) <= s.ci_half_width for s in known)

    @property
    def unsure(self) -> tuple[Setting, ...]:
        """Settings whose mean reaches the target, and whose interval does not."""
        shown = {s.label for s in self.shown}
        return tuple(s for s in self.reach if s.label not in shown)

    def runs_to_reach(self, setting: Setting | None) -> int:
        """Further runs of a setting that would tell whether it reaches the target, or 0.

        An interval shrinks with the root of the number of runs.
        """
        share = self.shares.get(setting.label) if setting else None
        if share is None or self.asked.goal is None or not math.isfinite(share.ci_half_width):
            return 0
        missing = abs(self.asked.goal.value - share.mean)
        if missing == 0.0:
            return 0
        return max(0, math.ceil(share.n * ((share.ci_half_width / missing) ** 2 - 1.0)))

    @property
    def suits(self) -> bool:
        """Whether what suits all suits it: where one does not reach its target, nothing does."""
        return all(a.reach or not a.shares for a in (self, *self.beside))

    @property
    def is_common_shown(self) -> bool:
        """Whether what suits all is shown to reach every target, not on average alone."""
        judged = [a for a in (self, *self.beside) if a.shares]
        return all({*self.common} <= {s.label for s in a.shown} for a in judged)

    @property
    def trades(self) -> bool:
        """Whether no setting suits all that the runs should do well."""
        return bool(self.wanted and self.beside) and not self.common

    @property
    def filled(self) -> float | None:
        """Of a bending pattern's measure: its value at the best setting before it was shaken."""
        bends = self.asked.measure in BENDING
        return self.passage.first if self.passage and bends else None

    @property
    def chance_at_finest(self) -> float:
        """Half width of the mean at the finest size; 0 where one run or no chance tells none."""
        if self.refining is None:
            return 0.0
        key = self.refining.key
        half = min(self.used, key=lambda s: float(s.values[key])).ci_half_width
        return half if math.isfinite(half) else 0.0

    @property
    def beyond(self) -> tuple[SweepEnd, ...]:
        """Ends of the sweep beyond which more is worth a try."""
        return () if self.nearly_empty else self.ends

    @property
    def still_changes(self) -> float:
        """Share by which the measure changed in the last quarter at the best setting, or 0."""
        return self.passage.change if self.passage else 0.0

    @property
    def is_rising(self) -> bool:
        """Whether the best setting was still getting better as its vibration ended."""
        return self.still_changes * (1.0 if self.asked.better == "larger" else -1.0) > 0.0

    @property
    def longer_helps(self) -> bool:
        """Whether it was.

        Where a target is missed, fast enough to reach it within ``MOST_QUARTERS`` at that pace.
        """
        return self.is_rising and not self._quarters > MOST_QUARTERS

    @property
    def more_s(self) -> float:
        """Further vibration that a missed target takes at the pace of the last quarter, or NaN."""
        return self._quarters * self.passage.lasts_s / 4.0 if self.passage else math.nan

    @property
    def _quarters(self) -> float:
        """The same in quarters of the vibration; NaN where no target is missed."""
        share = self.shares.get(self.best.label) if self.best else None
        if self.decided is not Decided.NONE_REACHES or share is None or self.asked.goal is None:
            return math.nan
        gained = abs(share.mean * self.still_changes / (1.0 + self.still_changes))
        return abs(self.asked.goal.value - share.mean) / gained if gained else math.inf

    @property
    def nearly_empty(self) -> bool:
        """Whether a share that should be large is next to nothing at the best setting."""
        goal, best, measure = self.asked.goal, self.best, self.asked.measure
        is_share = measure.endswith("_fraction") and self.asked.better == "larger"
        if goal is None or best is None or not is_share:
            return False
        is_fill = measure.endswith((FILL, OF_BED))
        least = min(NEARLY_EMPTY, goal.value) if is_fill else NEARLY_EMPTY * goal.value
        misses = self.decided in (Decided.NONE_REACHES, Decided.EQUAL, Decided.NO_EFFECT)
        share = self.shares.get(best.label, best).mean
        return misses and share < least
