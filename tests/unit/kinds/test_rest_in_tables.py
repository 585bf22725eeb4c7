"""Measures at rest are those of the summary; curves over vibration end with the vibration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sandmould.engines.snapshot import Snapshot, stored_snapshots
from sandmould.kinds.sand.measure import write_measures
from sandmould.kinds.sand.moments import list_moments, nearest
from sandmould.report.curves import time_chart
from sandmould.report.method import measured_when
from sandmould.report.sand import _chosen
from sandmould.runs.columns import during_vibration
from sandmould.statistics.over_time import passage_of
from sandmould.statistics.verdict import compare_settings
from sandmould.study.collect import gather
from tests.snapshots import write_snapshots
from tests.unit.report_study import DURATION_S, FILLING_S, KEY, PLANTED, scenario, write_study

RUN = "f50_r1"
REST_S = 0.3
FILL = "tube_fill_fraction"


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Every run ends with a rest of two snapshots, in which all sand leaves the tube."""
    folder = write_study(tmp_path / "tube", PLANTED, 3, ())
    for run in (folder / "runs").iterdir():
        stored = stored_snapshots(run)
        last, resting = stored[-1].load(), []
        for number in (1, 2):
            position = last.position_m.copy()
            position[position[:, 0] > 0.06, 0] -= 0.06
            resting.append(
                Snapshot(
                    **{
                        **vars(last),
                        "time_s": last.time_s + 0.5 * number * REST_S,
                        "stage": "rest",
                        "position_m": position,
                    }
                )
            )
        write_snapshots(run, resting, after=len(stored))
        write_measures(scenario(float(run.name[1:].split("_")[0])), run, run / "measures.tsv")
    return folder


def test_the_summary_takes_what_is_measured_at_rest(study: Path) -> None:
    row = gather(study).summary.set_index("run").loc[RUN]
    assert row["measured_stage"] == "rest"
    assert row["measured_time_s"] == pytest.approx(FILLING_S + DURATION_S + REST_S)
    assert row["measured_vibration_time_s"] == DURATION_S
    assert row[FILL] == 0.0


def test_curves_end_with_the_vibration(study: Path) -> None:
    found = gather(study)
    own = found.curves[found.curves["run"] == RUN]
    assert list(own["stage"].iloc[-3:]) == ["vibrate", "rest", "rest"]
    shaken = during_vibration(own)
    assert shaken["vibration_time_s"].is_unique
    assert (shaken["vibration_time_s"].min(), shaken["vibration_time_s"].max()) == (0.0, DURATION_S)
    summary = found.summary.assign(**{FILL: found.summary["replicate"] + found.summary[KEY]})
    verdict = compare_settings(summary, (KEY,), FILL)
    chart = time_chart(found.curves, summary, verdict, (KEY,), FILL)
    assert chart is not None
    for line in chart.lines:
        assert (np.diff(line.xy[:, 0]) > 0.0).all()
        assert line.xy[-1, 1] > 0.05
    passage = passage_of(found.curves, [RUN], FILL)
    assert passage is not None
    assert passage.last > 0.05


def test_pictures_and_profiles_of_the_end_show_the_sand_at_rest(study: Path) -> None:
    moments = list_moments(study / "runs" / RUN)
    assert nearest(moments, DURATION_S) == moments[-1]
    assert nearest(moments, 0.0).vibration_time_s == 0.0


def test_other_tables_have_no_rest() -> None:
    table = pd.DataFrame({"vibration_time_s": [-1.0, -1.0], "stage": ["cooling", np.nan]})
    assert during_vibration(table).empty


def test_the_report_says_where_it_measures(study: Path) -> None:
    moments = list_moments(study / "runs" / RUN)
    assert [heading for heading, _ in _chosen(moments, scenario(50.0))] == [
        "at its start", "after 1/8", "after 1/2", "at rest after its end"
    ]  # fmt: skip
    at_speed = scenario(50.0).model_copy(update={"measure_at_rest": False})
    assert _chosen(moments[:-2], at_speed)[-1][0] == "at its end"
    assert measured_when(scenario(50.0)) == "rest after vibration"
    assert measured_when(at_speed) == "the end of vibration"
