"""Collecting the runs of a study: nothing is lost when one of them is broken."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import pytest
import yaml

from sandmould.runs.outcome import Outcome
from sandmould.study.check import failed_runs
from sandmould.study.collect import (
    NO_OUTCOME,
    collect,
    gather,
    read_provenance,
    read_study,
)
from sandmould.study.definition.study import Objective
from sandmould.study.kinds.sand.kind import SandStudy
from tests.unit.report_study import (
    DURATION_S,
    FAILED,
    FILLING_S,
    KEY,
    PLANTED,
    scenario,
    write_study,
)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    return write_study(tmp_path / "tube")


def test_one_row_a_run_in_the_order_of_the_plan(study: Path) -> None:
    found = gather(study)
    plan = pd.read_csv(study / "runs.tsv", sep="\t")
    assert found.keys == (KEY,)
    assert list(found.summary["run"]) == list(plan["run"])
    assert list(found.summary.columns[:4]) == ["run", KEY, "replicate", "seed"]
    row = found.summary.set_index("run").loc["f50_r1"]
    assert row["outcome"] == "finished"
    assert row["tube_fill_fraction"] == pytest.approx(PLANTED[50.0], abs=0.05)
    assert row["measured_vibration_time_s"] == DURATION_S
    assert (row["grains"], row["engine"], row["wall_s"]) == (200, "lammps", 41.5)
    # the run's largest overlap, not the last snapshot's
    assert row["largest_overlap_fraction"] == 0.034
    assert row["measured_largest_overlap_fraction"] == 0.02


def test_curves_hold_every_snapshot_with_its_parameters(study: Path) -> None:
    curves = gather(study).curves
    assert list(curves.columns[:3]) == ["run", KEY, "replicate"]
    assert len(curves) == 8 * 12 + 4
    assert set(curves.loc[curves["run"] == "f25_r2", KEY]) == {25}


def test_failed_run_has_gaps_and_says_why(study: Path) -> None:
    row = gather(study).summary.set_index("run").loc[FAILED]
    assert row["outcome"] == "lost grains"
    assert "passed through the floor" in row["detail"]
    assert math.isnan(row["tube_fill_fraction"])
    assert row["simulated_s"] < row["planned_s"]


def test_objective_time_picks_the_snapshot_nearest_to_it(study: Path) -> None:
    summary = gather(study, at_vibration_s=1.02).summary.set_index("run")
    assert summary.loc["f50_r1", "measured_vibration_time_s"] == 1.0
    assert summary.loc["f50_r1", "measured_time_s"] == FILLING_S + 1.0
    assert math.isnan(summary.loc[FAILED, "measured_vibration_time_s"])
    assert gather(study, at_vibration_s=3.0).summary.get("tube_fill_fraction") is None


def test_missing_files_are_gaps(study: Path) -> None:
    for name in ("outcome.json", "cost.tsv", "measures.tsv"):
        (study / "runs" / "f25_r1" / name).unlink()
    row = gather(study).summary.set_index("run").loc["f25_r1"]
    assert row["outcome"] == NO_OUTCOME
    assert row["detail"] == ""
    assert row[["outcome_code", "wall_s", "tube_fill_fraction"]].isna().all()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("outcome.json", "{"),
        ("outcome.json", '{"code": 7, "detail": "", "simulated_s": 1, "planned_s": 1}'),
        ("outcome.json", "[]"),
        ("cost.tsv", ""),
        ("measures.tsv", "time_s\tstage\n1\tsettle\n"),
        ("measures.tsv", "time_s\tvibration_time_s\tstage\nsoon\t1\tsettle\n"),
    ],
)
def test_unreadable_file_is_named_in_the_detail(study: Path, name: str, text: str) -> None:
    (study / "runs" / "f25_r1" / name).write_text(text)
    found = gather(study)
    assert f"{name} cannot be read" in found.summary.set_index("run").loc["f25_r1", "detail"]
    assert (found.summary["outcome"] == "finished").sum() >= 7


def test_unreadable_snapshot_is_counted_and_passed_over(study: Path) -> None:
    path = study / "runs" / "f25_r1" / "measures.tsv"
    table = pd.read_csv(path, sep="\t")
    gap = pd.DataFrame([{"stage": "unreadable: 000012.npz"}])
    pd.concat([table, gap]).to_csv(path, sep="\t", index=False)
    found = gather(study)
    row = found.summary.set_index("run").loc["f25_r1"]
    assert "1 snapshots cannot be read" in row["detail"]
    assert row["tube_fill_fraction"] == pytest.approx(0.3, abs=0.05)
    assert len(found.curves) == 8 * 12 + 5


def test_collect_writes_what_reads_back(study: Path) -> None:
    collect(study)
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    assert summary["tube_fill_fraction"].notna().sum() == 8
    assert len(pd.read_csv(study / "curves.tsv", sep="\t")) == 100
    assert not list(study.glob("*.partial"))


def test_failed_runs_fail_loudly(study: Path) -> None:
    collect(study)
    with pytest.raises(SystemExit, match=rf"1 of 9 runs did not finish:\n  {FAILED}: lost grains"):
        failed_runs(study / "summary.tsv")


def test_no_failed_run_passes(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube", failed=())
    collect(study)
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    assert list(summary["outcome"]) == [Outcome.FINISHED.label] * 9
    failed_runs(study / "summary.tsv")  # no SystemExit


def test_study_without_any_run_started(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube")
    for file in study.glob("runs/*/*.[jt]s*"):
        file.unlink()
    found = gather(study)
    assert set(found.summary["outcome"]) == {NO_OUTCOME}
    assert found.curves.empty


def test_study_reads_back_whole(study: Path) -> None:
    planned = SandStudy(
        title="Pack",
        scenario=scenario(50.0),
        objective=Objective(measure="solid_fraction", better="smaller", at_vibration_s=1.0),
    )
    text = yaml.safe_dump(planned.model_dump(mode="json"))
    (study / "study.yaml").write_text(text)
    assert read_study(study) == planned
    collect(study)
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    assert set(summary["measured_vibration_time_s"].dropna()) == {1.0}


def test_study_and_provenance_stand_in_without_their_files(study: Path) -> None:
    assert read_study(study).title == "Which frequency fills the tube best?"
    (study / "study.yaml").unlink()
    assert read_study(study).title == "tube"
    assert read_provenance(study / "runs" / "f25_r1")["machine"]["cores"] == 2
    assert read_provenance(study) == {}
