"""Run folders of an edited study: listed, sized, removed, and left where something uses them."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from sandmould.cli.commands import app
from sandmould.execution.tidy import freed_bytes, leftovers, orphans
from sandmould.study.plan.build_plan import RESULTS, Plan, open_plan
from tests.finished_study import study_text
from tests.planned import announce

BLOCK = 4096


def sandmould(*arguments: str, typed: str = "") -> Result:
    return CliRunner().invoke(app, arguments, input=typed)


@pytest.fixture
def edited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    """A study of three runs, of which its file lists one now; each run holds four blocks."""
    monkeypatch.chdir(tmp_path)
    path = Path("trial.yaml")
    path.write_text(study_text([0.01]))
    plan = open_plan(path)
    announce(plan, RESULTS, 1)
    for run in plan.runs:
        folder = RESULTS / "trial" / "runs" / run.run
        (folder / "snapshots").mkdir()
        (folder / "snapshots" / "000000.npz").write_bytes(b"x" * 4 * BLOCK)
        (RESULTS / "trial" / "logs").mkdir(exist_ok=True)
        (RESULTS / "trial" / "logs" / f"simulate_{run.run}.log").touch()
    path.write_text(study_text([0.01], ["faces"]))
    plan = open_plan(path)
    announce(plan, RESULTS, 1)
    return plan


def test_leftovers_are_listed_with_their_size_and_removed_when_wanted(edited: Plan) -> None:
    found = leftovers(edited, RESULTS)
    gone = [folder.name for folder in found.removable]
    assert len(gone) == 2
    assert not found.kept
    # Two snapshots, and for each run its scenario and two folders.
    assert 8 * BLOCK < found.freed_bytes < 20 * BLOCK
    status = sandmould("status", "trial.yaml").output
    assert "2 run folders of " in status
    assert all(f"\n  {name}" in status for name in gone)
    (RESULTS / "trial" / "runs" / "my_notes").mkdir()
    refused = sandmould("tidy", "trial.yaml", typed="n\n")
    assert "Remove 2 run folders and free " in refused.output
    assert len(orphans(edited, RESULTS)) == 2
    # Nobody to ask: nothing is removed.
    assert sandmould("tidy", "trial.yaml").exit_code == 1
    assert len(orphans(edited, RESULTS)) == 2
    assert sandmould("tidy", "trial.yaml", typed="y\n").exit_code == 0
    left = {path.name for path in (RESULTS / "trial" / "runs").iterdir()}
    assert left == {edited.runs[0].run, "my_notes"}
    logs = [path.name for path in (RESULTS / "trial" / "logs").iterdir()]
    assert logs == [f"simulate_{edited.runs[0].run}.log"]
    assert sandmould("tidy", "trial.yaml").output == "trial: no run folder to remove\n"


def test_yes_asks_nothing(edited: Plan) -> None:
    said = sandmould("tidy", "trial.yaml", "--yes")
    assert said.exit_code == 0
    assert "2 run folders removed, " in said.output
    assert not orphans(edited, RESULTS)


def test_what_something_uses_stays(edited: Plan) -> None:
    named, linked = orphans(edited, RESULTS)
    # Another study casts the pattern that a run left.
    other = RESULTS / "casting"
    other.mkdir()
    shape = f"../results/trial/runs/{named.name}/exports/pattern_final.stl"
    (other / "study.yaml").write_text(f"scenario: {{file: {shape}}}\n")
    mine = other / "runs" / "base_r1_abcdef"
    mine.mkdir(parents=True)
    (mine / "snapshots").symlink_to((linked / "snapshots").resolve())
    said = sandmould("tidy", "trial.yaml", "--yes")
    assert f"stays: {named.name}, since results/casting/study.yaml names it" in said.output
    assert f"stays: {linked.name}, since results/casting/runs/base_r1_abcdef/snap" in said.output
    assert "no run folder to remove" in said.output
    assert orphans(edited, RESULTS) == [named, linked]


def test_a_study_file_that_was_not_planned_yet_counts(edited: Plan) -> None:
    named, _ = orphans(edited, RESULTS)
    Path("next.yaml").write_text(f"scenario: {{file: results/trial/runs/{named.name}/a.stl}}\n")
    assert leftovers(edited, RESULTS).kept == {named: "next.yaml names it"}


def test_a_run_that_is_being_computed_stays(edited: Plan) -> None:
    running, free = orphans(edited, RESULTS)
    with (running / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = leftovers(edited, RESULTS)
    assert found.kept == {running: "it is being computed"}
    assert found.removable == (free,)


def test_files_with_another_name_elsewhere_free_nothing(edited: Plan) -> None:
    first, second = orphans(edited, RESULTS)
    before = freed_bytes([first])
    os.link(first / "snapshots" / "000000.npz", Path("kept.npz"))
    assert freed_bytes([first]) == before - 4 * BLOCK
    # A link goes; what it leads to is the user's.
    elsewhere = Path("elsewhere")
    second.rename(elsewhere)
    second.symlink_to(elsewhere.resolve())
    sandmould("tidy", "trial.yaml", "--yes")
    assert (elsewhere / "snapshots" / "000000.npz").is_file()
    assert not second.exists()
