"""Runs that are asked for again: forgotten, and only where that is right."""

from __future__ import annotations

import fcntl
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from sandmould.cli.commands import app
from sandmould.runs.manifest import MANIFEST_FILE
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.build_plan import RESULTS, Plan, open_plan
from sandmould.study.plan.ownership import OWNER_FILE
from tests.finished_study import study_text
from tests.planned import announce

CALLS: list[tuple[Path, list[str]]] = []


def sandmould(*arguments: str) -> Result:
    return CliRunner().invoke(app, arguments)


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    """A study of three runs that failed."""
    monkeypatch.chdir(tmp_path)
    CALLS.clear()

    def run_study(path: Path, options: list[str]) -> int:
        CALLS.append((path, options))
        return 0

    monkeypatch.setattr("sandmould.execution.run_study.run_study", run_study)
    return planned("trial")


def planned(name: str) -> Plan:
    path = Path(f"{name}.yaml")
    path.write_text(study_text([0.01]))
    plan = open_plan(path)
    announce(plan, RESULTS, 1)
    for folder in folders(plan):
        RunOutcome(Outcome.ENGINE_FAILED, "", 0.0, 1.0).write(folder / "outcome.json")
        (folder / MANIFEST_FILE).write_text("{}")
    return plan


def folders(plan: Plan) -> list[Path]:
    return [RESULTS / plan.study.name / "runs" / run.run for run in plan.runs]


def outcomes(plan: Plan) -> list[bool]:
    return [(folder / "outcome.json").exists() for folder in folders(plan)]


def test_runs_are_forgotten_and_their_study_is_run(plan: Plan) -> None:
    first, second = plan.runs[0].run, folders(plan)[2]
    said = sandmould("again", first, f"{second}/", "--cores", "2")
    assert said.exit_code == 0, said.output
    assert outcomes(plan) == [False, True, False]
    assert [(Path("trial.yaml"), ["--cores", "2"])] == CALLS
    assert not (folders(plan)[0] / MANIFEST_FILE).exists()


def test_later_leaves_computing_to_the_next_run(plan: Plan) -> None:
    said = sandmould("again", "--later", plan.runs[1].run)
    assert said.output == "sandmould run trial.yaml computes them again.\n"
    assert outcomes(plan) == [True, False, True]
    assert not CALLS


@pytest.mark.parametrize("name", ["element_m_0p01_exchange_faces_layers_r1_000000", "..", "runs"])
def test_an_unknown_run_is_one_sentence_and_nothing_is_forgotten(name: str, plan: Plan) -> None:
    said = sandmould("again", plan.runs[0].run, name)
    assert said.exit_code == 1
    (sentence,) = said.stderr.splitlines()
    assert sentence.startswith(f"RUN = '{name}' cannot be used: valid is a run of results, such as")
    if "faces" in name:
        assert f"such as {plan.runs[1].run}" in sentence
    assert outcomes(plan) == [True] * 3
    assert not CALLS


def test_a_run_of_several_studies_needs_its_study(plan: Plan) -> None:
    other = planned("other")
    name = plan.runs[0].run
    said = sandmould("again", name)
    assert said.stderr == (
        f"RUN = '{name}' cannot be used: valid is other/{name} or trial/{name}: several studies "
        "have a run of this name.\n"
    )
    assert sandmould("again", f"other/{name}").exit_code == 0
    assert (outcomes(plan)[0], outcomes(other)[0]) == (True, False)


def test_a_run_that_the_study_no_longer_has_is_refused(plan: Plan) -> None:
    Path("trial.yaml").write_text(study_text([0.01], ["faces"]))
    said = sandmould("again", plan.runs[0].run)
    assert said.exit_code == 1
    assert "valid is a run that trial.yaml still leads to: " in said.stderr
    Path("trial.yaml").unlink()
    (RESULTS / "trial" / OWNER_FILE).unlink()
    said = sandmould("again", plan.runs[0].run)
    assert "valid is one whose study file is there: that of results/trial is not." in said.stderr
    assert outcomes(plan) == [True] * 3


def test_a_run_that_is_being_computed_is_refused(plan: Plan) -> None:
    with (folders(plan)[0] / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        said = sandmould("again", plan.runs[0].run)
    assert said.stderr.endswith("valid is a run that is not being computed.\n")
    assert outcomes(plan) == [True] * 3


def test_without_any_results_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said = sandmould("again", "anything")
    assert said.stderr.endswith("valid is a run of results, which has none.\n")
