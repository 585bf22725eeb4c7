"""What is seen of a study while it is computed: the table, the lines, the last words."""

from __future__ import annotations

import dataclasses
import io
import json
import os
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

from sandmould.definition.run import LAST_MEASURED
from sandmould.execution.run_study import stated_cores
from sandmould.execution.screen.ending import last_line, trouble
from sandmould.execution.screen.run_watch import Ended, Running, RunWatch
from sandmould.execution.screen.screen import Screen
from sandmould.execution.screen.so_far import so_far_text
from sandmould.execution.screen.table import StudyView, counts_text, study_table
from sandmould.kinds.sand.speed import SandSpeed
from sandmould.runs import parent
from sandmould.runs.manifest import save_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.build_plan import Plan, open_plan
from tests.planned import announce

FREQUENCY = "vibration.0.frequency_hz"
FILL = "tube_fill_fraction"
RESULTS = Path("results")
STUDY = RESULTS / "trial"
VIEW = StudyView(
    name="tube_demo",
    runs=42,
    done=12,
    running=(
        (Running("frequency_15_r6_b6a831", "vibrate_1", 40.0, 1.25, 2e7), 31.0),
        (Running("frequency_25_r1_01aa21"), 200.0),
    ),
    waiting=27,
    filling=0,
    passed_s=130.0,
    left_s=390.0,
    share=0.25,
    so_far="not resolved yet, highest fill of the tube at 15 Hz 0.771 (6 runs)",
    ended=tuple(Ended(f"frequency_15_r{n}_a5bbbb", "") for n in range(1, 6)),
    failures=(Ended("frequency_50_r1_77c0de", "overlap too large. 0.52 of a radius"),),
)


def drawn(view: StudyView, width: int, height: int = 24) -> list[str]:
    """Lines of the table, as a terminal of that size without colours shows them."""
    console = Console(
        file=io.StringIO(), width=width, height=height, force_terminal=True, no_color=True,
        color_system=None, markup=False, highlight=False,
    )  # fmt: skip
    with console.capture() as capture:
        console.print(study_table(view, width, height))
    return [line.rstrip() for line in capture.get().splitlines()]


def test_the_table_at_80_columns() -> None:
    assert drawn(VIEW, 80) == [
        "tube_demo  12 of 42 runs done, 1 failed, 2 running, 27 waiting",
        "[#########............................]  25 % 2.2 min passed, about 6.5 min left",
        "So far: not resolved yet, highest fill of the tube at 15 Hz 0.771 (6 runs)",
        "frequency_15_r6_b6a831 [####......]  40 % vibrate_1 31 s left",
        "frequency_25_r1_01aa21 [..........]   0 % begins    3.3 min left",
        *(f"finished  frequency_15_r{n}_a5bbbb" for n in range(1, 6)),
        "failed    frequency_50_r1_77c0de: overlap too large. 0.52 of a radius",
    ]


def test_the_table_at_120_columns_has_speed_and_simulated_time() -> None:
    lines = drawn(VIEW, 120)
    assert lines[3] == (
        "frequency_15_r6_b6a831 [########............]  40 % vibrate_1 1.250 s 20.00 M/s 31 s left"
    )
    assert max(map(len, lines)) <= 120


@pytest.mark.parametrize("width", [20, 40, 80, 120])
@pytest.mark.parametrize("height", [10, 24, 60])
def test_a_thousand_runs_do_not_flood_the_screen(width: int, height: int) -> None:
    many = dataclasses.replace(
        VIEW,
        runs=3000,
        running=VIEW.running * 250,
        ended=VIEW.ended * 200,
        failures=tuple(Ended(f"run_{n}", "lost grains. " + 20 * "many words ") for n in range(99)),
    )
    lines = drawn(many, width, height)
    if width >= 80:
        assert len(lines) < height
    assert max(map(len, lines)) <= width
    assert lines[0].startswith("tube_demo")
    assert any(line.startswith("and ") and line.endswith(" more running") for line in lines)
    assert any(line.startswith("failed    run_98") for line in lines)


def test_what_is_done_after_the_last_run() -> None:
    last = dataclasses.replace(VIEW, running=(), waiting=0, left_s=0.4)
    assert drawn(last, 80)[1].endswith("2.2 min passed, soon done, tables and report")


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    """Two points of two runs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SANDMOULD_WORDS", raising=False)
    Path("trial.yaml").write_text(
        "based_on: tube\nscenario: {engine: {name: reference}}\n"
        f"sweep: {{keys: {{{FREQUENCY}: [25, 50]}}}}\nreplicates: 2\n"
    )
    plan = open_plan(Path("trial.yaml"))
    announce(plan, RESULTS, 2)
    return plan


def end(run: str, fill: float, outcome: Outcome = Outcome.FINISHED, wall_s: float = 60.0) -> None:
    """Let a run end with what is read of it."""
    folder = STUDY / "runs" / run
    RunOutcome(outcome, "0.52 of a radius", 1.0, 1.0).write(folder / "outcome.json")
    (folder / "measures.tsv").write_text(
        f"time_s\tvibration_time_s\tstage\t{FILL}\n1.0\t1.0\tvibrate_1\t{fill}\n"
    )
    save_manifest(folder, {"cost": {"wall_s": wall_s, "cpu_s": wall_s}})


def test_plain_lines_tell_each_run_once(plan: Plan, capsys: pytest.CaptureFixture[str]) -> None:
    names = [run.run for run in plan.runs]
    with Screen(plan, RESULTS, 2, live=False) as screen:
        screen.look()
        end(names[0], 0.5)
        screen.look()
        end(names[1], 0.6, Outcome.OVERLAP_TOO_LARGE)
        screen.look()
        screen.look()
    screen.tell_failures()
    assert capsys.readouterr().err.splitlines() == [
        f"[1/4] {names[0]} done, fill of the tube 0.500",
        f"[2/4] {names[1]} failed: overlap too large. 0.52 of a radius",
        "trial: 1 of 4 runs done, 1 failed, 2 waiting after 0 s",
        "A failed run is computed once more by: sandmould again RUN",
    ]


def test_plain_lines_tell_the_whole_study_now_and_then(
    plan: Plan, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandmould.execution.screen.screen.LINE_EVERY_S", 0.0)
    names = [run.run for run in plan.runs]
    screen = Screen(plan, RESULTS, 2, live=False)
    end(names[0], 0.5)
    screen.look()
    _, line = capsys.readouterr().err.splitlines()
    assert line.startswith("trial: 1 of 4 runs done, 3 waiting; 0 s passed, about ")
    assert line.endswith(
        " left; so far: fill of the tube 0.500 (1 run); nothing to compare with yet"
    )


@pytest.mark.usefixtures("unmeasured")
def test_the_time_left_knows_a_speed_that_is_measured_after_the_first_line(
    plan: Plan, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sandmould.execution.screen.screen.LINE_EVERY_S", 0.0)
    screen = Screen(plan, RESULTS, 2, live=False)
    screen.look()
    monkeypatch.setattr(SandSpeed, "trial", lambda *_: 1.0)  # a very slow machine
    SandSpeed().measured(plan.runs[0].scenario, RESULTS)
    screen.look()
    guessed, measured = capsys.readouterr().err.splitlines()
    assert guessed.endswith((" s left", " min left"))
    assert measured.endswith(" days left")
    (STUDY / "runs" / plan.runs[0].run / "lock").write_text("")
    screen.look()
    SandSpeed().file(
        plan.runs[0].scenario
    ).unlink()  # nothing is looked up again once a run has begun
    screen.look()
    assert all(line.endswith(" days left") for line in capsys.readouterr().err.splitlines())


def test_failures_of_an_earlier_start_are_told_at_the_end(
    plan: Plan, capsys: pytest.CaptureFixture[str]
) -> None:
    with Screen(plan, RESULTS, 2, live=False) as screen:
        screen.failures.append(Ended("run_of_before", "lost grains. one"))
    screen.tell_failures()
    assert "run_of_before failed: lost grains. one" in capsys.readouterr().err


def test_words_of_processes_come_through_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("SANDMOULD_WORDS", raising=False)
    parent.say("to the terminal")
    assert capsys.readouterr().err == "to the terminal\n"
    heard = parent.Words(tmp_path / "words.txt")
    monkeypatch.setattr(os, "environ", heard.environment())
    parent.say("the plan")
    with (tmp_path / "words.txt").open("a") as half:
        half.write("half a ")
    assert heard.new() == "the plan\n"
    parent.say("line")
    assert heard.new() == "half a line\n"
    assert capsys.readouterr().err == ""


def test_a_watch_sees_runs_begin_go_on_and_end(plan: Plan) -> None:
    names = [run.run for run in plan.runs]
    runs = STUDY / "runs"
    since_s = (STUDY / "runs.tsv").stat().st_mtime
    # A run measured again has its last product from before.
    (runs / names[3] / LAST_MEASURED).write_text("")
    os.utime(runs / names[3] / LAST_MEASURED, (since_s - 9, since_s - 9))
    watch = RunWatch({name: runs / name for name in names}, list(names), since_s)
    old = runs / names[2] / "work" / "progress.json"
    old.parent.mkdir()
    old.write_text("{}")
    os.utime(old, (since_s - 9, since_s - 9))
    (runs / names[0] / "lock").write_text("")
    work = runs / names[1] / "work"
    work.mkdir()
    (work / "progress.json").write_text(
        json.dumps({"stage": "settle_1", "percent": 40.0, "time_s": 0.5, "work_per_s": 1e7})
    )
    assert watch.look() == []
    assert {run: at.percent for run, at in watch.running.items()} == {names[0]: 0.0, names[1]: 40.0}
    end(names[1], 0.5)
    end(names[3], 0.5)
    assert [ended.run for ended in watch.look()] == [names[1], names[3]]
    assert watch.waiting == [names[0], names[2]]


SUMMARY = pd.DataFrame(
    {
        "run": list("abcdef"),
        FREQUENCY: [25, 25, 25, 50, 50, 50],
        "replicate": [1, 2, 3] * 2,
        "seed": [7, 8, 9] * 2,
        "outcome_code": 0,
        FILL: [0.70, 0.71, 0.72, 0.50, 0.52, 0.51],
    }
)


def test_the_verdict_so_far(plan: Plan) -> None:
    study = plan.study.study
    assert so_far_text(SUMMARY[:0], study, 2) == ""
    assert so_far_text(SUMMARY[:2], study, 2) == (
        "fill of the tube 0.705 (2 runs); nothing to compare with yet"
    )
    best = "highest fill of the tube at 25 Hz 0.710 (3 runs), then 50 Hz 0.510 (3 runs)"
    assert so_far_text(SUMMARY, study, 2) == f"resolved, {best}"
    # A third point has no run yet.
    assert so_far_text(SUMMARY, study, 3) == f"not resolved yet, {best}"
    asked = {"measure": "pattern_tip_deflection_m", "better": "neither"}
    bent = study.model_copy(update={"objective": study.objective.model_copy(update=asked)})
    in_m = SUMMARY.assign(pattern_tip_deflection_m=[1e-3, 1e-3, 1e-3, 2e-3, 2e-3, 2e-3])
    said = so_far_text(in_m, bent, 2)
    assert said == "deflection of the pattern's tip 1.0 to 2.0 mm by 6 runs"
    failed = SUMMARY.assign(outcome_code=[0, 0, 0, 310, 310, 310])
    assert "nothing to compare with" in so_far_text(failed, study, 2)


def test_the_last_line_is_the_verdict_and_the_report(tmp_path: Path) -> None:
    assert last_line(tmp_path) == ""
    page = tmp_path / "report.html"
    page.write_text("")
    assert last_line(tmp_path) == f"The report: {page}"
    (tmp_path / "verdict.txt").write_text("15 Hz is best.\n")
    assert last_line(tmp_path) == f"15 Hz is best. The report: {page}"


def test_a_job_that_did_not_end_says_why_and_names_its_log(tmp_path: Path) -> None:
    log = tmp_path / "snakemake.log"
    tried = """\
RuleException:
JobError in file "/here/workflow/rules/run.smk", line 82:
was killed: the same command continues it
  File "/here/workflow/rules/run.smk", line 82, in __rule_simulate
[Sat Nov 28 16:33:13 2026]
Error in rule simulate:
    jobid: 2
    log: results/chute/logs/simulate_r1.log (check log file(s) for error details)
"""
    log.write_text(tried + "Trying to restart job 2.\n" + tried)
    assert trouble(tmp_path, log) == (
        "The study stopped:\nsimulate_r1: was killed: the same command continues "
        "it. Its log: results/chute/logs/simulate_r1.log"
    )


def test_trouble_is_told_once(tmp_path: Path) -> None:
    log = tmp_path / "snakemake.log"
    assert trouble(tmp_path, log) == ""
    told = 'The study stopped outside its runs. Snakemake told "{}". All that it said: ' + str(log)
    log.write_text(
        "host: here\nMissingInputException in rule x:\n\nMissingInputException in rule x:\n"
    )
    assert trouble(tmp_path, log) == told.format("MissingInputException in rule x:")
    log.write_text("host: here\nWorkflowError:\nAt least one job did not complete.\n")
    said = "WorkflowError: At least one job did not complete."
    assert trouble(tmp_path, log) == told.format(said)
    log.write_text("one\ntwo\n")
    assert trouble(tmp_path, log) == told.format("one; two")


@pytest.mark.parametrize(
    ("line", "refused"),
    [
        ("OSError: [Errno 28] No space left on device", "{} could not be written: No space left"),
        ("OSError: [Errno 13] Permission denied: '/a/b'", "/a/b could not be written: Permission"),
        ("runs/r1/deck.in: Permission denied", "runs/r1/deck.in could not be written: Permission"),
        ("r1: disk refused. No space left on device: None", "{} could not be written: No space"),
    ],
)
def test_a_file_that_was_refused_is_named_without_snakemakes_words(
    line: str, refused: str, tmp_path: Path
) -> None:
    log = tmp_path / "snakemake.log"
    log.write_text(f"Error in rule x:\n{line}\nRuleException:\n")
    said = trouble(tmp_path, log)
    assert said.startswith(f"The study stopped, since {refused.format(tmp_path)}")
    assert said.endswith("once that is mended, the same command goes on.")
    assert "Rule" not in said


@pytest.mark.parametrize(
    ("options", "cores"),
    [
        ([], None), (["--cores", "3"], 3), (["-c4"], 4), (["--jobs=5"], 5), (["-j", "6"], 6),
        (["--cores", "all"], os.cpu_count()), (["--config", "x"], None),
    ],
)  # fmt: skip
def test_cores_are_read_from_the_options(options: list[str], cores: int | None) -> None:
    assert stated_cores(options) == cores


def test_fills_that_are_running_are_no_runs() -> None:
    view = dataclasses.replace(VIEW, runs=16, done=0, failures=(), waiting=16, filling=2)
    assert counts_text(view) == "0 of 16 runs done, 16 waiting, 2 shared fills running"
    view = dataclasses.replace(view, waiting=15, filling=1)
    assert counts_text(view) == "0 of 16 runs done, 1 running, 15 waiting, 1 shared fill running"
