"""The first screen: what to set on the machine, how sure that is, what to do next."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
import pytest

from sandmould.kinds.sand.kind import SandStudy
from sandmould.report.answer import choices_of, choices_table, headline_of
from sandmould.report.next_steps import NextSteps, next_steps, setting_steps
from sandmould.report.sureness import certificate_ground, sand_grounds, weak_ground
from sandmould.report.tables import share_of_what_fits
from sandmould.runs.columns import CROSS_CHECK, OUTCOME_CODE, PART, RUN, SWEEP
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.verdict import Verdict, compare_settings
from sandmould.study.collect import Collected
from sandmould.study.plan.ownership import OWNER_FILE
from tests.unit.report_study import scenario

KEY = "vibration.0.frequency_hz"
FILL = "tube_fill_fraction"


def summary(fills: Mapping[float, Sequence[float]], share: float = 1.25) -> pd.DataFrame:
    """Fills of each frequency's replicates; what fits in is 1 / share of the space."""
    rows = [
        {RUN: f"f{hz:g}_r{r}", KEY: hz, "replicate": r, "seed": r, PART: SWEEP, OUTCOME_CODE: 0,
         "outcome": "finished", FILL: fill, "tube_fill_of_bed_fraction": share * fill}
        for hz, values in fills.items()
        for r, fill in enumerate(values)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def judged(table: pd.DataFrame) -> tuple[Verdict, dict[str, BoxDrive]]:
    verdict = compare_settings(table[table[PART] == SWEEP], [KEY], FILL)
    drives = {s.label: BoxDrive(float(s.values[KEY]), 1.5e-4) for s in verdict.settings}
    return verdict, drives


CLEAR = {25.0: (0.30, 0.31, 0.32), 50.0: (0.60, 0.61, 0.63), 100.0: (0.40, 0.42, 0.41)}
ALIKE = {25.0: (0.58, 0.62, 0.60), 50.0: (0.61, 0.59, 0.63), 100.0: (0.30, 0.31, 0.32)}


@pytest.mark.parametrize(
    ("fills", "said", "is_sound"),
    [
        (CLEAR, "Shake at 50 Hz with an amplitude of 0.150 mm, half of peak to peak (1.51 g): "
         "there the tube fills best.", True),
        (ALIKE, "Shake at 50 Hz or 25 Hz: these runs cannot tell which of them is best. 100 Hz is "
         "worse.", False),
        ({25.0: (0.5, 0.6), 50.0: (0.6, 0.5)}, "Not resolved: these runs cannot tell which is "
         "best, 25 Hz or 50 Hz.", False),
        ({25.0: (0.5, 0.6)}, "Not resolved: there are results of 25 Hz alone, nothing to compare.",
         False),
        ({25.0: (float("nan"),)}, "Not resolved: 1 of 1 runs finished, but none gives a fill of "
         "the tube that can be used (1 has no value).", False),
    ],
)  # fmt: skip
def test_the_headline_says_what_to_set(
    fills: Mapping[float, Sequence[float]], said: str, is_sound: bool
) -> None:
    verdict, drives = judged(summary(fills))
    assert headline_of(verdict, [KEY], drives) == (said, is_sound)


def test_the_best_setting_stands_in_words_of_the_machine() -> None:
    table = summary(CLEAR)
    other = table[table[KEY] == 50.0].copy()
    other[PART] = CROSS_CHECK
    other[[FILL, "tube_fill_of_bed_fraction"]] = 0.1
    table = pd.concat([table, other], ignore_index=True)
    verdict, drives = judged(table)
    (figures,) = choices_of(verdict, table, drives)
    assert [(it.value, it.label) for it in figures] == [
        ("50 Hz", "frequency"),
        ("0.150 mm", "amplitude (half of peak to peak)"),
        ("1.51 g", "peak acceleration"),
        ("77 %", "of what fits in"),
        ("0.613 ± 0.038", "fill of the tube"),
    ]


@pytest.mark.parametrize(
    ("fill", "said"),
    [
        (0.80, "Shake at 50 Hz or 25 Hz: the tube is full at each, in the mean of the runs."),
        (0.60, "Not resolved: these runs cannot tell which is best, 50 Hz or 25 Hz."),
    ],
)
def test_a_space_that_every_setting_fills_is_said_to_be_full(fill: float, said: str) -> None:
    table = summary({25.0: (fill, fill - 0.02), 50.0: (fill - 0.02, fill + 0.03)})
    verdict = compare_settings(table, [KEY], "tube_fill_of_bed_fraction")
    assert headline_of(verdict, [KEY], {}) == (said, False)


def test_a_fill_over_that_of_the_bed_is_its_own_share() -> None:
    table = summary(CLEAR)
    for measure in (FILL, "tube_fill_of_bed_fraction"):
        assert share_of_what_fits(table, measure, {KEY: 25.0}) == pytest.approx(1.25 * 0.31)
    assert math.isnan(share_of_what_fits(table, "solid_fraction"))


def test_settings_that_may_be_the_best_stand_below_each_other() -> None:
    table = summary(ALIKE)
    verdict, drives = judged(table)
    shown = choices_table(choices_of(verdict, table, drives))
    assert [[cell.text for cell in row[:2]] for row in shown.rows] == [
        ["50 Hz", "0.150 mm"],
        ["25 Hz", "0.150 mm"],
    ]
    # what holds for both is said once
    assert shown.note == (
        "0.300 mm end to end; 100 %: the tube packed as densely as the sand round it; mean of 3 "
        "runs, ± its 95 % interval."
    )
    assert {cell.note for row in shown.rows for cell in row} == {"", "47.1 mm/s", "23.6 mm/s"}


def test_results_without_the_share_and_without_a_drive_have_no_such_figures() -> None:
    table = summary(CLEAR).drop(columns="tube_fill_of_bed_fraction")
    (figures,) = choices_of(judged(table)[0], table, {})
    assert [(it.value, it.label) for it in figures] == [
        ("50 Hz", "frequency"),
        ("0.613 ± 0.038", "fill of the tube"),
    ]


def steps_of(folder: Path, table: pd.DataFrame, replicates: int = 3) -> NextSteps:
    keys = {KEY: sorted(set(table[KEY]))}
    study = SandStudy.model_validate({"sweep": {"keys": keys}, "replicates": replicates})
    collected = Collected(table, pd.DataFrame(columns=[RUN]), (KEY,))
    verdict, _ = judged(table)
    return next_steps(
        folder, study, collected, verdict, verdict.resolved, setting_steps(study, verdict)
    )


def test_what_to_do_next_says_how_many_runs_and_which_command(tmp_path: Path) -> None:
    (tmp_path / OWNER_FILE).write_text("mine/tube.yaml\n")
    table = summary(ALIKE)
    table.loc[table[KEY] == 25.0, FILL] = [0.59, 0.57, 0.595]
    steps = steps_of(tmp_path, table)
    lines = [step.line for step in steps.steps]
    wanted = int(lines[0].removeprefix("replicates: "))
    assert 3 < wanted <= 33
    assert steps.steps[0].text.startswith(f"Run about {wanted - 3} more fillings of each setting")
    assert steps.before == "Write them into mine/tube.yaml, then run"
    assert steps.command == "sandmould run mine/tube.yaml"


def test_a_difference_that_is_not_worth_the_runs_is_left_alone(tmp_path: Path) -> None:
    steps = steps_of(tmp_path, summary(ALIKE))
    assert steps.steps[0].text.startswith("Choose between 50 Hz and 25 Hz by what suits your mach")
    assert steps.steps[0].line == ""


def test_a_shipped_study_is_gone_on_with_in_a_file_of_ones_own(tmp_path: Path) -> None:
    (tmp_path / OWNER_FILE).write_text("shipped study tube_demo\n")
    fills = {f: (0.5 - abs(f - 50) / 200,) for f in (25.0, 50.0, 75.0, 100.0)}
    steps = steps_of(tmp_path, summary(fills), replicates=1)
    assert steps.steps[0].line == "replicates: 3"
    assert steps.steps[1].line == "certificate: {controls: [springs, hold, time_step]}"
    assert (
        steps.before == "Write them into a file my_study.yaml below based_on: tube_demo, then run"
    )
    assert steps.command == "sandmould run my_study.yaml"


def test_the_end_of_the_sweep_and_failed_runs_are_next(tmp_path: Path) -> None:
    table = summary({25.0: (0.6, 0.61, 0.62), 50.0: (0.3, 0.31, 0.33), 100.0: (0.2, 0.21, 0.2)})
    table.loc[table[RUN] == "f100_r2", OUTCOME_CODE] = 3
    failed, beyond, few = steps_of(tmp_path, table).steps
    assert failed.command == "sandmould again f100_r2"
    assert beyond.text == "Add a frequency below 25 Hz to the sweep: the best may lie there."
    assert few.text == (
        "Sweep 4 frequencies or more: with fewer the best frequency cannot be found between those "
        "that were computed."
    )


def test_how_sure_it_is_names_scatter_springs_drive_and_certificate() -> None:
    verdict, _ = judged(summary(CLEAR))
    study = SandStudy.model_validate({"sweep": {"keys": {KEY: [25, 50, 100]}}, "replicates": 3})
    grounds = (*sand_grounds(scenario(50.0), study, verdict), *certificate_ground(study, None))
    said = {it.about: it.text for it in grounds}
    assert said["Scatter"].startswith("3 runs of each setting, alike but for the grains' starting")
    assert "the means of 50 Hz and 100 Hz differ by 0.20" in said["Scatter"]
    assert "waves run at 128 m/s" in said["Springs"]
    assert said["Drive"].startswith("the acceleration stays the same when the frequency changes")
    assert said["Certificate"].startswith("Three tests of the best frequency have not been run.")


def test_few_runs_that_cannot_tell_ask_for_no_thousand_more(tmp_path: Path) -> None:
    table = summary({25.0: (0.50, 0.62, 0.560), 50.0: (0.51, 0.61, 0.5595)})
    first = steps_of(tmp_path, table).steps[0]
    assert first.text.endswith("these few runs cannot show a difference.")


@pytest.mark.parametrize(
    ("key", "said"),
    [(KEY, "Add a frequency below 25 Hz"), ("acceleration_g", "Add an acceleration above 3 g")],
)
def test_the_end_of_a_sweep_is_told_with_its_article(key: str, said: str, tmp_path: Path) -> None:
    values = {25.0: (0.6, 0.61, 0.62), 50.0: (0.3, 0.31, 0.33)}
    table = summary(values)
    if key != KEY:
        table = table.rename(columns={KEY: key}).assign(**{key: [3.0] * 3 + [1.0] * 3})
    verdict = compare_settings(table, [key], FILL)
    study = SandStudy.model_validate({"sweep": {"keys": {KEY: [25, 50]}}, "replicates": 3})
    named = study.model_copy(
        update={"sweep": study.sweep.model_copy(update={"keys": {key: [1.0, 3.0]}})}
    )
    assert any(step.text.startswith(said) for step in setting_steps(named, verdict))


def test_settings_below_one_g_are_named_beside_the_answer() -> None:
    strong = scenario(50.0)
    (stage,) = strong.vibration[:1]
    weak = strong.model_copy(
        update={"vibration": (stage.model_copy(update={"acceleration_g": 0.5}),)}
    )
    assert weak_ground({"1.5 g": strong}) == ()
    (ground,) = weak_ground({"0.5 g": weak, "1.5 g": strong})
    assert ground.text == "at 0.5 g the box never throws the sand: expect little there."


def test_what_is_swept_is_not_said_twice() -> None:
    verdict, drives = judged(summary(CLEAR))
    of_acceleration, _ = headline_of(verdict, ["vibration.0.acceleration_g"], drives)
    assert " with an amplitude of 0.150 mm, half of peak to peak: there" in of_acceleration
    of_amplitude, _ = headline_of(verdict, ["vibration.0.displacement_m"], drives)
    assert "Use 50 Hz (1.51 g): there" in of_amplitude
