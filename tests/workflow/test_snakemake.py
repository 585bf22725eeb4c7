"""The workflow as a user runs it: dry runs, one tiny study, a failing run, bad input."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from collections import Counter
from pathlib import Path

import pandas as pd
import pytest

from sandmould import ROOT
from sandmould.kinds.registry import kind_named
from sandmould.runs.outcome import Outcome
from sandmould.runs.run_tables import read_costs
from sandmould.study.plan.load_study import open_study
from sandmould.user_cache import user_cache
from tests.workflow.dry_runs import dry_run
from tests.workflow.runs import kill_at_a_checkpoint

SNAKEMAKE = Path(sys.executable).parent / "snakemake"
STUDIES = sorted((ROOT / "config" / "studies").glob("*.yaml"))
TINY = """\
based_on: tube
scenario:
  sand: {size_scale: 16, size_classes: 3, disc_thickness_m: 0.1}
  time_step: {fraction: 0.8}
  rest: {rms_speed_m_s: 0.05, load_tolerance: 0.1, checks: 3}
  vibration: [{frequency_hz: 50, acceleration_g: 1.5, duration_s: 0.06}]
  record: {snapshot_every_s: 0.02}
"""


def snakemake(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the workflow with its results below a folder."""
    command = [str(SNAKEMAKE), "--cores", "2", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Link the repository's parts into an empty folder, so that results lie there."""
    for name in ("Snakefile", "workflow", "templates", "config", "profiles"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "results").mkdir()
    return tmp_path


@pytest.mark.parametrize("study", STUDIES, ids=lambda p: p.stem)
def test_dry_run_of_every_study(study: Path, checkout: Path) -> None:
    opened = open_study(study).study
    for other in opened.calibration.also:
        (checkout / "results" / other).mkdir()
        targets = [name for sand in opened.calibration.sands for name in sand.targets]
        header = "\t".join(name.removeprefix(f"{other}__") for name in targets)
        (checkout / "results" / other / "summary.tsv").write_text(header + "\n")
    ran = dry_run("--cores", "2", "--configfile", str(study), folder=checkout)
    assert ran.returncode == 0, ran.stderr
    assert kind_named(opened.kind).planning.work_unit in ran.stderr
    assert "Wall time on 2 cores" in ran.stderr
    assert (checkout / "results" / study.stem / "runs.tsv").exists()


@pytest.mark.usefixtures("unmeasured")
def test_a_dry_run_starts_no_engine(checkout: Path) -> None:
    ran = dry_run("--cores", "2", folder=checkout)
    assert ran.returncode == 0, ran.stderr
    assert ", an estimate" in ran.stderr
    assert not (user_cache() / "speeds").exists()


def test_a_study_that_rests_on_another_says_what_comes_first(checkout: Path) -> None:
    study = ROOT / "config" / "studies" / "calibrate_sand.yaml"
    ran = dry_run("--cores", "2", "--configfile", str(study), folder=checkout)
    assert ran.returncode != 0
    assert (
        "calibrate_sand.yaml: calibration.also.0 = 'repose_map' cannot be used: valid is a study "
        "with results: sandmould run repose_map comes first." in ran.stderr
    )


def test_single_values_and_second_files_are_refused(checkout: Path) -> None:
    ran = dry_run("--cores", "2", "--config", "density=3", folder=checkout)
    assert ran.returncode != 0
    assert "--config = {'density': 3} cannot be used: valid is no value" in ran.stderr
    files = [str(path) for path in STUDIES[:2]]
    ran = dry_run("--cores", "2", "--configfile", *files, folder=checkout)
    assert ran.returncode != 0
    assert "valid is one study at a time" in ran.stderr
    assert not list((checkout / "results").glob("*/"))


def test_bare_snakemake_is_the_demo(checkout: Path) -> None:
    ran = dry_run("--cores", "2", folder=checkout)
    assert ran.returncode == 0, ran.stderr
    assert (checkout / "results" / "tube_demo" / "runs.tsv").exists()


def test_tiny_study_end_to_end(checkout: Path) -> None:
    study = checkout / "tiny.yaml"
    sweep = "sweep:\n  keys: {vibration.0.frequency_hz: [50, 100]}\nreplicates: 1\n"
    study.write_text(TINY + sweep)
    ran = snakemake("--configfile", str(study), folder=checkout)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "M grain-steps/s" in ran.stderr
    results = checkout / "results" / "tiny"
    summary = pd.read_csv(results / "summary.tsv", sep="\t")
    assert list(summary.outcome) == ["finished", "finished"]
    assert summary.tube_fill_fraction.between(0.01, 0.9).all()
    assert summary.solid_fraction.between(0.4, 0.9).all()
    assert (results / "report.html").stat().st_size < 15e6
    # A job of its own made the one fill from which both runs go on; each bears half of it.
    (fill,) = results.glob("fills/*/outcome.json")
    assert "Compute fill_r1_" in ran.stderr
    assert list(summary.fill) == [fill.parent.name] * 2
    assert summary.fill_wall_s.sum() == pytest.approx(read_costs([fill.parent]).rows.wall_s[0])

    again = snakemake("--configfile", str(study), folder=checkout)
    assert "Nothing to be done" in again.stdout + again.stderr

    # One more point: only its run is computed, those that finished keep their files.
    before = {p: p.stat().st_mtime_ns for p in (*results.glob("runs/*/outcome.json"), fill)}
    study.write_text(TINY + sweep.replace("100]", "100, 75]"))
    more = snakemake("--configfile", str(study), folder=checkout)
    assert more.returncode == 0, more.stderr
    assert all(p.stat().st_mtime_ns == t for p, t in before.items())
    assert len(list(results.glob("runs/*/outcome.json"))) == 3
    assert set(pd.read_csv(results / "summary.tsv", sep="\t").fill) == {fill.parent.name}

    report = snakemake(
        "--configfile", str(study), "--report", str(checkout / "report.zip"), folder=checkout
    )
    assert report.returncode == 0, report.stderr
    assert (checkout / "report.zip").stat().st_size > 1e5


def test_one_command_computes_a_sweep_and_its_rounds(checkout: Path) -> None:
    study = checkout / "refined.yaml"
    study.write_text(
        TINY.replace("scenario:", "scenario:\n  engine: {name: reference}")
        + "sweep: {keys: {vibration.0.frequency_hz: [25, 50, 100, 200]}}\n"
        "refine: {rounds: 1, runs: 2}\n"
    )
    command = [sys.executable, "-m", "sandmould.cli", "run", str(study), "--cores", "2"]
    ran = subprocess.run(command, cwd=checkout, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stderr
    assert "Round 1 of at most 1: best so far is frequency" in ran.stderr
    assert "The one round is done." in ran.stderr
    assert "The report: results/refined/report.html" in ran.stdout
    results = checkout / "results" / "refined"
    runs = pd.read_csv(results / "summary.tsv", sep="\t")
    assert len(runs) == 6
    written = [(results / "runs" / r / "outcome.json").stat().st_mtime_ns for r in runs.run]
    # A run of the round goes on from the fill of the sweep, too; one of another filling does not.
    (fill,) = results.glob("fills/*/outcome.json")
    assert set(runs.fill[runs.replicate == 1]) == {fill.parent.name}
    assert (runs.replicate[4:] == 1).any(), runs
    assert fill.stat().st_mtime_ns < min(written)
    # The sweep's runs were all there before the first of the round.
    assert max(written[:4]) < min(written[4:])


def test_point_of_a_sweep_on_two_engines(checkout: Path) -> None:
    study = checkout / "checked.yaml"
    study.write_text(
        TINY.replace(
            "scenario:",
            "scenario:\n  engine: {name: reference, ranks: 2}\n"
            "  fill: {layers: [{height_m: 0.027}]}",
        )
        + "sweep: {keys: {sand.disc_inertia: [sphere, disc]}}\nreplicates: 2\n"
        "cross_check: {engine: liggghts, at: {sand.disc_inertia: sphere}, replicates: 2}\n"
        "equivalence: {margins: {solid_fraction: 0.05}}\n"
    )
    refused = dry_run("--cores", "2", "--configfile", str(study), folder=checkout)
    assert refused.returncode != 0
    assert "on engine liggghts" in refused.stderr
    study.write_text(study.read_text().replace("engine: liggghts", "engine: lammps"))
    # Two ranks of LAMMPS are two processes, two of the reference engine two threads of one.
    ran = snakemake("--configfile", str(study), folder=checkout)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    results = checkout / "results" / "checked"
    summary = pd.read_csv(results / "summary.tsv", sep="\t")
    checks = pd.read_csv(results / "summary_checks.tsv", sep="\t")
    assert (list(summary.engine), list(checks.engine)) == (["reference"] * 4, ["lammps"] * 2)
    assert {*summary.ranks, *checks.ranks} == {2}
    assert (set(summary.part), set(checks.part)) == ({"sweep"}, {"cross_check"})
    (pair,) = pd.read_csv(results / "agreement.tsv", sep="\t").to_dict("records")
    assert (pair["first"], pair["second"], pair["n"]) == ("reference", "lammps", 2)
    assert "Do the settings agree?" in (results / "report.html").read_text()


def test_killed_snakemake_is_taken_up_by_the_next(checkout: Path) -> None:
    study = checkout / "killed.yaml"
    study.write_text(TINY + "replicates: 2\nsweep: {}\n")
    command = [str(SNAKEMAKE), "--cores", "2", "--configfile", str(study)]
    kill_at_a_checkpoint(command, checkout, "results/killed/runs/*", limit_s=120.0)
    results = checkout / "results" / "killed"
    ran = snakemake("--configfile", str(study), folder=checkout)
    assert ran.returncode == 0, ran.stderr
    summary = pd.read_csv(results / "summary.tsv", sep="\t")
    assert list(summary.outcome) == ["finished", "finished"]
    assert not list(results.glob("runs/*/work/checkpoint*"))


def test_small_tube_in_3d(checkout: Path) -> None:
    study = str(ROOT / "config" / "studies" / "tube_3d_small.yaml")
    ran = snakemake("--configfile", study, folder=checkout)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    results = checkout / "results" / "tube_3d_small"
    summary = pd.read_csv(results / "summary.tsv", sep="\t").iloc[0]
    assert summary.grains == 2000
    assert 0.02 < summary.tube_fill_fraction < 0.7
    # Below dense random packing, 0.64; walls a few diameters apart and the hollow under the tube
    # take up to a third of loose random packing, 0.55.
    assert 0.36 < summary.solid_fraction < 0.64
    (run,) = results.glob("runs/*")
    subprocess.run([SNAKEMAKE.with_name("sandmould"), "export", run], cwd=checkout, check=True)
    assert (run / "final.png").stat().st_size > 5000
    names = zipfile.ZipFile(run / "exports.zip").namelist()
    counted = Counter(Path(name).suffix for name in names if name != "solids.vtu")
    assert counted[".vtu"] == counted[".dump"] >= 3
    assert "solids.vtu" in names


def test_one_failing_run_leaves_the_others_alone_and_fails_the_study(checkout: Path) -> None:
    study = checkout / "failing.yaml"
    sweep = "sweep:\n  keys: {guard.largest_overlap_fraction: [0.001, 0.9]}\nreplicates: 1\n"
    study.write_text(TINY + sweep)
    ran = snakemake("--configfile", str(study), folder=checkout)
    assert ran.returncode != 0
    results = checkout / "results" / "failing"
    summary = pd.read_csv(results / "summary.tsv", sep="\t").set_index(
        "guard.largest_overlap_fraction"
    )
    assert summary.outcome[0.001] == Outcome.OVERLAP_TOO_LARGE.label
    assert summary.outcome[0.9] == "finished"
    assert "overlap" in (results / "report.html").read_text()
    assert not (results / "all_runs_finished").exists()
    failed = next(results.glob("runs/*_0p001_*"))
    assert (failed / "last_work").is_dir()  # what the failed run had is kept


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("scenario: {sand: {density_kg_m3: -5}}\n", "scenario.sand.density_kg_m3 = -5"),
        (
            "scenario: {time_step: {rotational_inertia: scaled}}\n",
            "scenario.time_step.rotational_inertia = 'scaled'",
        ),
        (
            "cross_check: {engine: reference, at: {sand.size_scale: 3}}\n"
            "equivalence: {margins: {solid_fraction: 0.005}}\n",
            "cross_check.at = {'sand.size_scale': 3}",
        ),
    ],
)
def test_bad_input_is_one_sentence_and_starts_nothing(
    text: str, sentence: str, checkout: Path
) -> None:
    study = checkout / "bad.yaml"
    study.write_text("based_on: tube\n" + text)
    ran = dry_run("--cores", "2", "--configfile", str(study), folder=checkout)
    assert ran.returncode != 0
    said = [line for line in ran.stderr.splitlines() if line and "profile" not in line]
    assert len(said) == 1, ran.stderr
    assert said[0].startswith(f"bad.yaml: {sentence} cannot be used: valid is ")
    assert not (checkout / "results" / "bad").exists()
