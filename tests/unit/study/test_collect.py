"""Collecting the runs of a study: nothing is lost when one of them is broken."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import pytest
import yaml

from sandmould.definition.study import Objective
from sandmould.kinds.sand.kind import SandStudy
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import PLACE, read_tables
from sandmould.study.collect import (
    NO_OUTCOME,
    collect,
    failed_runs,
    gather,
    read_collected,
    read_provenance,
    read_study,
)
from tests.unit.report_study import (
    DURATION_S,
    FAILED,
    KEY,
    PLANTED,
    scenario,
    write_cross_check,
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


def test_missing_files_are_gaps(study: Path) -> None:
    for name in ("outcome.json", "products.json", "measures.tsv"):
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
        ("products.json", ""),
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


def test_sentences_of_a_detail_are_apart(study: Path) -> None:
    run = study / "runs" / "f25_r1"
    # As an engine says it, without a full stop.
    RunOutcome(Outcome.BAD_INPUT, "it has Step, v_a", 1.0, 1.0).write(run / "outcome.json")
    table = pd.read_csv(run / "measures.tsv", sep="\t")
    table.loc[len(table)] = {"stage": "unreadable: snapshots/000009.npz"}
    table.to_csv(run / "measures.tsv", sep="\t", index=False)
    detail = gather(study).summary.set_index("run").loc["f25_r1", "detail"]
    assert detail == "it has Step, v_a. 1 snapshots cannot be read."


def test_collect_writes_what_reads_back(study: Path) -> None:
    collect(study)
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    assert summary["tube_fill_fraction"].notna().sum() == 8
    assert len(pd.read_csv(study / "curves.tsv", sep="\t")) == 100
    assert not list(study.glob("*.partial"))


def test_a_naive_grouping_of_any_table_holds_the_sweep_alone(tmp_path: Path) -> None:
    folder = write_cross_check(tmp_path / "demo")
    collect(folder)
    planned = pd.read_csv(folder / "runs.tsv", sep="\t")
    sweep = planned[planned["part"] == "sweep"]
    for name in ("summary", "curves"):
        table = pd.read_csv(folder / f"{name}.tsv", sep="\t")
        assert table.groupby(KEY)["run"].nunique().to_dict() == sweep.groupby(KEY).size().to_dict()
        assert set(table["part"]) == {"sweep"}
        assert set(table["engine"]) == {"reference"}
        checks = pd.read_csv(folder / f"{name}_checks.tsv", sep="\t")
        assert set(checks["run"]) == set(planned["run"]) - set(sweep["run"])
        assert set(checks["part"]) == {"cross_check"}
        assert set(checks["engine"]) == {"lammps"}


def test_tables_of_the_sweep_and_of_its_checks_read_back_together(tmp_path: Path) -> None:
    folder = write_cross_check(tmp_path / "demo")
    collect(folder)
    gathered, found = gather(folder), read_collected(folder)
    # the part says where a row was written, so it alone decides the order
    for name in ("summary", "curves"):
        table = getattr(gathered, name)
        in_order = table.sort_values("part", ascending=False, kind="stable", ignore_index=True)
        pd.testing.assert_frame_equal(getattr(found, name), in_order, check_exact=True)
    assert set(found.of_sweep.curves["part"]) == {"sweep"}


def test_failed_runs_fail_loudly(study: Path) -> None:
    collect(study)
    with pytest.raises(SystemExit, match=rf"1 of 9 runs did not finish:\n  {FAILED}: lost grains"):
        failed_runs(study)


def test_no_failed_run_passes(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube", failed=())
    collect(study)
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    assert list(summary["outcome"]) == [Outcome.FINISHED.label] * 9
    failed_runs(study)  # no SystemExit


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
        objective=Objective(measure="solid_fraction", better="smaller"),
    )
    text = yaml.safe_dump(planned.model_dump(mode="json"))
    (study / "study.yaml").write_text(text)
    assert read_study(study) == planned


def test_study_and_provenance_stand_in_without_their_files(study: Path) -> None:
    assert read_study(study).title == "Which frequency fills the tube best?"
    (study / "study.yaml").unlink()
    assert read_study(study).title == "tube"
    assert read_provenance(study / "runs" / "f25_r1")["machine"]["cores"] == 2
    assert read_provenance(study) == {}


def test_what_is_read_back_is_what_was_gathered(study: Path) -> None:
    runs = study / "runs"
    odd = {
        "float": [0.1 + 0.2, 1e-310, math.inf, math.nan],
        "mixed": [True, None, True, None],
        "flag": [True, False, True, True],
        "word": ["NA", "none", None, "1.5 or so"],
        "count": [1, 2, 3, 2**53 + 1],
    }
    for run in ("f25_r1", "f25_r2"):
        path = runs / run / "measures.tsv"
        table = pd.read_csv(path, sep="\t").iloc[-4:]
        table.assign(**odd).to_csv(path, sep="\t", index=False)
    told = {"f25_r1": "nan", "f25_r2": 'a "tab"\tand\nlines', "f25_r3": "12", "f50_r1": "NA"}
    for run, detail in told.items():
        RunOutcome(Outcome.FINISHED, detail, 1.0 / 3.0, 2.0).write(runs / run / "outcome.json")
    (runs / "f50_r2" / "outcome.json").unlink()
    (runs / "f50_r3" / "products.json").unlink()
    gathered = gather(study)
    collect(study)
    found = read_collected(study)
    assert found.keys == gathered.keys
    pd.testing.assert_frame_equal(found.summary, gathered.summary, check_exact=True)
    pd.testing.assert_frame_equal(found.curves, gathered.curves, check_exact=True)
    assert found.summary["detail"].iloc[:4].tolist() == list(told.values())


def test_tables_read_together_are_those_read_one_by_one(study: Path) -> None:
    """Other heads, a quoted cell, a row cut short, an empty table and a missing one between."""
    paths = [run / "measures.tsv" for run in sorted((study / "runs").iterdir())]
    text = paths[1].read_text()
    paths[1].write_text(text.replace("\tsettle\t", '\t"settle\tdown"\t'))
    paths[2].write_text(text.rsplit("\t", 1)[0])
    paths[3].unlink()
    paths[4].write_text(text.splitlines()[0])
    pd.read_csv(paths[5], sep="\t").assign(more=1).to_csv(paths[5], sep="\t", index=False)
    paths[6].write_text("a\tb\n1\t2\t3\n1\n")
    paths[7].write_bytes(b"\xff\xfe\x00")
    found = read_tables(paths)
    single = {}
    for place, path in enumerate(paths):
        try:
            single[place] = pd.read_csv(path, sep="\t")
        except (OSError, ValueError):
            assert place in (3, 7)
    assert set(found.problems) == {7}
    expected = pd.concat([table.assign(**{PLACE: p}) for p, table in single.items()])
    expected = expected.reset_index(drop=True)[found.rows.columns]
    pd.testing.assert_frame_equal(found.rows, expected, check_dtype=False)
    assert {p: list(c) for p, c in found.columns.items()} == {
        place: list(table.columns) for place, table in single.items()
    }
