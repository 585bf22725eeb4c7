"""Tables and exports of a run, and whether committed results still stand."""

from __future__ import annotations

import json
import math
import zipfile
from pathlib import Path

import meshio
import numpy as np
import pandas as pd
import pytest

from sandmould import ROOT
from sandmould.definition.run import Run
from sandmould.engines.snapshot import Snapshot, stored_snapshots
from sandmould.execution import records
from sandmould.kinds.sand.exports import write_exports, write_picture
from sandmould.kinds.sand.measure import write_measures, write_profile
from sandmould.runs.manifest import save_manifest
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import read_run
from sandmould.study.rounds.round_log import ROUNDS_FILE, Round, RoundLog, basis_of, write_rounds
from tests.planned import write_plan
from tests.scenes import tube_scene
from tests.snapshots import damage, write_snapshots

R = 0.002


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write a run of three snapshots: one grain moves from the box into the tube."""
    write_plan([Run("test", "one", {}, 1, tube_scene(), {})], tmp_path)
    folder = tmp_path / "runs" / "one"
    made = [
        Snapshot(
            0.1 * i, 0.1 * i, "vibrate_1", np.array([1, 2]), np.array([1, 1]),
            np.array([[x, 0.02], [0.01, R]]), np.zeros((2, 2)), np.zeros((2, 3)), np.full(2, R),
        )
        for i, x in enumerate((0.02, 0.05, 0.06))
    ]  # fmt: skip
    write_snapshots(folder, made)
    return folder


def test_measures_have_a_row_a_snapshot_and_gaps_for_broken_ones(folder: Path) -> None:
    write_snapshots(folder, [stored_snapshots(folder)[0].load()], after=3)
    damage(folder, 3)
    write_measures(read_run(folder / "scenario.yaml").scenario, folder, folder / "measures.tsv")
    table = pd.read_csv(folder / "measures.tsv", sep="\t")
    bore = 0.02 * 0.03
    grain = np.pi * R**2
    fill = list(table.tube_fill_fraction)
    assert fill[:3] == pytest.approx([0, grain / 2 / bore, grain / bore])
    of_bed = list(table.tube_fill_of_bed_fraction * table.solid_fraction)
    assert of_bed[:3] == pytest.approx(fill[:3])
    assert np.isnan(fill[3])
    assert "000003" in table.stage[3]


def test_exports_are_read_back_by_meshio_and_hold_the_moments(folder: Path) -> None:
    write_exports(read_run(folder / "scenario.yaml").scenario, folder, folder / "exports.zip")
    with zipfile.ZipFile(folder / "exports.zip") as archive:
        names = sorted(archive.namelist())
        archive.extractall(folder / "unpacked")
    assert names == ["000000.dump", "000000.vtu", "000001.dump", "000001.vtu", "000002.dump",
                     "000002.vtu", "solids.vtu"]  # fmt: skip
    mesh = meshio.read(folder / "unpacked" / "000002.vtu")
    assert mesh.points[0] == pytest.approx([0.06, 0.02, 0.0])


def test_profile_sums_to_the_sand_in_the_box(folder: Path) -> None:
    write_profile(read_run(folder / "scenario.yaml").scenario, folder, folder / "profile.tsv")
    table = pd.read_csv(folder / "profile.tsv", sep="\t")
    assert list(dict.fromkeys(table.moment)) == [
        "at its start", "after 1/8", "after 1/2", "at its end"
    ]  # fmt: skip
    last = table[table.moment == "at its end"]
    slab = last.height_m.diff().iloc[1]
    # The tube's plates leave less than the box's width free in their slabs: those are left out.
    below = last[last.height_m < 0.012 - slab / 2]
    assert (below.solid_fraction * slab * 0.08).sum() == pytest.approx(np.pi * R**2, rel=1e-4)


def test_picture_of_a_run_without_snapshots_shows_the_scene(folder: Path) -> None:
    (folder / "snapshots.npz").unlink()
    write_picture(read_run(folder / "scenario.yaml").scenario, folder, folder / "final.png")
    write_exports(read_run(folder / "scenario.yaml").scenario, folder, folder / "exports.zip")
    write_measures(read_run(folder / "scenario.yaml").scenario, folder, folder / "measures.tsv")
    assert (folder / "final.png").stat().st_size > 1000
    assert list(pd.read_csv(folder / "measures.tsv", sep="\t").columns)


@pytest.mark.slow
def test_record_is_stale_when_its_study_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = "config/studies/tube_demo.yaml"
    runs = expand(open_study(ROOT / study))
    digest, scenarios = records.study_hash(runs), records.scenarios_hash(runs)
    other = {"study": study, "study_sha256": "0" * 64, "defaults": records.DEFAULTS}
    for name, kept in (
        ("good", {"study": study, "study_sha256": digest}),
        ("old", {"study": study, "study_sha256": "0" * 64}),
        ("new", other),
        ("older", other | {"scenarios_sha256": scenarios}),
        ("gone", {"study": "config/studies/no_such.yaml", "study_sha256": digest}),
    ):
        (tmp_path / name).mkdir()
        (tmp_path / name / "record.json").write_text(json.dumps(kept))
    monkeypatch.setattr(records, "RECORDS", tmp_path)
    told = dict(records.stale_records())
    assert told["good"] == ""
    assert told["old"] == records.OLD_DEFAULTS
    assert "changed" in told["new"]
    assert told["older"] == records.OLDER_SOLVER
    assert "gone" in told["gone"]


@pytest.mark.slow
def test_record_of_a_study_with_rounds_rests_on_the_runs_they_added(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = "config/studies/tube_certified.yaml"
    # Decks of 300 runs are rendered in half a minute, and change with no round.
    monkeypatch.setattr(records, "_computed_hash", lambda run: "")
    opened = open_study(ROOT / study)
    folder = tmp_path / "tube_certified"
    folder.mkdir()
    one = Round((({"vibration.0.frequency_hz": 62.0}, 1),), {}, {}, 0.1)
    log = RoundLog(basis_of(opened.study), (one,), "All is done.", (43.0, 60.0, 84.0))
    write_rounds(log, folder)
    runs = records.runs_in(opened, folder)
    assert len(runs) > len(expand(opened)) + 1
    kept = {
        "study": study, "study_sha256": records.study_hash(runs), "defaults": records.DEFAULTS,
    }  # fmt: skip
    (folder / "record.json").write_text(json.dumps(kept))
    monkeypatch.setattr(records, "RECORDS", tmp_path)
    assert records.stale_records() == [("tube_certified", "")]
    (folder / ROUNDS_FILE).unlink()
    assert "changed" in records.stale_records()[0][1]


@pytest.mark.parametrize(
    ("differences", "status", "said"),
    [([], 0, "count: its results are the same"), (["a: mean b is 1, recorded 2"], 1, "do not")],
)
def test_records_of_an_older_solver_count_while_the_cheapest_study_gives_the_same(
    differences: list[str],
    status: int,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    kept = [("here", ""), ("there", records.OLDER_SOLVER), ("before", records.OLD_DEFAULTS)]
    monkeypatch.setattr(records, "stale_records", lambda: kept)
    monkeypatch.setattr(records, "recompute_smallest", lambda results: differences)
    assert records.main(["check"]) == status
    last = capsys.readouterr().out.splitlines()[-1]
    assert said in last
    assert last.endswith(": there.")


def test_stale_records_are_made_again_the_cheapest_first_and_a_failure_stops_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("tube_demo", "plates_small", "bracket_paper", "tank_start")
    for name in names:
        (tmp_path / name).mkdir()
        study = {"study": f"config/studies/{name}.yaml"}
        (tmp_path / name / "record.json").write_text(json.dumps(study))
    told = [(name, records.OLD_DEFAULTS) for name in names[:3]] + [("tank_start", "")]
    monkeypatch.setattr(records, "RECORDS", tmp_path)
    monkeypatch.setattr(records, "stale_records", lambda: told)
    monkeypatch.setattr(records, "MOST_S", 0.5 * records.MOST_S)
    computed, kept = [], []

    def keep(study: Path, results: Path) -> None:
        if "plates" in study.stem:
            raise SystemExit("3 runs are missing")
        kept.append(study.stem)

    monkeypatch.setattr(records, "_compute", lambda study: computed.append(Path(study).stem))
    monkeypatch.setattr(records, "record", keep)
    assert records.main(["renew"]) == 1
    assert computed == ["plates_small", "tube_demo"]
    assert kept == ["tube_demo"]
    said = capsys.readouterr().out
    assert "bracket_paper is left: it takes about" in said
    assert "plates_small has no new record: 3 runs are missing" in said


def test_unfinished_study_is_not_recorded(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"is not whole, 32 runs are missing: run the study"):
        records.record(ROOT / "config" / "studies" / "tube_demo.yaml", tmp_path)


def test_committed_records_are_whole() -> None:
    paths = sorted((ROOT / "docs" / "results").glob("*/record.json"))
    assert paths
    for path in paths:
        kept = json.loads(path.read_text(encoding="utf-8"))
        assert {"command", "commit", "versions", "machine", "study_sha256"} <= set(kept)
        assert "dirty" not in kept["commit"]
        summary = pd.read_csv(path.with_name("summary.tsv"), sep="\t")
        failed = summary[summary.outcome != "finished"]
        assert dict(zip(failed.run, failed.outcome, strict=True)) == kept.get("failed", {})


def test_record_of_a_study_that_compares_keeps_its_agreement_and_engines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = ROOT / "config" / "studies" / "engine_twins.yaml"
    runs = expand(open_study(path))
    folder = tmp_path / "results" / "engine_twins"
    first = folder / "runs" / runs[0].run
    first.mkdir(parents=True)
    said = {"commit": "abc1234", "versions": {}, "machine": {}}
    save_manifest(first, {"origin": said})
    rows = [{"run": r.run, "engine": r.scenario.engine.name, "version": "7", "outcome_code": 0,
             "outcome": "finished", "wall_s": 2.0, "grain_steps": 1e6, "grain_steps_per_s": 5e5}
            for r in runs]  # fmt: skip
    rows[5]["outcome"] = "lost grains"
    for run in runs:
        (folder / "runs" / run.run).mkdir(exist_ok=True)
        (folder / "runs" / run.run / "outcome.json").touch()
    pd.DataFrame(rows).to_csv(folder / "summary.tsv", sep="\t", index=False)
    (folder / "curves.tsv").write_text("run\ttime_s\n")
    for name in ("agreement.tsv", "report.html"):
        (folder / name).write_text("")
    (folder / "figures").mkdir()
    for name in ("objective.svg", "curves.svg", ".snakemake_timestamp"):
        (folder / "figures" / name).write_text("<svg/>")
    monkeypatch.setattr(records, "RECORDS", tmp_path / "records")
    # Hundreds of decks: another test hashes a study.
    monkeypatch.setattr(records, "_computed_hash", lambda run: run.scenario.engine.name)
    with pytest.raises(FileNotFoundError, match=r"sand\.png"):
        records.record(path, tmp_path / "results", ["sand.png"])
    kept = records.record(path, tmp_path / "results", ["objective.svg"])
    (folder / "figures" / "objective.svg").write_text("<svg>drawn anew</svg>")
    assert records.record(path, tmp_path / "results") == kept
    assert (kept / "agreement.tsv").exists()
    (figure,) = (kept / "figures").iterdir()
    assert (figure.name, figure.read_text()) == ("objective.svg", "<svg>drawn anew</svg>")
    record = json.loads((kept / "record.json").read_text())
    assert set(record["engines"]) == {"lammps", "liggghts", "reference"}
    assert record["failed"] == {runs[5].run: "lost grains"}
    record["study"] = "config/studies/engine_twins.yaml"
    (kept / "record.json").write_text(json.dumps(record))
    assert records.stale_records() == [("engine_twins", "")]
    record["margins"]["solid_fraction"] = 0.5
    (kept / "record.json").write_text(json.dumps(record))
    assert records.stale_records() == [("engine_twins", "its margins were set after the runs")]


def test_a_record_keeps_the_fill_at_eight_moments_of_each_runs_vibration() -> None:
    times_s = [math.nan, *np.linspace(0, 2, 41), 2.0]
    one = pd.DataFrame({
        "vibration_time_s": times_s, "stage": ["settle_1", *["vibrate_1"] * 41, "vibrate_1_rest"],
        "tube_fill_fraction": np.arange(43.0), "other": 0.0,
    })  # fmt: skip
    # A run that was stopped has its own moments.
    curves = pd.concat([one.assign(run="whole"), one.iloc[:22].assign(run="stopped")])
    kept = records.over_time(curves, "tube_fill_fraction")
    assert list(kept.columns) == ["run", "vibration_time_s", "tube_fill_fraction"]
    whole = kept[kept.run == "whole"]
    assert list(whole.vibration_time_s) == pytest.approx(list(np.arange(1, 9) / 4))
    assert list(whole.tube_fill_fraction) == [6, 11, 16, 21, 26, 31, 36, 41]
    assert kept[kept.run == "stopped"].vibration_time_s.max() == pytest.approx(1.0)
    assert records.over_time(curves.drop(columns="vibration_time_s"), "other").empty


def test_a_record_counts_the_work_of_any_kind() -> None:
    summary = pd.DataFrame({
        "engine": ["arpm", "differences", "arpm"], "version": ["a", "b", "c"],
        "outcome_code": [0, 0, 300], "element_steps": [2.0, 3.0, 1.0],
    })  # fmt: skip
    assert records._work("element_steps", summary) == {"element_steps": 6.0}
    assert records._work("grain_steps", summary) == {}
    assert records._engines(summary) == {"arpm": "a", "differences": "b"}
