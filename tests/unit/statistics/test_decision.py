"""The twelve questions that a report must answer rightly, each by what is decided of it."""

from __future__ import annotations

import math
from dataclasses import replace

import pandas as pd
import pytest

from sandmould.kinds.sand.kind import SandStudy
from sandmould.kinds.sand.narrow import Narrow
from sandmould.runs.formatting import filled_space
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.answer import Asked, Decided
from sandmould.statistics.config import Aim, Goal
from sandmould.statistics.decision import Evidence, decide
from sandmould.statistics.over_time import first_reach_s, passage_of, reached_s
from sandmould.statistics.refining import Refining, refining_of, resolution_among
from sandmould.wording.answer import first_sentence
from sandmould.wording.next_steps import answer_steps, narrow_steps
from tests import answered
from tests.answered import BENT, FILL, FREEZES, HOLE, HZ, POCKET, TIP, G, table


def labels(answer: answered.Answer) -> list[str]:
    return [s.label for s in answer.reach]


def test_no_setting_reaches_the_target() -> None:
    found = answered.none_reaches()
    assert found.decided is Decided.NONE_REACHES
    assert found.is_sound
    assert found.best is not None
    assert (found.best.label, found.reach) == ("60 Hz", ())
    assert found.shares["60 Hz"].mean == pytest.approx(0.0595)
    assert found.still_changes == pytest.approx(0.14, abs=0.001)


@pytest.mark.parametrize(
    ("share", "rises", "longer_helps", "nearly_empty"),
    [
        # at 0.02 a quarter 0.75 comes to 0.95 in ten more quarters, 0.35 in thirty
        (0.75, 0.02 / 0.73, True, False),
        (0.35, 0.02 / 0.33, False, False),
        (0.04, 0.6, False, True),
    ],
)
def test_longer_is_advised_where_it_can_help(
    share: float, rises: float, longer_helps: bool, nearly_empty: bool
) -> None:
    summary = table(HZ, **{POCKET: {30: (0.0, 0.01), 60: (share, share)}})
    curves = answered.over_a_second(summary, rises, POCKET)
    found = answered.answered(summary, POCKET, [HZ], curves=curves)
    assert (found.longer_helps, found.nearly_empty) == (longer_helps, nearly_empty)
    study = SandStudy.model_validate({"objective": {"measure": POCKET}})
    assert (
        any("Turn the pocket" in each.text for each in answer_steps(study, found)) == nearly_empty
    )


@pytest.mark.parametrize(
    ("ends", "rises", "told"),
    [
        ((0.55, 0.5, 0.52), True, False),
        ((0.55, 0.42, 0.46), False, True),
        ((0.55, 0.54, 0.449), True, False),
    ],
)
def test_runs_that_do_not_move_one_way_tell_a_rise_beyond_chance_alone(
    ends: tuple[float, ...], rises: bool, told: bool
) -> None:
    """Each run holds 0.45 at three quarters of the time."""
    rows = [
        {"run": f"r{n}", "stage": "vibrate_1", "vibration_time_s": at, "fill": fill}
        for n, end in enumerate(ends)
        for at, fill in ((0.0, 0.0), (0.5, 0.45), (0.75, 0.45), (0.9, end), (1.0, end))
    ]
    found = passage_of(pd.DataFrame(rows), ["r0", "r1", "r2"], "fill")
    assert found is not None
    assert (found.change > 0.0, found.is_unclear) == (rises, told)


def test_a_space_that_stays_empty_beside_another_is_to_be_turned_and_suits_nothing() -> None:
    empty = dict.fromkeys(answered.HOLES, (0.0, 0.01, 0.0))
    summary = table(HZ, **{answered.HOLE: answered.HOLES, POCKET: empty})
    found = answered.answered(summary, answered.HOLE, [HZ])
    study = SandStudy.model_validate({"objective": {"measure": answered.HOLE}})
    turned = [each.text for each in answer_steps(study, found) if each.text.startswith("Turn the")]
    assert [text.split(",")[0] for text in turned] == ["Turn the pocket"]
    assert found.beside[0].wanted == ()
    assert not found.trades
    assert "among the best" not in first_sentence(found)
    asked_first = answered.answered(summary, POCKET, [HZ])
    assert asked_first.decided is Decided.EQUAL
    assert [each.text for each in answer_steps(study, asked_first)] == turned


@pytest.mark.parametrize(
    ("fractions", "beyond"),
    [
        ({25: (0.40, 0.60), 50: (0.50, 0.55), 75: (0.42, 0.68)}, False),  # chance 0.8
        ({25: (0.40, 0.50), 50: (0.50, 0.55), 75: (0.52, 0.62)}, True),
        ({25: (0.40,), 50: (0.50,), 75: (0.52,)}, True),  # nothing tells chance
    ],
)
def test_a_key_is_advised_beyond_its_sweep_where_the_measure_goes_one_way(
    fractions: dict[int, tuple[float, ...]], beyond: bool
) -> None:
    found = answered.answered(table(HZ, solid_fraction=fractions), "solid_fraction", [HZ])
    assert bool(found.ends) is beyond


def test_settings_that_scatter_unlike_each_other_are_compared_by_their_own_scatter() -> None:
    calm = {4: (10.0, 12.0, 11.0), 8: (20.0, 22.0, 21.0), 12: (100.0, 190.0, 140.0)}
    summary = table(HZ, flow=calm)
    summary["seed"] = range(len(summary))
    found = answered.answered(summary, "flow", [HZ], "smaller")
    assert found.verdict.spread is not None
    assert found.verdict.spread.are_unlike
    nearest = found.verdict.comparisons[0]
    assert (nearest.other, nearest.separated) == ("8 Hz", True)


def test_finer_grains_are_advised_for_the_narrowest_space_that_is_judged() -> None:
    found = answered.two_cavities()
    judged = [filled_space(a.asked.measure).replace("_", " ") for a in (found, *found.beside)]
    wide, narrow = (
        Narrow([judged[0], "slot"], 0.018, 0.008, 3.7),
        Narrow(judged[1:], 0.01, 0.008, 2),
    )
    other = Narrow(["slot"], 0.001, 0.008, 1.1)
    for spaces, swept, lines in (
        ([wide, other], HZ, ["scenario: {sand: {size_scale: 3.7}}"]),
        ([wide, narrow], HZ, ["scenario: {sand: {size_scale: 2}}"]),
        ([other], HZ, []),
        ([wide], "sand.size_scale", []),
    ):
        study = SandStudy.model_validate({"sweep": {"keys": {swept: [5, 6]}}})
        assert [each.line for each in narrow_steps(study, found, spaces)] == lines


def test_several_reach_it_and_one_is_gentlest_another_shortest() -> None:
    found = answered.several_reach()
    assert found.decided is Decided.REACHED
    assert labels(found) == ["30 Hz", "45 Hz", "60 Hz"]
    assert found.shortest is not None
    assert found.shortest.label == "60 Hz"
    assert found.shortest_s == pytest.approx(0.5 * 0.95 / 0.995, abs=0.003)
    assert found.shown == found.reach


def test_a_mean_beyond_the_target_is_not_shown_to_be() -> None:
    found = answered.some_reach_on_average()
    assert labels(found) == ["30 Hz", "45 Hz"]
    assert [s.label for s in found.shown] == ["45 Hz"]
    once = table(HZ, **{POCKET: {30: (0.96,), 45: (0.97,)}})
    answer = answered.answered(once, POCKET, [HZ])
    assert (answer.decided, answer.shown) == (Decided.REACHED, ())
    assert [it.line for it in answer_steps(SandStudy(), answer)] == ["replicates: 3"]


def test_the_best_at_an_end_is_no_best() -> None:
    found = answered.best_at_an_end()
    assert found.decided is Decided.BEST_AT_END
    assert [(end.key, end.value, end.is_highest) for end in found.ends] == [(G, 6.0, True)]
    turned = table(G, solid_fraction={1.0: (0.5, 0.51), 3.0: (0.62, 0.61), 6.0: (0.55, 0.54)})
    inner = answered.answered(turned, "solid_fraction", [G])
    assert (inner.decided, inner.ends) == (Decided.BEST, ())


def test_two_cavities_are_judged_and_what_trades_against_what() -> None:
    found = answered.two_cavities()
    (hole,) = found.beside
    assert (found.asked.measure, found.decided) == (POCKET, Decided.NONE_REACHES)
    assert (hole.asked.measure, hole.decided, labels(hole)) == (HOLE, Decided.REACHED, ["30 Hz"])
    assert found.wanted == ("60 Hz",)
    assert found.trades
    alike = table(HZ, **{POCKET: answered.APART, HOLE: answered.APART})
    both = answered.answered(alike, POCKET, [HZ])
    assert not both.trades
    assert both.common == ("60 Hz",)


def test_a_pattern_is_judged_beside_what_fills() -> None:
    bent = {30: (0.002, 0.0021, 0.0022), 45: (0.003, 0.0031, 0.003), 60: (0.004, 0.0042, 0.004)}
    summary = table(HZ, **{POCKET: answered.APART, TIP: bent})
    (tip,) = answered.answered(summary, POCKET, [HZ]).beside
    assert (tip.asked.measure, tip.asked.better, tip.wanted) == (TIP, "smaller", ("30 Hz",))


def test_a_value_of_one_setting_is_a_value() -> None:
    found = answered.one_value()
    assert (found.decided, found.is_sound) == (Decided.VALUE, True)
    assert found.used[0].mean == 0.0123
    assert math.isnan(found.used[0].ci_half_width)


def test_without_chance_one_run_each_decides() -> None:
    found = answered.no_chance()
    assert found.decided is Decided.BEST
    assert found.best is not None
    assert found.best.label == "exchange faces"
    assert found.verdict.difference == pytest.approx(-3.34)
    assert found.numerical_error is None
    rows = [
        {"run": f"{e}{h}", "exchange": e, "element_m": h, "outcome_code": 0, FREEZES: value}
        for e, h, value in (("a", 0.01, 60.0), ("a", 0.005, 55.0), ("b", 0.01, 50.0),
                            ("b", 0.005, 48.5))
    ]  # fmt: skip
    keys = ["exchange", "element_m"]
    both = answered.answered(pd.DataFrame(rows), FREEZES, keys, "smaller", by_lot=False)
    # finest against finest, 6.5 apart and open by 5 and 1.5
    assert both.numerical_error == pytest.approx(6.5)
    assert both.decided is Decided.OPEN


def test_of_sizes_the_finest_answers_and_regular_ones_are_extrapolated() -> None:
    found = answered.finest()
    assert found.decided is Decided.FINEST
    assert found.refining is not None
    assert found.refining.sizes == (0.005, 0.0025, 0.00125)
    gain = 7.3 / 1.9
    assert found.refining.order == pytest.approx(math.log2(gain))
    assert found.refining.value == pytest.approx(52.4 - 1.9 / (gain - 1))
    assert found.refining.error == pytest.approx(1.9 / (gain - 1))
    two = Refining("element_m", (0.0025, 0.00125), (61.56, 59.66))
    assert (two.value, two.error) == (59.66, pytest.approx(1.9))
    assert math.isnan(Refining("element_m", (4.0, 2.0, 1.0), (5.0, 6.0, 5.5)).order)
    assert refining_of("time_step.fraction", [(0.8, 1.0), (0.798, 1.0)]) is None


@pytest.mark.parametrize("sizes", [(6.0, 3.0, 2.0), (4.0, 2.0, 1.0), (5.0, 4.0, 1.0)])
def test_regular_sizes_of_any_ratio_are_extrapolated(sizes: tuple[float, ...]) -> None:
    found = refining_of("element_m", [(h, 268.0 + 0.15 * h**2) for h in sizes])
    assert found is not None
    assert found.order == pytest.approx(2.0)
    assert found.value == pytest.approx(268.0)
    assert found.error == pytest.approx(0.15 * sizes[-1] ** 2)


def test_what_does_not_scatter_is_told_where_the_runs_do() -> None:
    filled = {20: (0.3, 0.4, 0.5), 30: (0.4, 0.5, 0.6), 40: (0.5, 0.7, 0.6)}
    shaken = {20: (1.45,) * 3, 30: (3.26,) * 3, 40: (5.8,) * 3}
    summary = table(HZ, solid_fraction=filled, drive_acceleration_g=shaken)
    found = answered.answered(summary, "drive_acceleration_g", [HZ], "smaller")
    assert found.decided is Decided.BEST_AT_END
    # where nothing differs between runs, their seeds may not reach the sand
    by_itself = summary.drop(columns="solid_fraction")
    alone = answered.answered(by_itself, "drive_acceleration_g", [HZ], "smaller")
    assert alone.decided is Decided.OPEN


def test_records_at_unlike_moments_of_a_swing_do_not_tell_whether_it_goes_on() -> None:
    drives = {"the one setting": BoxDrive(50.0, 1e-4)}
    for every_s, falls in ((0.02, True), (0.025, False)):
        rows = [
            {"run": "r0_0", "stage": "vibrate_1", "vibration_time_s": every_s * n,
             BENT: 1e-3 * (2.0 - 0.15 * n)}
            for n in range(9)
        ]  # fmt: skip
        summary = table(HZ, **{BENT: {50: (8e-4,)}}).drop(columns=HZ)
        found = answered.answered(summary, BENT, [], "smaller", pd.DataFrame(rows), drives)
        assert (found.still_changes < 0.0) is falls


def test_a_falling_measure_reaches_its_target_at_the_pace_that_it_fell() -> None:
    rows = [
        {"run": "r0_0", "stage": "vibrate_1", "vibration_time_s": 0.05 * n,
         "height_m": 1.8 - 0.2 * n}
        for n in range(5)
    ]  # fmt: skip
    summary = table(HZ, height_m={50: (1.0,)}).drop(columns=HZ)
    asked = Asked("height_m", "smaller", (), Goal("height_m", 0.9))
    found = decide(asked, Evidence(summary, pd.DataFrame(rows)))
    assert found.more_s == pytest.approx(0.025)


def test_nothing_beyond_the_sweep_is_advised_where_next_to_nothing_was_reached() -> None:
    filled = {20: (0.0, 0.001, 0.0), 30: (0.004, 0.005, 0.006)}
    asked = Asked("both_fraction", "larger", (HZ,), Goal("both_fraction", 0.95))
    evidence = Evidence(table(HZ, both_fraction=filled))
    found = decide(asked, evidence)
    assert found.ends
    assert not found.beyond
    # of a target as small it is much
    near = decide(replace(asked, goal=Goal("both_fraction", 0.01)), evidence)
    assert near.beyond == near.ends != ()
    assert resolution_among(["exchange", "element_m"]) == "element_m"


def test_extrapolation_finds_the_limit_of_a_known_law() -> None:
    sizes = (0.4, 0.2, 0.1)
    law = Refining("element_m", sizes, tuple(3.0 + 2.0 * h**1.5 for h in sizes))
    assert (law.order, law.value) == (pytest.approx(1.5), pytest.approx(3.0))


def test_equal_bits_mean_that_a_key_changes_nothing() -> None:
    assert answered.no_effect().decided is Decided.NO_EFFECT
    same = dict.fromkeys((5, 6), (0.0, 0.0))
    other = table(HZ, solid_fraction=same, bed_height_m={5: (0.1, 0.1), 6: (0.2, 0.1)})
    assert answered.answered(other, "solid_fraction", [HZ]).decided is Decided.EQUAL


def test_what_should_be_small_and_grows_is_helped_by_no_longer_shaking() -> None:
    found = answered.smaller_while_rising()
    assert found.still_changes > 0.08
    assert not found.longer_helps


@pytest.mark.parametrize(
    ("course_mm", "rest_mm", "changes"),
    [
        ((0.2, 0.21, 0.2, 0.21, 0.4), 0.2, 0.0),  # springs back at rest
        ((0.2, 0.21, 0.2, 0.3, 0.4), 0.4, 0.4 / 0.3 - 1.0),
        ((1.2, 0.9, 0.6, 0.5, 0.4), 0.4, 0.4 / 0.5 - 1.0),
    ],
)
def test_a_rise_counts_beyond_what_a_measure_swings_by(
    course_mm: tuple[float, ...], rest_mm: float, changes: float
) -> None:
    summary = pd.DataFrame([{"run": "a", "seed": 1, "outcome_code": 0, BENT: 1e-3 * rest_mm}])
    times_s = (0.0, 0.25, 0.5, 0.75, 1.0, 1.0)
    stages = ["vibrate_1"] * 5 + ["rest"]
    rows = zip(times_s, stages, (*course_mm, rest_mm), strict=True)
    curves = pd.DataFrame(
        [{"run": "a", "vibration_time_s": t, "stage": s, BENT: 1e-3 * mm} for t, s, mm in rows]
    )
    asked = Asked(BENT, "smaller", (), Goal(BENT, 1e-4))
    found = decide(asked, Evidence(summary, curves))
    assert found.decided is Decided.NONE_REACHES
    assert found.still_changes == pytest.approx(changes)
    known = decide(replace(asked, better="neither", goal=None), Evidence(summary, curves))
    assert (known.decided, known.filled) == (Decided.VALUE, 1e-3 * course_mm[0])


def test_a_part_that_swings_by_what_it_rises_is_not_still_rising() -> None:
    found = answered.a_bent_part()
    assert (found.decided, found.still_changes) == (Decided.NONE_REACHES, 0.0)
    assert (found.filled, found.outside) == (pytest.approx(1.119e-3), 0.124)


def test_runs_whose_loop_does_not_hold_never_count() -> None:
    found = answered.failing_loops()
    assert [s.n for s in found.verdict.settings] == [2, 0]
    assert found.left_out == {"cycles": 1, "diverged": 1}
    assert found.used[0].mean == pytest.approx(0.0115)
    none = table(HZ, **{TIP: {1: (0.0, 0.01)}}).assign(pattern_loop="lags")
    assert answered.answered(none, TIP, [HZ]).decided is Decided.NO_RESULT


def test_an_amplitude_is_told_by_its_drive() -> None:
    found = answered.amplitude_swept()
    assert found.decided is Decided.NONE_REACHES
    assert found.drives["0.6 mm"].acceleration_g == pytest.approx(6.04, abs=0.01)


def test_an_open_question_says_how_many_runs_would_decide() -> None:
    found = answered.too_wide()
    assert found.decided is Decided.OPEN
    assert found.further_runs is not None
    assert found.further_runs > 100
    close = table(HZ, **{FILL: {25: (0.0, 0.0, 0.0), 50: (0.1, 0.2, 0.3)}})
    assert answered.answered(close, FILL, [HZ]).further_runs == 2


def test_nothing_lies_below_nothing() -> None:
    rolling = table("friction", solid_fraction={0.0: (0.6, 0.61), 0.5: (0.5, 0.52)})
    assert answered.answered(rolling, "solid_fraction", ["friction"]).decided is Decided.BEST


def test_a_level_is_reached_where_the_mean_stays_above_it() -> None:
    # the second run is above at once and falls below again
    fills = {"a": [0.0, 0.4, 0.8, 1.0], "b": [0.7, 0.6, 0.4, 0.6]}
    curves = pd.DataFrame(
        [
            {"run": run, "stage": "vibrate_1", "vibration_time_s": 0.1 * k, "fill": value}
            for run, values in fills.items()
            for k, value in enumerate(values)
        ]
    )
    assert reached_s(curves, fills, "fill", 0.55) == pytest.approx(0.15)
    assert math.isnan(reached_s(curves, fills, "fill", 0.9))


def test_first_reach_is_interpolated() -> None:
    assert first_reach_s([0, 1, 2, 3], [0, 0.4, 0.8, 0.7], 0.6) == pytest.approx(1.5)
    assert first_reach_s([0, 1], [0.7, 0.8], 0.6) == 0
    assert math.isnan(first_reach_s([0, 1, 2], [0, 0.4, 0.5], 0.6))


def test_what_is_asked_besides_trades_against_the_first() -> None:
    """Fill is best at 60 Hz, density at 30 Hz: no setting does both, and a table shows it."""
    dense = {30: (0.620, 0.622, 0.621), 45: (0.600, 0.603, 0.601), 60: (0.580, 0.581, 0.583)}
    fills = {30: (0.20, 0.22, 0.21), 45: (0.30, 0.31, 0.33), 60: (0.50, 0.52, 0.51)}
    summary = table(HZ, **{FILL: fills, "solid_fraction": dense})
    aims = (Aim(measure="solid_fraction"),)
    answer = decide(Asked(FILL, "larger", (HZ,), beside=aims), Evidence(summary))
    (other,) = answer.beside
    assert other.asked.measure == "solid_fraction"
    assert other.best is not None
    assert other.best.label == "30 Hz"
    assert answer.trades
    aims = (Aim(measure="solid_fraction", target=0.6),)
    answer = decide(Asked(FILL, "larger", (HZ,), beside=aims), Evidence(summary))
    assert answer.beside[0].decided is Decided.REACHED
