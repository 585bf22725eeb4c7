"""One run by LIGGGHTS from its folder: products, kill and resume, wall time, lost grains."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sandmould.engines.driver import Driver
from sandmould.engines.liggghts.render import write_deck
from sandmould.engines.program import build_program
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import read_costs
from tests.liggghts_scenes import liggghts_scene, needs_liggghts
from tests.workflow.runs import (
    computed,
    kill_after_a_checkpoint,
    last_snapshot,
    run_folder,
    simulate,
)

pytestmark = needs_liggghts
SHORT = {
    "fill": {"layers": [{"count": 40, "repeat": 2}]},
    "rest": {"rms_speed_m_s": 0.03},
    "record": {"snapshot_every_s": 0.02, "checkpoint_every_s": 0.02},
}


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute the small scene without a stop."""
    return computed(liggghts_scene(**SHORT), tmp_path_factory.mktemp("straight"))


def test_run_leaves_all_its_products_and_no_work(straight: Path) -> None:
    names = {p.name for p in straight.iterdir()}
    assert {"outcome.json", "products.json", "series.tsv", "loads.tsv",
            "snapshots.npz", "engine.log", "deck.in", "layers"} <= names  # fmt: skip
    assert not names & {"work", "log.liggghts"}
    assert RunOutcome.read(straight / "outcome.json").outcome is Outcome.FINISHED
    cost = read_costs([straight]).rows.iloc[0]
    assert cost.engine == "liggghts"
    assert str(cost.version).startswith("3.")
    assert cost.grains == 80
    loads = pd.read_csv(straight / "loads.tsv", sep="\t")
    assert {"floor", "left", "right", "tube_lower", "tube_upper"} == set(loads.surface)


def test_layers_come_to_rest_one_after_the_other(straight: Path) -> None:
    series = pd.read_csv(straight / "series.tsv", sep="\t")
    for stage, grains in (("settle_1", 40), ("settle_2", 80)):
        rows = series[series.stage == stage]
        assert set(rows.grains) == {grains}
        assert rows.rms_speed_m_s.iloc[-1] < 0.03


def test_killed_run_resumes_and_ends_as_if_never_stopped(straight: Path, tmp_path: Path) -> None:
    folder = run_folder(liggghts_scene(**SHORT), tmp_path)
    kill_after_a_checkpoint(folder)
    assert simulate(folder) == 0
    one, two = last_snapshot(straight), last_snapshot(folder)
    for name in ("position_m", "velocity_m_s", "spin_rad_s"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    for table in ("series.tsv", "loads.tsv"):
        assert (folder / table).read_text() == (straight / table).read_text()
    costs = [read_costs([f]).rows.iloc[0] for f in (straight, folder)]
    assert costs[0].grain_steps == costs[1].grain_steps


def test_wall_time_limit_leaves_a_checkpoint_and_the_driver_goes_on(tmp_path: Path) -> None:
    scene = liggghts_scene(**SHORT, guard={"wall_limit_s": 0.01})
    program = build_program(scene)
    write_deck(program, {}, tmp_path, "test", "test")
    steps = []
    for _ in range(2):
        driver = Driver(program, tmp_path, "test", scenario_hash(scene))
        outcome = driver.run()
        assert outcome.outcome is Outcome.OUT_OF_WALL_TIME
        steps.append(driver.cost.steps)
    assert steps[1] > steps[0] > 0
