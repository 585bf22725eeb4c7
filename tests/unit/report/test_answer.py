"""The first screen: what to set on the machine, how sure that is, what to do next."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import pandas as pd
import pytest

from sandmould.kinds.sand.kind import SandStudy
from sandmould.report.answer import figures_of, table_of
from sandmould.report.tables import share_of_what_fits
from sandmould.runs.columns import CROSS_CHECK, OUTCOME_CODE, PART, RUN, SWEEP
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.answer import Answer, Asked
from sandmould.statistics.decision import Evidence, decide
from sandmould.wording.next_steps import (
    NextStep,
    answer_steps,
    certificate_steps,
    failed_steps,
    step,
    with_file,
)
from tests.answered import one_value, two_cavities

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


def judged(table: pd.DataFrame, is_driven: bool = True) -> Answer:
    swept = table[table[PART] == SWEEP]
    drives = {f"{hz:g} Hz": BoxDrive(hz, 1.5e-4) for hz in set(swept[KEY]) if is_driven}
    return decide(Asked(FILL, "larger", (KEY,)), Evidence(swept, drives=drives))


CLEAR = {25.0: (0.30, 0.31, 0.32), 50.0: (0.60, 0.61, 0.63), 100.0: (0.40, 0.42, 0.41)}
ALIKE = {25.0: (0.58, 0.62, 0.60), 50.0: (0.61, 0.59, 0.63), 100.0: (0.30, 0.31, 0.32)}


def test_the_best_setting_stands_in_words_of_the_machine() -> None:
    table = summary(CLEAR)
    other = table[table[KEY] == 50.0].copy()
    other[PART] = CROSS_CHECK
    other[[FILL, "tube_fill_of_bed_fraction"]] = 0.1
    table = pd.concat([table, other], ignore_index=True)
    figures = figures_of(judged(table), table)
    assert [(it.value, it.label) for it in figures] == [
        ("50 Hz", "frequency"),
        ("0.150 mm", "amplitude (half of peak to peak)"),
        ("1.51 g", "peak acceleration"),
        ("77 %", "of what fits in"),
        ("0.613 ± 0.038", "fill of the tube"),
    ]


def test_a_fill_over_that_of_the_bed_is_its_own_share() -> None:
    table = summary(CLEAR)
    for measure in (FILL, "tube_fill_of_bed_fraction"):
        assert share_of_what_fits(table, measure, {KEY: 25.0}) == pytest.approx(1.25 * 0.31)
    assert math.isnan(share_of_what_fits(table, "solid_fraction"))


def test_settings_that_may_be_the_best_stand_below_each_other() -> None:
    shown = table_of(judged(summary(ALIKE)))
    assert shown is not None
    assert [row[0].text for row in shown.rows] == [
        "50 Hz (±0.15 mm, 1.5 g)", "25 Hz (±0.15 mm, 0.38 g)"
    ]  # fmt: skip
    assert table_of(judged(summary(CLEAR))) is None


def test_results_without_the_share_and_without_a_drive_have_no_such_figures() -> None:
    table = summary(CLEAR).drop(columns="tube_fill_of_bed_fraction")
    figures = figures_of(judged(table, is_driven=False), table)
    assert [(it.value, it.label) for it in figures] == [
        ("50 Hz", "frequency"),
        ("0.613 ± 0.038", "fill of the tube"),
    ]


def steps_of(table: pd.DataFrame, replicates: int = 3) -> list[NextStep]:
    keys = {KEY: sorted(set(table[KEY]))}
    study = SandStudy.model_validate({"sweep": {"keys": keys}, "replicates": replicates})
    answer = judged(table)
    return [*answer_steps(study, answer), *certificate_steps(study, answer)]


def test_lines_of_steps_belong_in_the_users_file() -> None:
    line = step("chance", "replicates: 3", runs=3)
    own = with_file([line], "mine/tube.yaml", "", "tube")
    assert own.before == "Write them into mine/tube.yaml, then run"
    assert own.command == "sandmould run mine/tube.yaml"
    shipped = with_file([line], "shipped study tube_demo", "tube_demo", "tube_demo")
    assert "my_study.yaml below based_on: tube_demo" in shipped.before
    assert shipped.command == "sandmould run my_study.yaml"
    assert with_file([step("try", is_sand=True)], None, "", "tube").before == ""


def test_what_to_do_next_says_how_many_runs() -> None:
    table = summary(ALIKE)
    table.loc[table[KEY] == 25.0, FILL] = [0.59, 0.57, 0.595]
    wanted = int(steps_of(table)[0].line.removeprefix("replicates: "))
    assert 3 < wanted <= 33


def test_a_difference_that_is_not_worth_the_runs_is_left_alone() -> None:
    (choose, *_) = steps_of(summary(ALIKE))
    assert "50 Hz and 25 Hz" in choose.text
    assert choose.line == ""


def test_single_runs_ask_for_replicates_and_then_for_the_certificate() -> None:
    fills = {f: (0.5 - abs(f - 50) / 200,) for f in (25.0, 50.0, 75.0, 100.0)}
    lines = [each.line for each in steps_of(summary(fills), replicates=1)]
    assert lines == ["replicates: 3", "certificate: {controls: [springs, hold, time_step]}"]


def test_the_end_of_the_sweep_is_next() -> None:
    beyond, few = steps_of(
        summary({25.0: (0.6, 0.61, 0.62), 50.0: (0.3, 0.31, 0.33), 100.0: (0.2, 0.21, 0.2)})
    )
    assert "below 25 Hz" in beyond.text
    assert "4 frequencies" in few.text
    (failed,) = failed_steps({"f100_r2": "the pattern is to move by 0.0514 m"})
    assert failed.command == "sandmould again f100_r2"
    assert "did not finish: the pattern is to move by 0.0514 m. Where the cause" in failed.text


def test_several_things_asked_make_a_table_of_what_trades() -> None:
    table = table_of(two_cavities())
    assert table is not None
    assert [column.title for column in table.columns] == ["setting", "pocket", "hole18"]
    assert [row[0].text[:5] for row in table.rows] == ["30 Hz", "45 Hz", "60 Hz"]
    assert table.rows[0][2].text.startswith("97")
    assert table.marked == (False, False, False)
    assert table_of(one_value()) is None
