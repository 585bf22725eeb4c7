"""The answer of a study in words: its first sentence, what it rests on, what it leaves open."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from sandmould.runs.formatting import (
    OF_BED,
    as_given,
    distinct_names,
    factor_text,
    filled_space,
    is_number,
    listed,
    name_of,
    number,
    runs_text,
    seconds,
    shown_unit,
    value_text,
    with_article,
    with_margin,
)
from sandmould.runs.templates import sentences, worded
from sandmould.scenario.drive import BoxDrive
from sandmould.scenario.vibration import VibrationStage
from sandmould.statistics.answer import Answer, Decided
from sandmould.statistics.config import FULL_SHARE
from sandmould.statistics.main_effects import main_effects
from sandmould.statistics.refining import Refining
from sandmould.statistics.settings import Comparison, Setting
from sandmould.statistics.verdict import FEW

MOST_NAMED = 100
"""More further runs are named nowhere: their estimate is as uncertain as the difference."""
NOTHING = 1e-3
"""Share of the largest value below which one is told as none."""
_MOST_LABELS = 8
WIDEST = 0.5
"""Of the scale of a share: a wider margin says nothing, and is not told (argued)."""
OF_DRIVE = ("frequency_hz", "acceleration_g", "velocity_m_s", "displacement_m")
"""Ends of swept keys that the motion of the box states."""
REASONS = {
    "did not finish": "{} did not finish",
    "lags": "in {} the loop between sand and pattern lags",
    "cycles": "in {} the loop between sand and pattern goes in cycles",
    "diverged": "in {} the loop between sand and pattern diverged",
    "no value": "{} gave no value",
}
"""Why runs do not count, by the name of the reason."""


def first_sentence(answer: Answer) -> str:
    """What a careful engineer says first: one sentence or a few short ones."""
    return worded("answer.j2", it=AnswerWords(answer), most_runs=MOST_NAMED)


def detail_sentences(answer: Answer) -> tuple[str, ...]:
    """The comparison behind the answer, with its interval."""
    return sentences("details.j2", it=AnswerWords(answer))


def limit_sentences(answer: Answer) -> tuple[str, ...]:
    """What the runs leave open."""
    return sentences("limits.j2", it=AnswerWords(answer), few=FEW)


def sand_limits(
    keys: Sequence[str], stage: VibrationStage | None, is_unchecked: bool, has_coarser: bool
) -> tuple[str, ...]:
    """What a sweep over sand leaves open: what the vibration held constant, and the springs.

    ``is_unchecked``: whether the best setting was looked for and its controls have not been run;
    ``has_coarser``: whether it was computed with coarser grains, too.
    """
    swept = {key.rpartition(".")[2] for key in keys}
    is_held = "frequency_hz" in swept and not swept.intersection(OF_DRIVE[1:])
    hold = stage.hold if stage and is_held else ""
    return sentences(
        "sand_limits.j2", hold=hold, is_unchecked=is_unchecked, has_coarser=has_coarser
    )


def reasons_text(left_out: Mapping[str, int]) -> str:
    """How many runs do not count, by reason."""
    return listed([REASONS[why].format(n) for why, n in left_out.items()])


def why_unused(why: str) -> str:
    """Why one run does not count; empty where it does, or where it did not finish."""
    states = {"lags": "lags", "cycles": "goes in cycles", "diverged": "diverged"}
    if why in states:
        return f"not used: its loop {states[why]}"
    return "not used: no value of the objective" if why == "no value" else ""


def main_effect_sentences(answer: Answer) -> tuple[str, ...]:
    """What each of several swept keys does, on average over the others."""
    keys, words = answer.asked.keys, AnswerWords(answer)
    names = distinct_names(keys)
    effects = [
        {
            "name": names[it.key],
            "others": [names[key] for key in keys if key != it.key],
            "high": value_text(it.key, it.high),
            "low": value_text(it.key, it.low),
            "apart": it.apart,
            "text": words.apart(it.apart),
        }
        for it in main_effects(answer.verdict, keys)
    ]
    return sentences("main_effects.j2", effects=effects, measure=answer.asked.measure)


def place_text(label: str, keys: Sequence[str], drive: BoxDrive | None, more: str = "") -> str:
    """A setting as a person sets a table: ``50 Hz (±0.149 mm, 1.5 g)``."""
    said = {key.rpartition(".")[2] for key in keys}
    if drive is None or not said.intersection(OF_DRIVE):
        return f"{label} ({more})" if more else label
    amplitude = "" if "displacement_m" in said else f"±{1e3 * drive.displacement_m:.3g} mm"
    frequency = "" if "frequency_hz" in said else f" at {drive.frequency_hz:.3g} Hz"
    acceleration = "" if "acceleration_g" in said else f"{drive.acceleration_g:.2g} g"
    if said == {"displacement_m"}:
        label, frequency = f"±{1e3 * drive.displacement_m:.3g} mm{frequency}", ""
    told = ", ".join(filter(None, [amplitude + frequency, acceleration, more]))
    return f"{label} ({told})" if told else label


@dataclass(frozen=True)
class Span:
    """A value over a sweep: where it is least and most, where it begins, where it changes most."""

    low: tuple[str, str]
    """Value and label."""
    high: tuple[str, str]
    still: str = ""
    """Label up to which it is about nothing; empty where it begins at once."""
    begins: tuple[str, str] = ("", "")
    last: tuple[str, str] = ("", "")
    steepest: tuple[str, str] = ("", "")
    """Labels between which it changes most, where that is more than chance."""
    apart: str = ""
    """By how much the highest is more than the lowest, where that is tested."""


@dataclass(frozen=True)
class AnswerWords:
    """What templates are given of an answer: its numbers as text, its settings by name."""

    answer: Answer

    def __getattr__(self, name: str) -> Any:
        """What the answer itself has."""
        return getattr(self.answer, name)

    @property
    def name(self) -> str:
        """Name of the measure."""
        return name_of(self.answer.asked.measure)

    @property
    def a_name(self) -> str:
        """The same with its article."""
        return with_article(self.name)

    @property
    def space(self) -> str:
        """The tube or cavity that is to be filled; empty for other measures."""
        measure = self.answer.asked.measure
        space = filled_space(measure)
        is_asked = space != measure and self.answer.asked.better == "larger"
        return space.replace("_", " ") if is_asked else ""

    @property
    def keys_name(self) -> str:
        """The swept key by name; ``setting`` where there are several."""
        keys = self.answer.asked.keys
        return name_of(keys[0]) if len(keys) == 1 else "setting"

    @property
    def sweeps_time(self) -> bool:
        """Whether it is swept for how long the box shakes: no other time is then worth telling."""
        return any(key.endswith("duration_s") for key in self.answer.asked.keys)

    @property
    def is_scale(self) -> bool:
        """Whether one key with numbers is swept."""
        keys = self.answer.asked.keys
        return len(keys) == 1 and all(is_number(s.values[keys[0]]) for s in self.answer.used)

    @property
    def range(self) -> str:
        """What was tried."""
        used, keys = self.answer.used, self.answer.asked.keys
        if len(keys) > 1:
            return listed([s.label for s in used])
        values = [value_text(keys[0], s.values[keys[0]]) for s in used]
        return f"{values[0]} to {values[-1]}" if self.is_scale else listed(values)

    def place(self, setting: Setting) -> str:
        """A setting with what the table then does."""
        return place_text(
            setting.label, self.answer.asked.keys, self.answer.drives.get(setting.label)
        )

    def either(self, settings: Sequence[Setting]) -> str:
        """Settings of which each is as good as the others."""
        return listed([s.label for s in settings], most=_MOST_LABELS)

    def worth(self, setting: Setting) -> str:
        """What comes of a setting, with as many digits as its error allows."""
        share = self.answer.shares.get(setting.label)
        goal = self.answer.asked.goal
        if share is not None and goal is not None and goal.measure.endswith(OF_BED):
            return f"{_shown(100 * share.mean, 100 * share.ci_half_width, 0, 100)} % of what fits"
        return self.value(setting.mean, setting.ci_half_width)

    def value(self, mean: float, half_width: float = math.nan, digits: int = 0) -> str:
        """A value of the measure with its unit."""
        measure = self.answer.asked.measure
        factor, unit = shown_unit(measure)
        digits = digits or (2 if self.answer.stand_ins else 3)
        scale = 1.0 if measure.endswith("_fraction") else math.inf
        text = _shown(factor * mean, factor * half_width, digits, scale)
        return _with_unit(text, unit)

    @staticmethod
    def seconds(time_s: float) -> str:
        """A duration."""
        return f"{time_s:.2g} s" if time_s < 60.0 else seconds(time_s)

    @property
    def has_margin(self) -> bool:
        """Whether the best setting's share has a margin that says something."""
        best = self.answer.best
        share, goal = self.answer.shares.get(best.label) if best else None, self.answer.asked.goal
        if share is None or goal is None or not goal.measure.endswith("_fraction"):
            return True
        return not share.ci_half_width > WIDEST

    @property
    def target(self) -> str:
        """The value that is good enough."""
        goal = self.answer.asked.goal
        if goal is None:
            return ""
        factor, unit = shown_unit(self.answer.asked.measure)
        return _with_unit(as_given(factor * goal.value), unit)

    @property
    def within(self) -> str:
        """How a value that should be small is said to reach its target."""
        goal = self.answer.asked.goal
        return "within" if goal is None or goal.value > 0.0 else "at or below"

    @property
    def goal_text(self) -> str:
        """The value that is good enough, of a space as a share of what fits."""
        goal = self.answer.asked.goal
        is_share = goal is not None and goal.measure.endswith(OF_BED)
        return f"{100 * goal.value:.3g} % of what fits" if is_share and goal else self.target

    @property
    def is_turned(self) -> bool:
        """Whether the next setting has the better mean of all its runs, and not of like ones."""
        best, second = self.answer.best, self.answer.verdict.runner_up
        if best is None or second is None or best.mean == second.mean:
            return False
        return (best.mean < second.mean) is (self.answer.asked.better == "larger")

    @property
    def more(self) -> str:
        """Further vibration that the target takes at the pace of the last quarter."""
        return self.seconds(self.answer.more_s)

    @property
    def ends_told(self) -> bool:
        """Of a value over a sweep: whether its highest is told from its lowest."""
        against = self.answer.verdict.against(max(self.answer.used, key=lambda s: s.mean))
        return against is not None and against.separated

    @property
    def told_pair(self) -> tuple[str, str] | None:
        """Of a value over a sweep whose ends are not told apart: two settings that are."""
        spread, used = self.answer.verdict.spread, self.answer.used
        low, high = (f(used, key=lambda s: s.mean) for f in (min, max))
        for end, other in ((e, s) for e in (high, low) for s in used if s is not e):
            test = spread.compare(end.label, other.label)[1] if spread else None
            if test is not None and Comparison("", 0.0, test, is_factor=False).separated:
                return end.label, other.label
        return None

    @property
    def to_target(self) -> str:
        """How far a space is to be filled; empty where full was asked, or nothing."""
        goal = self.answer.asked.goal
        if goal is None or not goal.measure.endswith(OF_BED):
            return "" if goal is None else f" to {self.target}"
        return "" if goal.value == FULL_SHARE else f" to at least {self.goal_text}"

    @property
    def certainty(self) -> str:
        """How well a value of one setting is known."""
        (setting,) = self.answer.used[:1]
        if setting.n > 1:
            return runs_text(setting.n)
        by_lot = self.answer.asked.by_lot
        return f"its error is unknown: {'one run' if by_lot else 'one size of elements or steps'}"

    @property
    def reasons(self) -> str:
        """Why runs do not count."""
        told = reasons_text(self.answer.left_out)
        return f"{told} ({self.answer.no_value})" if self.answer.no_value else told

    @property
    def lasts(self) -> str:
        """Time of vibration."""
        return self.seconds(self.answer.passage.lasts_s) if self.answer.passage else ""

    @property
    def fewest(self) -> int:
        """Runs of the setting that has fewest."""
        return min((s.n for s in self.answer.used), default=0)

    @property
    def runs_each(self) -> str:
        """Runs of each setting, as a range where they have unlike ones."""
        most = max(s.n for s in self.answer.used)
        runs = f"{most}" if most == self.fewest else f"{self.fewest} to {most}"
        return f"{runs} run{'s' if most > 1 else ''}"

    @property
    def difference(self) -> str:
        """Of the best from the next, without a sign; the factor between them where that is told."""
        verdict = self.answer.verdict
        if verdict.by_factor:
            return self.apart(verdict.comparisons[0])
        half = self.answer.numerical_error or math.nan
        if self.answer.asked.by_lot:
            half = (verdict.ci[1] - verdict.ci[0]) / 2.0
        return self.value(abs(verdict.difference), half)

    def apart(self, of: Comparison) -> str:
        """By how much two values differ, without a sign, or the factor between them."""
        low, high = of.ci
        if of.is_factor:
            return factor_text(of.difference, low, high)
        return self.value(abs(of.difference), (high - low) / 2.0)

    @property
    def is_of_means(self) -> bool:
        """Whether that difference is the one of the two means."""
        best, second = self.answer.best, self.answer.verdict.runner_up
        apart = best.mean - second.mean if best and second else math.nan
        return math.isclose(self.answer.verdict.difference, apart, rel_tol=1e-6, abs_tol=1e-12)

    @property
    def few(self) -> str:
        """Settings with too few runs to tell chance by."""
        few = [s.label for s in self.answer.used if s.n < FEW]
        return listed(few) if self.answer.asked.by_lot else ""

    @property
    def empty(self) -> str:
        """Settings without a run that counts."""
        return listed([s.label for s in self.answer.verdict.settings if not s.n])

    @property
    def partly(self) -> str:
        """Settings of which not all runs count, with how many do."""
        settings = [s for s in self.answer.verdict.settings if 0 < s.n < s.planned]
        counted = [f"{s.n} of {s.planned} with {s.label}" for s in settings]
        return listed(counted, most=_MOST_LABELS)

    @property
    def is_alone(self) -> bool:
        """Whether no setting but the one that reaches the target may reach it."""
        (one,), goal = self.answer.reach, self.answer.asked.goal
        others = [s for label, s in self.answer.shares.items() if label != one.label]
        return goal is not None and all(abs(s.mean - goal.value) > s.ci_half_width for s in others)

    @property
    def all_same(self) -> bool:
        """Whether all settings that are not told from the best have its very values."""
        of = {(s.n, s.mean, s.sd) for s in self.answer.alike}
        return len(of) == 1 < len(self.answer.alike)

    @property
    def effects(self) -> list[str]:
        """Of several swept keys those that make a difference, averaged over the others."""
        keys = self.answer.asked.keys
        names = distinct_names(keys)
        effects = main_effects(self.answer.verdict, keys)
        return [names[it.key] for it in effects if it.apart.separated]

    @property
    def no_chance(self) -> str:
        """Settings whose replicates are the same as those of the best."""
        best = self.answer.best
        if best is None or best.n < 2:
            return ""
        is_exact = self.answer.verdict.spread and self.answer.verdict.spread.is_exact
        if is_exact or self.answer.decided in (Decided.NO_EFFECT, Decided.EQUAL):
            return ""
        against = self.answer.verdict.comparisons
        same = [c.other for c in against if not c.tested and self.verdict.setting(c.other).n > 1]
        return listed(same)

    @property
    def more_runs(self) -> int:
        """Further runs of each open setting that would decide; 0 where no sensible number would."""
        more = self.answer.further_runs
        return more if more is not None and more <= MOST_NAMED else 0

    @property
    def stand_in_sections(self) -> str:
        """What the placeholder values belong to."""
        sections = (key.partition(".")[0] for key in self.answer.stand_ins)
        told = {"initial temperatures" if s == "initial_k" else name_of(s) for s in sections}
        return listed(sorted(told))

    @property
    def stand_in_of(self) -> str:
        """What a user has of his own in their place."""
        is_sand = any(key.startswith(("sand.", "contact.")) for key in self.answer.stand_ins)
        return "sand" if is_sand else "alloy"

    @cached_property
    def others(self) -> tuple[AnswerWords, ...]:
        """The other cavities and the pattern."""
        return tuple(AnswerWords(each) for each in self.answer.beside)

    @property
    def sizes(self) -> Refining:
        """What smaller sizes say together."""
        assert self.answer.refining is not None
        return self.answer.refining

    @property
    def size_texts(self) -> list[str]:
        """The sizes, the coarsest first."""
        return [value_text(self.sizes.key, size) for size in self.sizes.sizes]

    @property
    def refined(self) -> str:
        """The value towards no size at all with its error, chance included."""
        return self.value(self.sizes.value, self._size_error)

    @property
    def _size_error(self) -> float:
        return math.hypot(self.sizes.error, self.answer.chance_at_finest)

    @property
    def sizes_reach(self) -> str:
        """Whether that value reaches a target of its measure; empty without one."""
        asked = self.answer.asked
        if asked.goal is None or asked.goal.measure != asked.measure:
            return ""
        beyond = self.sizes.value - asked.goal.value
        if abs(beyond) <= self._size_error:
            return "unknown"
        return "yes" if (beyond > 0.0) == (asked.better == "larger") else "no"

    @property
    def span(self) -> Span:
        """The measure over the sweep."""
        used = self.answer.used
        is_wide = self.answer.verdict.is_wide
        nothing = 0.0 if is_wide else NOTHING * max(abs(s.mean) for s in used)

        def told(s: Setting) -> tuple[str, str]:
            if abs(s.mean) < nothing:
                return f"about {self.value(0.0)}", s.label
            return self.value(s.mean, s.ci_half_width), s.label

        low, high = (told(f(used, key=lambda s: s.mean)) for f in (min, max))
        against = self.answer.verdict.against(max(used, key=lambda s: s.mean))
        apart = ""
        if against is not None and against.tested:
            apart = self.apart(against) + ("" if against.is_factor else " more")
        if not self.is_scale or len(used) < 4:
            return Span(low, high, apart=apart)
        first = next(i for i, s in enumerate(used) if abs(s.mean) >= nothing)
        if 0 < first < len(used) - 1:
            at = told(used[first]), told(used[-1])
            return Span(low, high, used[first - 1].label, *at)
        pairs = list(itertools.pairwise(used))
        # of logarithms where those are told, with intervals as shares
        of = {s.label: math.log(s.mean) if is_wide else s.mean for s in used}
        reach = {s.label: s.ci_half_width / (s.mean if is_wide else 1.0) for s in used}
        steps = [abs(of[after.label] - of[before.label]) for before, after in pairs]
        chance = [
            reach[before.label] + reach[after.label] if self.asked.by_lot else 0.0
            for before, after in pairs
        ]
        k = steps.index(max(steps))
        others = (s + c for n, (s, c) in enumerate(zip(steps, chance, strict=True)) if n != k)
        if not steps[k] - chance[k] > max(others):
            return Span(low, high, apart=apart)
        before, after = pairs[k]
        return Span(low, high, steepest=(before.label, after.label), apart=apart)


def _with_unit(text: str, unit: str) -> str:
    return text + unit if unit == "°" else f"{text} {unit}".rstrip()


def _shown(mean: float, half_width: float, digits: int, scale: float) -> str:
    """A value with its margin, unless that is wider than what the value can be."""
    if not math.isfinite(half_width) or half_width > WIDEST * scale:
        return number(mean, digits) if digits else f"{mean:.0f}"
    return with_margin(mean, half_width)
