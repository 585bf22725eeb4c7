"""Runs that take their time step from the filled bed: shared, alone, killed, told."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from sandmould.engines.bed_step import MOST_AGAIN
from sandmould.engines.driver import Driver
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.session import Session
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import read_costs
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.fills import own_work
from sandmould.study.plan.plan_files import plan_table
from sandmould.study.plan.price import Prices
from tests.scenes import TUBE_SCENE, tube_scene
from tests.workflow.runs import SOON, drive, run_folder
from tests.workflow.test_shared_fill import assert_same, compute, pair

OF_BED: dict[str, Any] = {
    "engine": {"name": "reference"}, "rest": SOON, "time_step": {"bed_fraction": 0.7},
}  # fmt: skip


class Killed(BaseException):
    """Stands for SIGKILL: nothing of the house catches it."""


def cost_of(folder: Path) -> Any:
    return read_costs([folder]).rows.iloc[-1]


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run that fills by itself."""
    folder = run_folder(tube_scene(**OF_BED), tmp_path_factory.mktemp("straight"))
    assert compute(folder) is Outcome.FINISHED
    return folder


def test_a_branch_is_bit_for_bit_the_run_alone_from_its_deck(
    straight: Path, tmp_path: Path
) -> None:
    (shorter, longer), fill = pair(tube_scene(**OF_BED), tmp_path)
    assert [compute(folder) for folder in (fill, shorter, longer)] == [Outcome.FINISHED] * 3
    assert_same(shorter, straight)
    costs = {f: cost_of(f) for f in (straight, fill, shorter, longer)}
    step_s = float(costs[straight].time_step_s)
    assert step_s == costs[shorter].time_step_s == costs[longer].time_step_s
    # rounded down to four digits
    assert 0.999 * 0.7 < step_s / costs[fill].bed_limit_s <= 0.7
    # the fill has the planned step, and with it the bed that gives the other one
    assert costs[fill].time_step_s == tube_scene(**OF_BED).planned_step_s
    assert costs[fill].grain_steps + costs[shorter].grain_steps == costs[straight].grain_steps
    deck = (shorter / "deck.in").read_text()
    assert f"variable bed_time_step index {step_s!r}  # s, time step after the fill, 0.7" in deck
    # what a person can take away runs alone: there is no fill beside it
    alone = tmp_path / "elsewhere" / "runs" / shorter.name
    alone.mkdir(parents=True)
    shutil.copy(shorter / "scenario.yaml", alone)
    assert compute(alone) is Outcome.FINISHED
    assert (alone / "deck.in").read_text() == deck
    assert_same(alone, straight)


def test_time_goes_on_where_the_step_changes(straight: Path) -> None:
    series = pd.read_csv(straight / "series.tsv", sep="\t")
    shaken = series[series["stage"] == "vibrate_1"]
    filled_s = series.loc[series["vibration_time_s"].isna(), "time_s"].iloc[-1]
    began_s = shaken["time_s"] - shaken["vibration_time_s"]
    # both are written with nine digits
    assert began_s.to_numpy() == pytest.approx(filled_s, abs=2e-9)
    assert shaken["vibration_time_s"].iloc[-1] == pytest.approx(0.06, abs=1e-4)
    ended = RunOutcome.read(straight / "outcome.json")
    assert ended.simulated_s == pytest.approx(series["time_s"].iloc[-1], abs=1e-8)


def test_looking_at_the_limit_changes_nothing(
    straight: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert cost_of(straight).limit_moments == 20
    monkeypatch.setattr("sandmould.engines.driver.limit_moments", lambda program: [])
    folder = run_folder(tube_scene(**OF_BED), tmp_path)
    assert compute(folder) is Outcome.FINISHED
    assert_same(folder, straight)
    assert "least_limit_s" not in read_costs([folder]).rows


@pytest.mark.parametrize("stage", ["settle_2", "vibrate_1", "rest"])
def test_a_killed_run_goes_on_with_the_same_step(
    stage: str, straight: Path, tmp_path: Path
) -> None:
    """Killed at the third checkpoint of a stage, after it is sealed."""
    left = [3]

    class Dying(Driver):
        def _write_checkpoint(self, session: Session, folder: Path) -> None:
            super()._write_checkpoint(session, folder)
            left[0] -= session.stage.name == stage
            if left[0] == 0:
                raise Killed

    # records are made more often than checkpoints: what is recorded changes nothing
    often = {"series_every_s": 0.005, "checkpoint_every_s": 0.005}
    scene = tube_scene(**OF_BED, record=often)
    whole = run_folder(scene, tmp_path / "whole")
    assert compute(whole) is Outcome.FINISHED
    folder = tmp_path / "killed"
    with pytest.raises(Killed):
        drive(scene, folder, Dying)
    marks = [json.loads(p.read_text())["mark"] for p in folder.glob("work/checkpoint_*/mark.json")]
    newest = max(marks, key=lambda mark: mark["steps"])
    assert newest["stage"] == stage
    assert drive(scene, folder).outcome is Outcome.FINISHED
    assert_same(folder, whole)
    for name in ("time_step_s", "bed_limit_s", "least_limit_s", "limit_moments", "steps"):
        assert cost_of(folder)[name] == cost_of(whole)[name], name
    assert cost_of(whole).time_step_s == cost_of(straight).time_step_s


@pytest.mark.parametrize("shared", [False, True])
def test_a_run_whose_bed_becomes_too_stiff_begins_again_from_its_fill(
    shared: bool, straight: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = ReferenceSession.exact_limit_s

    def shrinks(session: ReferenceSession) -> float:
        stiff = session.step_s > 2.5e-5 and session.stage.counts_as_vibration
        return found(session) * (0.6 if stiff else 1.0)

    monkeypatch.setattr(ReferenceSession, "exact_limit_s", shrinks)
    if shared:
        (folder, _), fill = pair(tube_scene(**OF_BED), tmp_path)
        assert compute(fill) is Outcome.FINISHED
    else:
        folder = run_folder(tube_scene(**OF_BED), tmp_path)
    assert compute(folder) is Outcome.FINISHED
    detail, cost = RunOutcome.read(folder / "outcome.json").detail, cost_of(folder)
    assert detail.startswith("the run began again from its fill once, since the exact limit of the")
    assert cost.begun_again == 1
    assert cost.least_limit_s > cost.time_step_s
    assert 0.999 * 0.7 < cost.time_step_s / cost.bed_limit_s <= 0.7
    assert cost.bed_limit_s < cost_of(straight).time_step_s
    # as if that limit had been found at once
    other = run_folder(tube_scene(**OF_BED), tmp_path / "other")
    monkeypatch.setattr(ReferenceSession, "exact_limit_s", lambda *_: float(cost.bed_limit_s))
    assert compute(other) is Outcome.FINISHED
    assert_same(folder, other)


def test_a_bed_that_is_too_stiff_again_and_again_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def limit_s(session: ReferenceSession) -> float:
        return 0.99 * session.step_s if session.stage.counts_as_vibration else 4e-5

    monkeypatch.setattr(ReferenceSession, "exact_limit_s", limit_s)
    folder = run_folder(tube_scene(**OF_BED), tmp_path)
    assert compute(folder) is Outcome.FINISHED
    detail, cost = RunOutcome.read(folder / "outcome.json").detail, cost_of(folder)
    assert cost.begun_again == MOST_AGAIN
    assert cost.least_limit_s < cost.time_step_s
    assert "; the time step 9.3" in detail
    assert detail.endswith("take a smaller time_step.bed_fraction")


def test_a_step_of_the_users_own_above_the_limit_ends_the_run_after_its_fill(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ReferenceSession, "exact_limit_s", lambda *_: 3.9e-5)
    own = {**OF_BED, "time_step": {"step_s": 4e-5}}
    folder = run_folder(tube_scene(**own), tmp_path)
    assert compute(folder) is Outcome.BAD_INPUT
    assert RunOutcome.read(folder / "outcome.json").detail == (
        "time_step.step_s = 4e-05 cannot be used: valid is at most the exact limit of the filled "
        "bed, 3.9e-05 s"
    )


def test_the_plan_counts_a_guess_of_the_step_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    tree = {"scenario": {**TUBE_SCENE, **OF_BED},
            "sweep": {"keys": {"vibration.0.frequency_hz": [50, 100]}}}  # fmt: skip
    Path("small.yaml").write_text(yaml.safe_dump(tree))
    plan = open_plan(Path("small.yaml"))
    assert len(plan.fills) == 1
    said = plan_table([*plan.fills, *plan.runs], Prices(), 1)
    assert "  2.35e-05 s, then about 2.8e-05 s  " in said
    step_s, guess_s = plan.runs[0].scenario.step_s, 0.7 * 1.2 * 3.351e-5
    without = {**tree, "scenario": {**tree["scenario"], "time_step": {"bed_fraction": 0.0}}}
    Path("plain.yaml").write_text(yaml.safe_dump(without))
    plain = open_plan(Path("plain.yaml"))
    work = [own_work(each.runs[0]) for each in (plan, plain)]
    assert work[0] / work[1] == pytest.approx(step_s / guess_s, rel=1e-3)
    assert ", then about" not in plan_table([*plain.fills, *plain.runs], Prices(), 1)
