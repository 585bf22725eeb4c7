"""The words of an answer: one golden text a question, and what no next step may ask."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from sandmould.kinds.deck.kind import DeckStudy
from sandmould.kinds.sand.kind import SandStudy
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.answer import Answer, Asked, Decided
from sandmould.statistics.config import Better, Goal
from sandmould.statistics.decision import Evidence, decide
from sandmould.wording.answer import (
    AnswerWords,
    detail_sentences,
    first_sentence,
    limit_sentences,
)
from sandmould.wording.next_steps import (
    NextStep,
    answer_steps,
    certificate_steps,
    coarse_step,
)
from tests import answered
from tests.answered import QUESTIONS

GOLDEN = Path(__file__).parent / "golden"


def steps(answer: Answer) -> list[NextStep]:
    """What the study that asked would be told to do next."""
    asked = {"measure": answer.asked.measure, "better": answer.asked.better}
    return answer_steps(SandStudy.model_validate({"objective": asked}), answer)


def text_of(name: str) -> str:
    """All that is said of a question."""
    answer = QUESTIONS[name]()
    parts = {
        "first": [first_sentence(answer)],
        "details": detail_sentences(answer),
        "limits": limit_sentences(answer),
        "next": [f"{each.text} {each.line}".strip() for each in steps(answer)],
    }
    return "".join(f"{part}: {line}\n" for part, lines in parts.items() for line in lines)


@pytest.mark.parametrize("name", QUESTIONS)
def test_a_question_is_answered_in_these_words(name: str) -> None:
    assert text_of(name) == (GOLDEN / f"{name}.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["none_reaches", "several_reach"])
def test_full_is_said_where_it_was_asked_alone(name: str) -> None:
    answer = QUESTIONS[name]()
    goal = answer.asked.goal
    assert goal is not None
    lower = replace(answer, asked=replace(answer.asked, goal=replace(goal, value=0.8)))
    said = first_sentence(lower)
    assert "the pocket to at least 80 % of what fits" in said
    assert "95 %" not in said
    assert "full" not in said


@pytest.mark.parametrize(
    ("fills", "said"),
    [
        ({30: (0.9, 1.02, 0.96)}, "The pocket is full on average, which these runs do not show: it "
         "holds 96 ± 15 % of what fits (3 runs)."),
        ({30: (0.96,)}, "The pocket is full: it holds 96 % of what fits (its error is unknown: one "
         "run)."),
        ({30: (0.7, 0.71), 45: (0.9, 1.02)}, "45 Hz fills the pocket on average, with 96 % of what "
         "fits; 2 runs do not show it."),
        ({30: (0.7,), 45: (0.96,)}, "By one run each, 45 Hz fills the pocket, with 96 % of what "
         "fits: how much of that is chance is unknown."),
        ({30: (0.7,), 45: (0.6,), 60: (0.5,)}, "By one run each, no frequency from 30 Hz to 60 Hz "
         "fills the pocket: the best, 70 % of what fits, is at 30 Hz. A lower frequency may "
         "change that."),
        ({30: (0.97, 0.98, 0.99), 45: (0.96, 0.97, 0.98)}, "30 Hz fills the pocket, with 98.0 ± "
         "2.5 % of what fits; 45 Hz does on average, which 3 runs each do not show."),
        ({30: (0.97, 0.971, 0.972), 45: (0.98, 0.981, 0.982)}, "30 Hz and 45 Hz fill the pocket "
         "(95 % of what fits, or more)."),
        ({30: (0.97, 0.971, 0.972), 45: (0.98,)}, "30 Hz fills the pocket, with 97.10 ± 0.25 % of "
         "what fits; 45 Hz does in one run."),
        ({30: (0.7, 0.71, 0.7), 45: (0.965, 0.97, 0.975)}, "45 Hz alone fills the pocket, with "
         "97.0 ± 1.2 % of what fits."),
    ],
)  # fmt: skip
def test_a_target_is_reached_by_what_the_runs_show(
    fills: dict[float, tuple[float, ...]], said: str
) -> None:
    summary = answered.table(answered.HZ, **{answered.POCKET: fills})
    keys = [answered.HZ] if len(fills) > 1 else []
    assert first_sentence(answered.answered(summary, answered.POCKET, keys)).strip() == said


def test_one_setting_beyond_a_target_is_told_by_its_interval() -> None:
    summary = answered.table(answered.HZ, solid_fraction={30: (0.5, 0.7)})
    ways: tuple[tuple[Better, float, str], ...] = (
        ("larger", 0.62, "misses 0.62"),
        ("smaller", 0.58, "is beyond 0.58"),
    )
    for better, value, said in ways:
        asked = answered.answered(summary, "solid_fraction", [], better).asked
        asked = replace(asked, goal=Goal("solid_fraction", value))
        told = first_sentence(decide(asked, Evidence(summary)))
        assert said in told
        assert "on average, which these runs do not show." in told


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (60.0, "; the value stays within 60 s."),
        (52.0, "; whether the value stays within 52 s is not known."),
        (40.0, "; the value is beyond 40 s."),
    ],
)
def test_what_sizes_tell_is_held_against_a_target(value: float, said: str) -> None:
    answer = QUESTIONS["finest"]()
    goal = Goal(answer.asked.measure, value)
    told = replace(answer, asked=replace(answer.asked, goal=goal, better="smaller"))
    assert said in first_sentence(told)


def test_a_size_that_gave_no_value_is_not_advised_again() -> None:
    values = {0.004: (61.0,), 0.002: (54.3,), 0.001: (math.nan,)}
    summary = answered.table("element_m", **{answered.FREEZES: values})
    of_two = answered.answered(summary, answered.FREEZES, ["element_m"], "neither", by_lot=False)
    assert of_two.refining is not None
    assert not steps(of_two)


def test_a_best_by_like_fillings_says_that_the_next_has_the_better_mean() -> None:
    # the first filling is a poor one, and 38 Hz has it alone
    fills = {30: (0.5, 0.9, 0.89), 38: (0.73, math.nan, math.nan), 40: (0.70, 0.95, 0.93)}
    summary = answered.table(answered.HZ, **{answered.FILL: fills})
    found = answered.answered(summary, answered.FILL, [answered.HZ])
    assert found.best is not None
    assert found.best.label == "38 Hz"
    assert "of like ones the first has the better mean." in detail_sentences(found)[0]


def test_sizes_that_change_nothing_are_told_so() -> None:
    values = dict.fromkeys((0.004, 0.002, 0.001), (52.0,))
    summary = answered.table("element_m", **{answered.FREEZES: values})
    same = answered.answered(summary, answered.FREEZES, ["element_m"], "neither", by_lot=False)
    assert first_sentence(same).strip().endswith("is 52 s for each element from 4 mm to 1 mm.")


def test_more_runs_of_one_setting_are_not_those_of_each() -> None:
    fills = {45: (0.96, 0.97, 0.98)}
    summary = answered.table(answered.HZ, **{answered.POCKET: fills})
    (step,) = steps(answered.answered(summary, answered.POCKET, []))
    assert step.text.startswith("Run it about 2 more times: that would tell whether it reaches")


def test_more_runs_are_advised_for_what_reaches_a_target_on_average() -> None:
    summary = answered.table(answered.HZ, **{answered.POCKET: {
        30: (0.97, 0.98, 0.99), 45: (0.96, 0.97, 0.98),
    }})  # fmt: skip
    (step,) = steps(answered.answered(summary, answered.POCKET, [answered.HZ]))
    assert step.text.endswith("that would tell whether 45 Hz reaches the target, too.")
    assert step.line == "replicates: 5"


def test_how_long_it_shakes_is_told_once_where_that_is_swept() -> None:
    key = "vibration.0.duration_s"
    summary = answered.table(key, **{answered.POCKET: {0.5: (0.97, 0.971), 1.0: (0.98, 0.981)}})
    curves = answered.over_a_second(summary, 0.0, answered.POCKET)
    drives = {"0.5 s": BoxDrive(45, 4e-4), "1 s": BoxDrive(45, 4e-4)}
    said = first_sentence(
        answered.answered(summary, answered.POCKET, [key], curves=curves, drives=drives)
    )
    assert said.strip().endswith("fill the pocket (95 % of what fits, or more).")


def test_a_time_that_is_swept_is_no_time_in_which_none_fills() -> None:
    key = "vibration.0.duration_s"
    summary = answered.table(key, **{answered.POCKET: {0.5: (0.3, 0.35), 1.0: (0.5,)}})
    curves = answered.over_a_second(summary, 0.0, answered.POCKET)
    said = first_sentence(answered.answered(summary, answered.POCKET, [key], curves=curves))
    assert "fills the pocket: the best, 50 % of what fits by one run, is at 1 s" in said


def test_a_margin_of_what_is_no_share_is_told_however_wide() -> None:
    summary = answered.table(
        answered.HZ, height_mm={30: (440, 450), 45: (460, 470), 60: (480, 490)}
    )
    asked = Asked("height_mm", "larger", (answered.HZ,), Goal("height_mm", 900.0))
    assert "wider than" not in first_sentence(decide(asked, Evidence(summary)))


def test_a_grid_says_which_key_makes_a_difference_where_single_settings_do_not() -> None:
    rows = [
        {"run": f"r{at}{of}{n}", "a": at, "b": of, "replicate": n, "seed": 10 * n + at,
         "outcome_code": 0, "flow": 10.0 * at + noise}
        for at in (1, 2) for of in (1, 2)
        for n, noise in enumerate((0.0, 9.0, -9.0) if of == 1 else (-8.0, 1.0, 7.0))
    ]  # fmt: skip
    summary = pd.DataFrame(rows)
    for strength, told in ((1.0, False), (1.6, True)):
        wider = summary.assign(flow=summary["flow"] * 1.0 + 10.0 * (strength - 1.0) * summary["a"])
        said = first_sentence(answered.answered(wider, "flow", ["a", "b"], "neither"))
        assert ("averaged over the rest, a makes a difference" in said) is told


def test_a_finer_step_is_advised_by_what_sizes_do_and_not_by_chance() -> None:
    key = "values.step_s"
    for spread, advised in ((0.1, True), (40.0, False)):
        flows = {4e-5: 300.0, 2e-5: 340.0, 1e-5: 320.0}
        values = {h: (mean - spread, mean, mean + spread) for h, mean in flows.items()}
        found = answered.answered(answered.table(key, flow=values), "flow", [key])
        lines = [each.line for each in steps(found)]
        assert lines == ["sweep: {keys: {values.step_s: [4e-05, 2e-05, 1e-05, 5e-06]}}"] * advised


def test_where_nothing_else_is_left_finer_grains_are() -> None:
    study = SandStudy()
    found = coarse_step(study, 26.0)
    assert found is not None
    assert found.line == "scenario: {sand: {size_scale: 17.3}}"
    assert found.text.startswith("Compute it once with finer grains: these are 26 times as large")
    assert coarse_step(study, 1.0) is None
    swept = SandStudy.model_validate({"sweep": {"keys": {"sand.size_scale": [5, 6]}}})
    assert coarse_step(swept, 6.0) is None


def test_a_setting_with_some_runs_that_did_not_finish_is_named() -> None:
    summary = answered.table(answered.HZ, **{answered.POCKET: {30: (0.7, 0.71), 45: (0.96, 0.97)}})
    summary.loc[3, "outcome_code"] = 1
    said = first_sentence(answered.answered(summary, answered.POCKET, [answered.HZ]))
    assert said.endswith("Of 4 runs, 1 did not finish: 1 of 2 with 45 Hz count.")


def test_runs_that_did_not_finish_are_told_at_once() -> None:
    answer = replace(QUESTIONS["best_at_an_end"](), left_out={"did not finish": 5}, planned=14)
    assert "Of 14 runs, 5 did not finish." in first_sentence(answer)
    answer = replace(answer, decided=Decided.OPEN)
    first, *others = answer.verdict.settings
    settings = (replace(first, n=1), *others)
    open_one = replace(answer, verdict=replace(answer.verdict, settings=settings))
    assert "By 1 to 3 runs each" in first_sentence(open_one)


@pytest.mark.parametrize("name", QUESTIONS)
def test_no_answer_hides_behind_not_resolved_and_none_shows_metres(name: str) -> None:
    said = text_of(name)
    assert "not resolved" not in said.lower()
    assert "0.0006" not in said


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("no_chance", "replicates"),  # nothing random there
        ("finest", "element_m"),  # fine enough, and computed
        ("smaller_while_rising", "onger"),
        ("none_reaches", "hoose"),
        ("no_effect", "replicates"),
    ],
)
def test_no_step_is_refused_or_computed_or_harmful(name: str, word: str) -> None:
    assert not [each for each in steps(QUESTIONS[name]()) if word in each.text + each.line]


@pytest.mark.parametrize(
    ("better", "value", "said"),
    [
        ("smaller", 0.01, "is 0 for every frequency that was tried, 5 to 6 Hz, and stays within"),
        ("larger", 0.5, "is 0 for every frequency that was tried, 5 to 6 Hz, and misses 0.5."),
    ],
)
def test_a_measure_that_is_the_same_everywhere_is_held_against_its_target(
    better: Better, value: float, said: str
) -> None:
    same = dict.fromkeys((5, 6), (0.0, 0.0))
    heights = {5: (0.1, 0.1), 6: (0.2, 0.1)}
    summary = answered.table(answered.HZ, solid_fraction=same, bed_height_m=heights)
    asked = answered.answered(summary, "solid_fraction", [answered.HZ], better).asked
    answer = decide(replace(asked, goal=Goal("solid_fraction", value)), Evidence(summary))
    assert answer.decided is Decided.EQUAL
    assert said.replace("5 to", "5 Hz to") in first_sentence(answer)


def test_what_a_run_without_a_value_says_of_itself_is_told() -> None:
    """A casting that is stopped early has no time; the one that had was called the only one."""
    times = {30: (math.nan,), 45: (249.0,)}
    summary = answered.table(answered.HZ, solidification_time_s=times)
    summary["detail"] = ["still liquid at 300 s: raise until_s", ""]
    said = first_sentence(
        answered.answered(summary, "solidification_time_s", [answered.HZ], "smaller")
    )
    assert "is 249 s with 45 Hz" in said
    assert "Of 2 runs, 1 gave no value (still liquid at 300 s: raise until_s): none counts" in said
    alone = answered.answered(summary[:1], "solidification_time_s", [], "smaller")
    assert first_sentence(alone).startswith(
        "The run gives no solidification time: still liquid at 300 s: raise until_s."
    )


def test_what_pouring_fills_is_not_told_as_filled_by_shaking() -> None:
    """A mean that dips below the target while it is shaken was "full after 1.9 s"."""
    times_s = [0.0, 0.5, 1.0]
    courses = {"r0_0": (1.0, 0.94, 0.97), "r0_1": (0.99, 0.95, 0.98), "r0_2": (1.0, 0.93, 0.96)}
    rows = [
        {"run": run, "time_s": t, "vibration_time_s": t, "stage": "vibrate_1", answered.POCKET: v}
        for run, values in courses.items()
        for t, v in zip(times_s, values, strict=True)
    ]
    summary = answered.table(answered.HZ, **{answered.POCKET: {30: (0.97, 0.98, 0.96)}})
    answer = answered.answered(summary, answered.POCKET, [], curves=pd.DataFrame(rows))
    assert answer.poured
    assert first_sentence(answer).strip().endswith("% of what fits (3 runs), by pouring alone.")
    late = pd.DataFrame(rows).assign(vibration_time_s=lambda it: it.time_s + 0.1)
    answer = answered.answered(summary, answered.POCKET, [], curves=late)
    assert (answer.poured, answer.shortest_s) == (False, pytest.approx(0.1))


def test_the_shortest_is_told_only_where_no_run_contradicts_it() -> None:
    summary = answered.table(answered.HZ, **{answered.POCKET: answered.FULL})
    curves = answered.over_a_second(summary, 0.0, answered.POCKET)
    for late_s, told in ((0.0, True), (0.1, False)):
        late = curves["run"] == "r2_1"
        curves.loc[late, "vibration_time_s"] = curves.loc[late, "time_s"] + late_s
        answer = answered.answered(summary, answered.POCKET, [answered.HZ], curves=curves,
                                   drives=answered.AT_04_MM)  # fmt: skip
        assert (answer.shortest is not None and answer.shortest.label == "60 Hz") == told


def test_a_slow_rise_is_told_with_the_time_that_it_would_take() -> None:
    answer = QUESTIONS["none_reaches"]()
    assert answer.is_rising
    assert not answer.longer_helps
    # 0.0595 of what fits, of which the last quarter brought 0.14/1.14, and 0.95 is asked
    assert answer.more_s == pytest.approx(0.25 * (0.95 - 0.0595) / (0.0595 * 0.14 / 1.14), rel=0.01)
    (step,) = [it for it in answer_steps(SandStudy(), answer) if "at the pace" in it.text]
    assert step.text.startswith("Shake harder, or turn, widen or vent the pocket: ")


def test_a_frequency_of_an_own_deck_has_no_certificate() -> None:
    """The step was refused by the next plan: only studies of sand have that section."""
    summary = answered.table("frequency_hz", height_m={8: (0.1, 0.11), 50: (0.3, 0.31)})
    answer = answered.answered(summary, "height_m", ["frequency_hz"])
    assert certificate_steps(DeckStudy.model_construct(), answer) == []


def test_a_target_below_nothing_is_not_kept_within() -> None:
    summary = answered.table(answered.HZ, flow_per_s={30: (-575.0, -576.0), 45: (-400.0, -401.0)})
    asked = answered.answered(summary, "flow_per_s", [answered.HZ], "smaller").asked
    answer = decide(replace(asked, goal=Goal("flow_per_s", -500.0)), Evidence(summary))
    assert "keeps the flow at or below −500 1/s" in first_sentence(answer)


def test_settings_with_the_very_same_runs_are_told_as_the_same() -> None:
    misses = {12: (9.0, 9.6), 16: (2.0, 2.4), 20: (2.0, 2.4)}
    summary = answered.table(answered.HZ, miss=misses)
    answer = answered.answered(summary, "miss", [answered.HZ], "smaller")
    said = first_sentence(answer)
    assert said.startswith("16 Hz and 20 Hz give the same lowest miss, 2.2")
    assert "12 Hz is worse" in said


def test_a_value_over_a_sweep_names_settings_that_are_told_apart() -> None:
    """The highest one scatters so much that the lowest is not told from it; another one is."""
    tops = {0.5: (38.5, 39.9, 37.3), 1: (38.0, 38.3, 38.6), 2: (50.0, 50.2, 50.1),
            4: (60.0, 38.0, 95.0)}  # fmt: skip
    summary = answered.table(answered.HZ, top_mm=tops)
    words = AnswerWords(answered.answered(summary, "top_mm", [answered.HZ], "neither"))
    assert words.told_pair == ("1 Hz", "2 Hz")
    said = first_sentence(words.answer)
    assert "3 runs each do not tell these two apart, but 1 Hz from 2 Hz" in said


def test_what_differs_by_the_same_in_every_filling_is_told() -> None:
    """No spread is left between pairs, so the two were "not told apart"."""
    summary = answered.table(answered.HZ, height_m={20: (0.1, 0.11, 0.09), 30: (0.2, 0.21, 0.19)})
    answer = answered.answered(summary, "height_m", [answered.HZ])
    assert answer.decided is Decided.BEST_AT_END
    told = answered.answered(summary, "height_m", [answered.HZ], "neither")
    assert first_sentence(told).strip().endswith("(30 Hz): 100 mm more.")
    # without chance in either the seed may not reach the sand
    still = answered.table(answered.HZ, height_m={20: (0.1, 0.1), 30: (0.2, 0.2)})
    assert answered.answered(still, "height_m", [answered.HZ]).decided is Decided.OPEN


def test_a_key_without_effect_is_held_against_the_target() -> None:
    summary = answered.table("material", solid_fraction={"a": (0.6,), "b": (0.6,)})
    asked = answered.answered(summary, "solid_fraction", ["material"], by_lot=False).asked
    answer = decide(replace(asked, goal=Goal("solid_fraction", 0.7)), Evidence(summary))
    said = "are the same; the solid fraction is 0.600, and misses 0.7."
    assert first_sentence(answer).strip().endswith(said)


def test_worse_settings_of_several_keys_stand_in_a_sentence_of_their_own() -> None:
    keys = [answered.HZ, "friction"]
    rows = {(20, 0.2): 1.0, (20, 0.4): 1.1, (30, 0.2): 3.0, (30, 0.4): 3.05}
    summary = pd.DataFrame(
        {"run": f"{hz}{mu}{r}", answered.HZ: hz, "friction": mu, "replicate": r, "seed": r,
         "outcome_code": 0, "height_m": mean + d}
        for (hz, mu), mean in rows.items()
        for r, d in enumerate((0.0, 0.1 * mu, -0.01 * hz * mu))
    )  # fmt: skip
    said = first_sentence(answered.answered(summary, "height_m", keys))
    assert ". Worse: frequency 20 Hz, friction 0." in said


@pytest.mark.parametrize(
    ("holes", "said"),
    [
        ({30: (0.9, 0.99, 0.97), 45: (0.94, 0.99, 0.98)}, "45 Hz may suit both."),
        ({30: (0.97, 0.98, 0.975), 45: (0.99, 0.985, 0.98)}, "45 Hz suits both."),
        ({30: (0.0, 0.0, 0.0), 45: (0.0, 0.0, 0.0)}, "The hole18 holds 0 % of what fits for every "
         "frequency that was tried, 30 Hz to 45 Hz: it is not full."),
        ({30: (0.6, 0.61, 0.62), 45: (0.4, 0.42, 0.41)}, "What is best for the one is not best for "
         "the other: pocket 45 Hz, hole18 30 Hz."),
    ],
)  # fmt: skip
def test_what_suits_two_spaces_is_what_is_shown_of_both(
    holes: dict[float, tuple[float, ...]], said: str
) -> None:
    fills = {30: (0.7, 0.72, 0.71), 45: (0.99, 0.985, 0.98)}
    summary = answered.table(answered.HZ, **{answered.POCKET: fills, answered.HOLE: holes})
    answer = answered.answered(summary, answered.POCKET, [answered.HZ])
    assert first_sentence(answer).strip().endswith(said)


def test_spaces_that_stay_empty_in_runs_that_are_the_same_are_to_be_turned() -> None:
    empty = {30: (0.0, 0.0), 45: (0.0, 0.0)}
    summary = answered.table(answered.HZ, **{answered.POCKET: empty})
    answer = answered.answered(summary, answered.POCKET, [answered.HZ])
    assert answer.decided is Decided.NO_EFFECT
    assert [it.text.split()[0] for it in answer_steps(SandStudy(), answer)] == ["Leave", "Turn"]
