"""Whether an optimum follows the springs: planted curves, and what may be recommended of them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from sandmould.bad_input import BadInputError
from sandmould.definition.certificate import round_best_hz, spanned_hz
from sandmould.scenario.reading import Origin, validated
from sandmould.statistics.config import SPRINGS, ControlCase, Objective, SandWaveSpeed
from sandmould.statistics.recommendation import ModelWaveSpeed, Recommendation, Why, recommend
from sandmould.statistics.robustness import Robustness, assess_robustness
from sandmould.statistics.spring_dependence import (
    FOLLOWS,
    STAYS,
    SpringCheck,
    assess_springs,
    find_limbs,
)
from sandmould.wording.robustness import (
    held_text,
    recommendation_sentence,
    spring_sentence,
)

KEY, FILL = "vibration.0.frequency_hz", "tube_fill_fraction"
CERTIFIED_HZ = round_best_hz(40.0)
SPAN_HZ = tuple(spanned_hz(CERTIFIED_HZ).values())
HOLDS = ("acceleration", "displacement", "velocity")
CASES = tuple(
    ControlCase(SPRINGS, f"x{factor:g} {hold}", factor, hold=hold)
    for factor in (0.25, 4.0)
    for hold in HOLDS
)
SD = 0.015
"""Of a run about its filling's curve: between those of docs/results/tube_certified."""
Curve = Callable[[float, float, str], float]
"""Fill by frequency, factor of the springs and what is held."""


def planted(curve: Curve, sd: float = SD, fillings: int = 4, seed: int = 0) -> pd.DataFrame:
    """A summary of the sweep and the springs' runs, with a spread between fillings too."""
    noise = np.random.default_rng(seed)
    of_filling = noise.normal(0.0, 0.03, fillings)
    rows = []
    for case in (None, *CASES):
        for hz in SPAN_HZ:
            if case and case.hold != "acceleration" and hz == CERTIFIED_HZ[1]:
                continue  # one motion, run in the study's own hold
            factor, hold = (case.factor or 1.0, case.hold) if case else (1.0, "acceleration")
            for filling in range(fillings):
                value = curve(hz, factor, hold) + of_filling[filling] + noise.normal(0.0, sd)
                rows.append({"part": case.part if case else "sweep", KEY: hz, "seed": 7 + filling,
                             "replicate": 1 + filling, "outcome_code": 0, FILL: value})  # fmt: skip
    return pd.DataFrame(rows)


def hill(hz: float, best_hz: float) -> float:
    """Falls by 0.06 over a ratio of 1.41 and by 0.12 over 2, as hard sand did in first trials."""
    return 0.6 - 0.25 * math.log(hz / best_hz) ** 2 - 0.1 * abs(math.log(hz / best_hz))


def follows(hz: float, factor: float, hold: str) -> float:
    return hill(hz, 40.0 * math.sqrt(factor))


def stays(hz: float, factor: float, hold: str) -> float:
    return hill(hz, 40.0)


def plateau(hz: float, factor: float, hold: str) -> float:
    """Rises to 40 Hz and is flat from there."""
    return hill(min(hz, 40.0), 40.0)


def check(table: pd.DataFrame) -> SpringCheck:
    found = assess_springs(table, KEY, 40.0, Objective(), CASES, "acceleration", 0.03)
    assert found is not None
    return found


def robust(table: pd.DataFrame) -> Robustness:
    return assess_robustness(table, KEY, CERTIFIED_HZ, Objective(), 0.03, CASES, check(table))


ROW = ModelWaveSpeed(120.0, "of a row of grains, an estimate")


def recommended(
    robustness: Robustness, sand: SandWaveSpeed | None = None, model: ModelWaveSpeed = ROW
) -> Recommendation:
    found = recommend(robustness, (38.0, 42.0), model, sand)
    assert found is not None
    return found


def test_the_span_is_seven_frequencies_in_equal_ratios() -> None:
    assert spanned_hz((28.4, 40.0, 56.4)) == pytest.approx(
        {-3: 14.3, -2: 20.1, -1: 28.4, 0: 40.0, 1: 56.4, 2: 79.4, 3: 112.0}, rel=0.01
    )
    assert SPAN_HZ[-1] / 40.0 == pytest.approx(2.8, rel=0.01)
    assert 40.0 / SPAN_HZ[0] == pytest.approx(2.8, rel=0.01)


@pytest.mark.parametrize("seed", range(2))
def test_an_optimum_that_follows_the_springs_gets_no_frequency_in_hz(seed: int) -> None:
    robustness = robust(planted(follows, seed=seed))
    assert robustness.springs is not None
    assert [v.dependence for v in robustness.springs.holds] == [FOLLOWS] * 3
    own = robustness.springs.own
    assert own.ci[0] < 4.0 < own.ci[1]
    assert own.ratio == pytest.approx(4.0, rel=0.3)
    assert robustness.cause == "follows the springs"
    assert recommended(robustness).interval_hz is None
    assert recommended(robustness).why is Why.NO_SOURCE


@pytest.mark.parametrize("seed", range(2))
def test_one_that_does_not_follow_the_springs_is_recommended(seed: int) -> None:
    robustness = robust(planted(stays, seed=seed))
    assert robustness.springs is not None
    assert [v.dependence for v in robustness.springs.holds] == [STAYS] * 3
    assert robustness.springs.own.ratio == pytest.approx(1.0, rel=0.2)
    assert recommended(robustness).interval_hz == (38.0, 42.0)
    assert recommended(robustness).why is Why.STAYS


def test_a_plateau_is_none() -> None:
    robustness = robust(planted(plateau))
    assert robustness.springs is not None
    assert [v.dependence for v in robustness.springs.holds] == ["none"] * 3
    assert spring_sentence(robustness.springs.own).startswith(
        "With the acceleration held there is no best frequency inside the range: no frequency is "
        "better than the highest one with springs x0.25, x1 and x4 (a drop below 0.0"
    )
    assert robustness.cause == "no inner optimum"
    assert robustness.is_artefact
    assert recommended(robustness).interval_hz is None


def test_plateaus_are_taken_for_optima_no_more_often_than_stated() -> None:
    """Flat curves of seven frequencies: of 200 no more than 5 % and three standard errors."""
    noise = np.random.default_rng(5)
    hz, block = np.tile(SPAN_HZ, 4), np.repeat(np.arange(4), 7)
    wrong = [find_limbs(hz, block, noise.normal(0.0, SD, 28)).shape == "inner" for _ in range(200)]
    # A plateau with one fallen limb is the worst case: then one test alone must hold its level.
    rising = np.where(hz < SPAN_HZ[1], -1.0, 0.0)
    worst = [
        find_limbs(hz, block, rising + noise.normal(0.0, SD, 28)).shape == "inner"
        for _ in range(200)
    ]
    assert np.mean(wrong) <= 0.01
    assert np.mean(worst) <= 0.05 + 3 * math.sqrt(0.05 * 0.95 / 200)


def test_four_fillings_tell_the_drops_of_first_trials() -> None:
    """A fall of 0.06 beside the top is told in 8 of 10 cases: 3.1 standard deviations of a run."""
    noise = np.random.default_rng(6)
    hz, block = np.tile(SPAN_HZ, 4), np.repeat(np.arange(4), 7)
    curve = np.array([hill(f, SPAN_HZ[5]) for f in hz])
    told = [
        find_limbs(hz, block, curve + noise.normal(0.0, 0.02, 28)).shape == "inner"
        for _ in range(100)
    ]
    assert np.mean(told) >= 0.8


def test_an_optimum_in_soft_sand_alone_is_none() -> None:
    """As at constant stroke: a top with soft springs that becomes a plateau with hard ones."""

    def curve(hz: float, factor: float, hold: str) -> float:
        return hill(min(hz, 56.4), 56.4) if factor > 1.0 else hill(hz, 40.0)

    found = check(planted(curve))
    assert found.own.dependence == "none"
    assert {(c.factor, c.limbs.shape) for c in found.own.lacking} == {(4.0, "rising")}


def test_an_optimum_that_goes_half_as_far_is_not_resolved() -> None:
    """Twice as high over a root of four: right on the border."""
    robustness = robust(planted(lambda hz, factor, hold: hill(hz, 40.0 * factor**0.25)))
    assert robustness.springs is not None
    assert robustness.springs.own.dependence == "unresolved"
    assert robustness.cause == "unresolved"
    assert recommended(robustness).why is Why.UNRESOLVED


def test_noise_does_not_show_that_there_is_no_optimum() -> None:
    """Runs that could not tell a drop of two margins leave it open, those of less noise do not."""
    loud, quiet = (check(planted(plateau, sd=sd)).own for sd in (0.1, 0.02))
    assert loud.dependence == "unresolved"
    assert loud.lacking
    assert quiet.dependence == "none"


def test_holds_are_told_apart() -> None:
    """The acceleration's optimum follows the springs, the velocity's does not."""

    def curve(hz: float, factor: float, hold: str) -> float:
        return stays(hz, factor, hold) if hold == "velocity" else follows(hz, factor, hold)

    table = planted(curve)
    # The best frequency was run in the study's own hold alone: it is that of all holds there.
    shared = (table[KEY] == 40.0) & (table["part"] != "sweep")
    assert set(table[shared]["part"]) == {CASES[0].part, CASES[3].part}
    table = table[~shared]
    verdicts = {v.hold: v.dependence for v in check(table).holds}
    assert verdicts == {"acceleration": FOLLOWS, "displacement": FOLLOWS, "velocity": STAYS}


def test_an_unbalance_has_a_motion_of_its_own_at_the_best_frequency_too() -> None:
    """Other holds are then run there as well, and no run of the unbalance is taken for theirs."""
    table = planted(follows)
    own = (table[KEY] == 40.0) & (table["part"] != "sweep")
    extra = []
    for case in CASES:
        if case.hold != "acceleration":
            twin = table[own & (table["part"] == f"control: springs x{case.factor:g} acceleration")]
            extra.append(twin.assign(part=case.part))
    whole = pd.concat([table, *extra], ignore_index=True)
    # Runs of the unbalance at the best frequency that would spoil every other curve.
    at_best = (whole[KEY] == 40.0) & whole["part"].str.endswith(" acceleration")
    whole.loc[at_best, FILL] += 0.5
    verdicts = {v.hold: v for v in check(whole).others}
    assert {v.dependence for v in verdicts.values()} == {FOLLOWS}
    assert held_text("unbalance") == "with the moment of the unbalance held"


def test_fewer_is_better_where_the_study_says_so() -> None:
    table = planted(follows).assign(**{FILL: lambda t: -t[FILL]})
    found = assess_springs(
        table, KEY, 40.0, Objective(better="smaller"), CASES, "acceleration", None
    )
    assert found is not None
    assert found.own.dependence == FOLLOWS


def test_failed_runs_leave_it_open() -> None:
    table = planted(follows)
    hard = table["part"] == "control: springs x4 acceleration"
    table.loc[hard & (table[KEY] > 25.0), "outcome_code"] = 311
    own = check(table).own
    assert own.dependence == "unresolved"
    assert [(c.factor, c.limbs.shape) for c in own.lacking] == [(4.0, "no result")]
    few = planted(follows)
    few.loc[hard & (few[KEY] == SPAN_HZ[-1]), "outcome_code"] = 311
    # The next frequency is then the end: the top has no other limb.
    assert check(few).own.dependence == "none"


def test_nothing_is_said_without_runs_of_the_springs() -> None:
    table = planted(follows)
    assert assess_springs(table[table["part"] == "sweep"], KEY, 40.0, Objective(), CASES,
                          "acceleration", None) is None  # fmt: skip
    none = assess_robustness(table, KEY, CERTIFIED_HZ, Objective(), 0.03, CASES)
    assert recommend(none, (38.0, 42.0), ROW, None) is None


def test_a_wave_speed_with_a_source_gives_a_frequency_with_its_spread() -> None:
    """f goes as c: 38 Hz at 100 of 120 m/s is 31.7 Hz, 42 Hz at 160 of 120 m/s is 56 Hz."""
    sand = SandWaveSpeed(low_m_s=100.0, high_m_s=160.0, by="Nobody 2020, 2 kPa")
    robustness = robust(planted(follows))
    found = recommended(robustness, sand)
    assert found.interval_hz == pytest.approx((38.0 * 100 / 120, 42.0 * 160 / 120))
    said = recommendation_sentence(found)
    assert "100 to 160 m/s (Nobody 2020, 2 kPa)" in said
    assert "120 m/s (of a row of grains, an estimate)" in said
    soft = recommended(robustness, sand, ModelWaveSpeed(19.0, "measured"))
    assert soft.interval_hz is None
    assert soft.why is Why.OTHER_SAND


def test_numerics_that_move_it_forbid_a_recommendation() -> None:
    table = planted(stays)
    step = ControlCase("time_step", "x0.5", 0.5)
    moved = table[(table["part"] == "sweep") & table[KEY].isin(CERTIFIED_HZ)].copy()
    moved["part"] = step.part
    moved[FILL] += 0.3 * np.log(moved[KEY] / 40.0)
    both = pd.concat([table, moved])
    robustness = assess_robustness(
        both, KEY, CERTIFIED_HZ, Objective(), 0.03, (*CASES, step), check(table)
    )
    found = recommend(robustness, (38.0, 42.0), ROW, None)
    assert found is not None
    assert (found.interval_hz, found.why) == (None, Why.NUMERICS)


def test_drops_are_those_of_a_textbook() -> None:
    """Three settings in four blocks: the error of a two-way table, worked out for it.

    s^2 is the residual of rows and columns over (3 - 1)(4 - 1); a difference of two means has the
    variance 2 s^2/4. Of two candidates for the top Bonferroni takes 97.5 % one-sided.
    """
    values = np.array([[0.1, 0.3, 0.2], [0.2, 0.5, 0.2], [0.0, 0.3, 0.1], [0.2, 0.4, 0.1]])
    rows = values.mean(axis=1, keepdims=True)
    columns = values.mean(axis=0, keepdims=True)
    left = values - rows - columns + values.mean()
    error = math.sqrt(2 * float((left**2).sum()) / 6 / 4)
    t = float(stats.t.ppf(0.975, 6))
    found = find_limbs(np.tile([10.0, 20.0, 30.0], 4), np.repeat(np.arange(4), 3), values.ravel())
    assert found.shape == "inner"
    assert found.top_hz == 20.0
    assert found.drop == pytest.approx((0.25, 0.225))
    assert found.seen == pytest.approx(t * error)
    assert found.least == pytest.approx((0.25 - t * error, 0.225 - t * error))


def test_settings_without_a_filling_in_common_are_not_compared() -> None:
    hz = np.array([10.0, 10.0, 20.0, 20.0, 30.0, 30.0])
    apart = find_limbs(hz, np.array([0, 1, 0, 1, 2, 3]), np.array([0.1, 0.2, 0.5, 0.6, 0.1, 0.2]))
    assert apart.shape == "no result"


def test_a_wave_speed_without_a_spread_or_source_is_told() -> None:
    for tree, told in (
        ({"low_m_s": 160, "high_m_s": 100, "by": "me"}, "a high_m_s that is not below the low_m_s"),
        ({"low_m_s": 100, "high_m_s": 160}, "by"),
        ({"low_m_s": 100, "high_m_s": 160, "by": ""}, "by"),
    ):
        with pytest.raises(BadInputError, match=told):
            validated(SandWaveSpeed, tree, Origin())
