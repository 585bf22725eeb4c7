"""Runs whose shaken part is checked more often than their fill: shared, alone, killed, told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould.definition.run import Run
from sandmould.engines.program import StepCounts
from sandmould.engines.registry import engine_problem
from sandmould.kinds.sand.kind import SAND
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.outcome import Outcome
from sandmould.runs.run_tables import read_costs
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.fills import share_fills
from sandmould.study.robustness.controls import SHAKEN_HZ, _shaken
from tests.planned import write_plan
from tests.scenes import tube_scene
from tests.workflow.runs import SOON, kill_after_a_checkpoint, last_snapshot, run_folder
from tests.workflow.test_shared_fill import REFERENCE, assert_same, compute

SHAKEN_S = 0.0009
OFTEN: dict[str, Any] = {**REFERENCE, "rest": {**SOON, "shaken_check_every_s": SHAKEN_S}}


def beside_the_sweep(scene: Scenario, folder: Path) -> tuple[Path, Path, Path]:
    """Plan a scene with its own checks, and with others once it vibrates; and their fill."""
    plain = scene.model_copy(
        update={"rest": scene.rest.model_copy(update={"shaken_check_every_s": None})}
    )
    runs = [Run("test", f"run_{i}", {"of": i}, 1, s, {}) for i, s in enumerate((plain, scene))]
    shared, (fill,) = share_fills(runs, SAND.planning)
    write_plan([*shared, fill], folder)
    one, other = (folder / run.place for run in shared)
    return one, other, folder / fill.place


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run that fills by itself."""
    folder = run_folder(tube_scene(**OFTEN), tmp_path_factory.mktemp("straight"))
    assert compute(folder) is Outcome.FINISHED
    return folder


def test_it_shares_the_fill_of_the_sweep_and_ends_bit_for_bit_as_alone(
    straight: Path, tmp_path: Path
) -> None:
    plain, often, fill = beside_the_sweep(tube_scene(**OFTEN), tmp_path)
    assert [compute(folder) for folder in (fill, plain, often)] == [Outcome.FINISHED] * 3
    assert_same(often, straight)
    costs = {f: read_costs([f]).rows.iloc[-1] for f in (fill, often, straight)}
    assert costs[often].fill == fill.name
    assert costs[fill].grain_steps + costs[often].grain_steps == costs[straight].grain_steps
    assert costs[often].steps == costs[straight].steps
    # the same bed stands before the first vibration
    series = [pd.read_csv(f / "series.tsv", sep="\t") for f in (plain, often)]
    pd.testing.assert_frame_equal(*(t[t["vibration_time_s"].isna()] for t in series))
    # looking more often changes no load: the first window begins where the fill has ended
    first_s = series[0].loc[series[0]["vibration_time_s"] > 0, "time_s"].iloc[0]
    means = []
    for folder in (plain, often):
        loads = pd.read_csv(folder / "loads.tsv", sep="\t")
        shaken = loads[(loads["stage"] == "vibrate_1") & (loads["time_s"] <= first_s + 1e-9)]
        means.append(shaken.groupby("surface")["force_y_n"].mean())
    pd.testing.assert_series_equal(*means, rtol=1e-7)


def test_shaken_loads_are_written_at_each_check(straight: Path) -> None:
    series = pd.read_csv(straight / "series.tsv", sep="\t")
    scene = tube_scene(**OFTEN)
    every_s = scene.from_vibration.rest.check_every_s
    shaken = series.loc[series["vibration_time_s"] > 0, "time_s"].to_numpy()
    assert np.diff(shaken[:40]) == pytest.approx(every_s, abs=2e-9)
    filled = series.loc[series["vibration_time_s"].isna(), "time_s"].to_numpy()
    assert np.median(np.diff(filled)) > 5 * every_s
    # the first window is a whole one
    assert shaken[0] - filled[-1] == pytest.approx(every_s, abs=2e-9)


def test_the_interval_is_a_whole_part_of_that_of_the_fill() -> None:
    scene = tube_scene(**OFTEN)
    fill, shaken = (StepCounts.of(s) for s in (scene, scene.from_vibration))
    assert fill.check % shaken.check == 0
    assert shaken.check == shaken.record
    assert shaken.check * shaken.step_s <= SHAKEN_S
    rest, of_fill = scene.from_vibration.rest, scene.rest
    assert rest.checks * shaken.check == of_fill.checks * fill.check
    # told again it stays
    again = scene.from_vibration.from_vibration
    assert StepCounts.of(again) == shaken
    assert scenario_hash(scene.before_vibration) == scenario_hash(
        tube_scene(**REFERENCE).before_vibration
    )


def test_a_killed_one_goes_on_in_its_fill_and_after_it(straight: Path, tmp_path: Path) -> None:
    folder = run_folder(tube_scene(**OFTEN, record={"checkpoint_every_s": 0.02}), tmp_path)
    kill_after_a_checkpoint(folder)
    assert compute(folder) is Outcome.FINISHED
    np.testing.assert_array_equal(
        last_snapshot(folder).position_m, last_snapshot(straight).position_m
    )
    assert (folder / "loads.tsv").read_bytes() == (straight / "loads.tsv").read_bytes()


def test_a_fill_that_fails_ends_the_run(tmp_path: Path) -> None:
    scene = tube_scene(**OFTEN, guard={"largest_overlap_fraction": 1e-4})
    assert compute(run_folder(scene, tmp_path)) is Outcome.OVERLAP_TOO_LARGE


def test_the_small_shake_shares_its_fill_where_the_engine_can_change_its_checks() -> None:
    for engine, shares in (("reference", True), ("lammps", False)):
        scene = tube_scene(engine={"name": engine}, time_step={"fraction": 0.5})
        shake = _shaken(scene)
        assert not problems(shake)
        assert engine_problem(shake) is None
        same = scenario_hash(shake.before_vibration) == scenario_hash(scene.before_vibration)
        assert same is shares
        window_s = shake.from_vibration.record.series_every_s
        assert window_s < 1.1 / (8 * SHAKEN_HZ[-1])


def test_what_cannot_be_is_said() -> None:
    longer = tube_scene(**{**REFERENCE, "rest": {"shaken_check_every_s": 0.01}})
    (problem,) = problems(longer)
    assert problem.key == "rest.shaken_check_every_s"
    still = tube_scene(**OFTEN, vibration=[])
    assert [p.valid for p in problems(still)] == ["absent without vibration"]
    refused = engine_problem(tube_scene(rest={**SOON, "shaken_check_every_s": SHAKEN_S}))
    assert refused is not None
    assert refused.valid.endswith("engine reference has it")
