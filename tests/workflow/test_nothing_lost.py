"""What is lost is computed again, by the command and by plain Snakemake; and nothing else."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from sandmould import ROOT
from sandmould.cli.commands import app
from sandmould.runs.manifest import MANIFEST_FILE
from sandmould.study.plan.build_plan import RESULTS, Plan, open_plan
from sandmould.study.plan.lacking import Need
from tests.finished_study import finished_study, study_text
from tests.workflow.dry_runs import dry_run

SNAKEMAKE = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")]
ALONE = ("--config", "batch_wall_s=0")
"""Three jobs a run, as long runs have them."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute six runs once, two of which fail."""
    folder = tmp_path_factory.mktemp("finished")
    before = Path.cwd()
    os.chdir(folder)
    finished_study(Path("whole.yaml"))
    (folder / "failing.yaml").write_text(study_text([0.025], ["faces", "difference"]))
    finished_study(Path("failing.yaml"), failed=1)
    os.chdir(before)
    return folder


@pytest.fixture
def here(finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the studies with all their times."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def snakemake(study: str, *arguments: str, target: str = "summary.tsv") -> str:
    """Run the workflow up to a file; what it said."""
    command = [*SNAKEMAKE, "--configfile", f"{study}.yaml", "--cores", "2", *arguments]
    ran = subprocess.run(
        [*command, "--", str(RESULTS / study / target)], capture_output=True, text=True, timeout=300
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout + ran.stderr


def told_by_dry_run(study: str) -> tuple[set[str], set[str]]:
    """Runs that plain Snakemake would compute, and those that it would measure."""
    place = ("--configfile", f"{study}.yaml", "--cores", "2")
    target = str(RESULTS / study / "summary.tsv")
    ran = dry_run(*place, *ALONE, "--", target, folder=Path.cwd())
    assert ran.returncode == 0, ran.stdout + ran.stderr
    said = ran.stdout + ran.stderr
    computed = re.findall(r"^Job \d+: Compute (\w+)$", said, re.M)
    return set(computed), set(re.findall(r"^Job \d+: Measure (\w+)$", said, re.M))


def folder_of(plan: Plan, place: int) -> Path:
    return RESULTS / plan.study.name / "runs" / plan.runs[place].run


def written(plan: Plan, name: str) -> dict[str, int]:
    folders = [folder_of(plan, place) for place in range(len(plan.runs))]
    return {f.name: f.joinpath(name).stat().st_mtime_ns for f in folders if (f / name).exists()}


def half(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def test_what_is_lost_is_computed_again_and_nothing_else(here: Path) -> None:
    plan = open_plan(Path("whole.yaml"))
    names = [run.run for run in plan.runs]
    runs = RESULTS / "whole" / "runs"
    kept = {name: (runs / name / "measures.tsv").read_text() for name in names}
    shutil.rmtree(folder_of(plan, 0))
    half(folder_of(plan, 1) / "outcome.json")
    (folder_of(plan, 2) / "fields.npz").unlink()
    (folder_of(plan, 3) / "series.tsv").write_bytes(b"")
    half(folder_of(plan, 4) / "measures.tsv")
    lacks = plan.lacks(RESULTS)
    assert [lacks[name].need for name in names[:5]] == [Need.COMPUTE] * 4 + [Need.MEASURE]
    # One answer three times: what a start would do, what status says, what a start does.
    assert told_by_dry_run("whole") == (set(names[:4]), set(names[:5]))
    said = CliRunner().invoke(app, ["status", "whole.yaml"]).output
    assert said.startswith("whole: 1 done, 5 waiting of 6 runs\n")
    before = written(plan, "outcome.json"), written(plan, "measures.tsv")
    # The objective is another one meanwhile.
    Path("whole.yaml").write_text(study_text() + "objective: {measure: hot_spots}\n")
    said = snakemake("whole")
    assert f"computed again: {names[1]} (outcome.json cannot be read)" in said
    after = written(plan, "outcome.json"), written(plan, "measures.tsv")
    assert {n for n in names if before[0].get(n) != after[0][n]} == set(names[:4])
    assert {n for n in names if before[1].get(n) != after[1][n]} == set(names[:5])
    assert plan.lacks(RESULTS) == {}
    assert {name: (runs / name / "measures.tsv").read_text() for name in names} == kept
    assert set(pd.read_csv(RESULTS / "whole" / "summary.tsv", sep="\t").outcome) == {"finished"}
    # The same where each run has jobs of its own.
    half(folder_of(plan, 5) / MANIFEST_FILE)
    (folder_of(plan, 4) / "measures.tsv").unlink()
    snakemake("whole", *ALONE)
    assert {n for n in names if after[0][n] != written(plan, "outcome.json")[n]} == {names[5]}
    assert plan.lacks(RESULTS) == {}
    assert told_by_dry_run("whole") == (set(), set())


def test_a_failed_run_is_told_once_and_computed_when_asked_for(here: Path) -> None:
    plan = open_plan(Path("failing.yaml"))
    failed = plan.runs[1].run
    command = [*SNAKEMAKE, "--configfile", "failing.yaml", "--cores", "2"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 1
    said = ran.stdout + ran.stderr
    assert said.count(f"{failed}: engine failed. as this test wants it") == 1
    assert "Trying to restart" not in said
    assert "A failed run is computed once more by: sandmould again RUN" in said
    report = RESULTS / "failing" / "report.html"
    assert "as this test wants it" in report.read_text()

    again = [sys.executable, "-m", "sandmould.cli", "again", failed, "--cores", "2"]
    ran = subprocess.run(again, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stderr
    assert set(pd.read_csv(RESULTS / "failing" / "summary.tsv", sep="\t").outcome) == {"finished"}
    said = CliRunner().invoke(app, ["status", "failing.yaml"]).output
    assert said.startswith("failing: 2 done of 2 runs\n")


def test_another_study_of_the_name_is_refused_by_plain_snakemake(here: Path) -> None:
    (here / "other").mkdir()
    shutil.copy("whole.yaml", here / "other" / "whole.yaml")
    before = {p: p.stat().st_mtime_ns for p in RESULTS.rglob("*")}
    command = [*SNAKEMAKE, "--configfile", "other/whole.yaml", "--cores", "2"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert ran.returncode != 0
    assert "since results/whole belongs to whole.yaml; " in ran.stderr
    assert len([line for line in ran.stderr.splitlines() if line and "profile" not in line]) == 1
    assert before == {p: p.stat().st_mtime_ns for p in RESULTS.rglob("*")}


@pytest.mark.parametrize("plain", [False, True], ids=["sandmould run", "snakemake"])
def test_ctrl_c_leaves_no_traceback_and_no_run_that_goes_on(plain: bool, here: Path) -> None:
    coarse = study_text([0.002], ["faces"])
    (here / "long.yaml").write_text(coarse.replace("until_s: 100", "until_s: 20000"))
    command = [sys.executable, "-m", "sandmould.cli", "run", "long.yaml", "--cores", "1"]
    if plain:
        command = [*SNAKEMAKE, "--configfile", "long.yaml", "--cores", "1"]
    with (here / "said").open("w+") as said:
        process = subprocess.Popen(command, stdout=said, stderr=said, process_group=0)
        deadline = time.monotonic() + 120
        while not list(RESULTS.glob("long/runs/*/work/progress.json")):
            assert time.monotonic() < deadline
            assert process.poll() is None, (here / "said").read_text()
            time.sleep(0.05)
        running = CliRunner().invoke(app, ["status", "long.yaml"]).output
        os.killpg(process.pid, signal.SIGINT)
        status = process.wait(timeout=60)
    assert running.startswith("long: 1 running of 1 runs")
    text = (here / "said").read_text()
    assert "Traceback" not in text
    assert status == (1 if plain else 130)
    sentences = [line for line in text.splitlines() if "the same command goes on with" in line]
    assert len(sentences) == 1
    # Its progress is of this moment, its lock is free.
    said_now = CliRunner().invoke(app, ["status", "long.yaml"]).output
    assert said_now.startswith("long: 1 stopped of 1 runs")
