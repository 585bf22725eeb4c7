"""The small hopper on each engine: sand flows out, arches, runs out, and is killed on the way."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould.engines.driver import Driver
from sandmould.engines.session import Session
from sandmould.kinds.sand.measure import write_measures
from sandmould.runs.checkpoint_folders import newest_checkpoint
from sandmould.runs.outcome import Outcome
from sandmould.scenario.placement import NOMINAL_FRACTION, filled_measure
from sandmould.study.plan.plan_files import read_run
from tests.hopper import (
    BOX_WIDTH_M,
    DEEP,
    HALF_INSIDE_M,
    HALF_OUTLET_M,
    HOPPER,
    LARGEST_M,
    WALL_M,
    hopper_plates,
    hopper_scene,
)
from tests.liggghts_scenes import needs_liggghts
from tests.workflow.runs import drive, last_snapshot, run_folder

LIGGGHTS = pytest.param("liggghts", marks=needs_liggghts)
ENGINES = ["reference", "lammps", LIGGGHTS]
Emptied = Callable[[str], Path]


class KilledError(Exception):
    """Stands for the signal that ends a run at once."""


class KilledDriver(Driver):
    """Dies in a stage, one check after its first checkpoint there."""

    def __init__(self, *given: Any, dies_in: str) -> None:
        super().__init__(*given)
        self._dies_in = dies_in

    def _window(self, session: Session) -> bool:
        newest, _ = newest_checkpoint(self._work)
        goes_on = super()._window(session)
        if newest is not None and newest[1].stage == self._dies_in:
            raise KilledError
        return goes_on


@pytest.fixture(scope="module")
def emptied(tmp_path_factory: pytest.TempPathFactory) -> Emptied:
    """Give the folder of an engine's run of the hopper, computed without a stop and measured."""

    @functools.cache
    def compute(engine: str) -> Path:
        scene = hopper_scene(engine)
        folder = run_folder(scene, tmp_path_factory.mktemp(engine))
        outcome = drive(scene, folder)
        assert outcome.outcome is Outcome.FINISHED, outcome.detail
        assert outcome.detail == ""
        write_measures(read_run(folder / "scenario.yaml").scenario, folder, folder / "measures.tsv")
        return folder

    return compute


def discharge_of(folder: Path) -> pd.DataFrame:
    """Rows of a run's measures from the opening of the gate until the sand rests."""
    table = pd.read_csv(folder / "measures.tsv", sep="\t")
    return table[table.stage == "discharge"]


def share_out(slope_deg: float) -> float:
    """Share of the sand that flows out where a wedge of a slope stays on either shoulder."""
    shoulder_m = HALF_INSIDE_M - HALF_OUTLET_M
    stays = 2 * NOMINAL_FRACTION[2] * shoulder_m**2 * math.tan(math.radians(slope_deg)) / 2
    return 1 - stays / filled_measure(hopper_scene())


@pytest.mark.parametrize("engine", ENGINES)
def test_sand_flows_out_but_for_a_wedge_on_either_shoulder(engine: str, emptied: Emptied) -> None:
    rows = discharge_of(emptied(engine))
    # The guard would have called a grain lost that fell through the gate before.
    assert rows.outflow_fraction.iloc[0] == 0.0
    # A friction of 0.8 is a slope of 39 degrees and lets 90 % out. A wedge five grains wide steps
    # by a grain, which turns its slope by some 20 degrees.
    assert share_out(60.0) < rows.outflow_fraction.iloc[-1] < share_out(20.0)
    assert rows.grains.iloc[-1] == 220
    series = pd.read_csv(emptied(engine) / "series.tsv", sep="\t")
    speeds = series[series.stage == "discharge"].rms_speed_m_s
    assert speeds.iloc[-1] < HOPPER["rest"]["discharge_rms_speed_m_s"] < speeds.max()


@pytest.mark.parametrize("engine", ["lammps", LIGGGHTS])
def test_engines_let_as_much_flow_out(engine: str, emptied: Emptied) -> None:
    ends = [discharge_of(emptied(name)).iloc[-1] for name in ("reference", engine)]
    # Grains take paths of their own after a few collisions. A wedge of 14 grains is known to its
    # root, 3.7, so two wedges to 5 and a difference of two runs to 7.5 of 220 grains; three times
    # that. (Over 12 fillings the outflow scattered by 0.019 on LAMMPS, by 0.014 on reference.)
    assert ends[0].outflow_fraction == pytest.approx(ends[1].outflow_fraction, abs=0.1)
    for end in ends:
        # OUTFLOW in sandmould/engines/durations.py foretells 0.2 s, without the last of the sand.
        # Checks of rest follow the last grains longer than one record below the limit did.
        assert 0.1 < end.outflow_time_s < 1.2
        assert 0.1 < end.side_load_fraction < 1.5


@pytest.mark.parametrize("engine", ENGINES)
def test_the_gate_carries_sand_until_it_is_opened(engine: str, emptied: Emptied) -> None:
    loads = pd.read_csv(emptied(engine) / "loads.tsv", sep="\t")
    filled = loads[loads.stage == "settle_2"]
    last = filled[filled.time_s == filled.time_s.max()].set_index("surface")
    # It is 47 % of the hopper's floor; a chain of grains that stands beside it rather than on it
    # moves some 10 % of the load, and over ten fillings its share was 37 to 61 %.
    assert last.force_y_n["gate"] / last.force_y_n.sum() == pytest.approx(0.47, abs=0.25)
    after = loads[loads.stage.isin(["discharge", "vibrate_1"])]
    assert set(after.stage) == {"discharge", "vibrate_1"}
    assert set(after.surface) == set(filled.surface) - {"gate"}


@pytest.mark.parametrize("engine", ENGINES)
def test_run_killed_while_sand_flows_and_after_ends_as_if_never_stopped(
    engine: str, emptied: Emptied, tmp_path: Path
) -> None:
    scene = hopper_scene(engine)
    for stage in ("discharge", "vibrate_1"):
        with pytest.raises(KilledError):
            drive(scene, tmp_path, functools.partial(KilledDriver, dies_in=stage))
        newest, _ = newest_checkpoint(tmp_path / "work")
        assert newest is not None
        assert newest[1].stage == stage
    assert drive(scene, tmp_path).outcome is Outcome.FINISHED
    straight = emptied(engine)
    table = pd.read_csv(straight / "measures.tsv", sep="\t")
    shaken = table[table.stage == "vibrate_1"].outflow_fraction
    # Sand still passes the gate's place after the last resumption.
    assert shaken.iloc[-1] > shaken.iloc[-3] > shaken.iloc[0]
    one, two = last_snapshot(straight), last_snapshot(tmp_path)
    for name in ("position_m", "velocity_m_s", "spin_rad_s"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    for table in ("series.tsv", "loads.tsv"):
        assert (tmp_path / table).read_text() == (straight / table).read_text()


@pytest.mark.parametrize("engine", ENGINES)
def test_two_grains_wide_an_outlet_is_blocked_by_an_arch(engine: str, tmp_path: Path) -> None:
    ended = drive(hopper_scene(engine, obstacles=hopper_plates(LARGEST_M)), tmp_path)
    assert ended.outcome is Outcome.NO_FLOW
    assert ended.detail.startswith("an arch holds the sand over the outlet")
    assert ended.detail.endswith("2 of the largest grains")


@pytest.mark.parametrize("engine", ENGINES)
def test_spheres_flow_out_of_a_slice(engine: str, tmp_path: Path) -> None:
    ended = drive(hopper_scene(engine, **DEEP, vibration=[]), tmp_path)
    assert ended.outcome is Outcome.FINISHED, ended.detail
    high = last_snapshot(tmp_path).position_m[:, 2]
    # Front and back hold much of so thin a slice by friction.
    assert 0.3 < (high < hopper_plates()[1]["centre_m"][1]).mean() < 0.9


def test_a_column_behind_an_upright_gate_runs_out(tmp_path: Path) -> None:
    dam = {"kind": "plate", "name": "gate", "centre_m": [0.052, 0.06], "size_m": [WALL_M, 0.12]}
    scene = hopper_scene(
        obstacles=[dam], fill={"over_x_m": [0.0, 0.05], "layers": [{"count": 220}]}, vibration=[]
    )
    folder = run_folder(scene, tmp_path)
    assert drive(scene, folder).outcome is Outcome.FINISHED
    write_measures(read_run(folder / "scenario.yaml").scenario, folder, folder / "measures.tsv")
    rows = discharge_of(folder)
    assert rows.outflow_fraction.iloc[0] == rows.run_out_m.iloc[0] == 0.0
    # It falls over: a good part of it passes the gate, further than a few grains, not to the wall.
    assert 0.1 < rows.outflow_fraction.iloc[-1] < 0.6
    assert 5 * LARGEST_M < rows.run_out_m.iloc[-1] < BOX_WIDTH_M - 0.054
    assert "heap_angle_deg" not in rows
