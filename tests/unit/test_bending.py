"""Measures of a run with a pattern, from snapshots and a ledger made up by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pandas as pd
import pytest

from pattern_fe.coupling.foam_body import FoamBody
from pattern_fe.coupling.ledger import LEDGER
from pattern_fe.scene import pattern_of, with_surface
from sandmould.engines.outcome import Outcome, RunOutcome
from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.scenario import Scenario
from sandmould.study.bending import verdict_of
from sandmould.study.expand import Run
from sandmould.study.measure import write_exports, write_measures
from sandmould.study.plan import write_plan

FORCE_N = -0.2
"""On the tip of the flange, downwards."""
WINDOW_S = 0.002
SCENE: dict[str, Any] = {
    "box": {"width_m": 0.15, "height_m": 0.15},
    "pattern": {
        "shape": {"kind": "l_shape", "thickness_m": 0.01, "height_m": 0.06, "reach_m": 0.05},
        "position_m": [0.04, 0.0],
    },
}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return with_surface(Scenario.model_validate(SCENE))


@pytest.fixture(scope="module")
def body(scenario: Scenario) -> FoamBody:
    return FoamBody(pattern_of(scenario))


@pytest.fixture
def folder(tmp_path: Path, scenario: Scenario, body: FoamBody) -> Path:
    """Four snapshots: drawn, bent under a load, the same as vibration begins, half bent."""
    write_plan([Run("test", "one", {}, 1, scenario, {})], tmp_path)
    folder = tmp_path / "runs" / "one"
    (folder / "snapshots").mkdir()
    load, bent = tip_load(body)
    one = np.array([1])
    place_m, none = np.array([[0.01, 0.002]]), np.zeros((1, 2))
    for number, (time_s, shaken_s, share) in enumerate(
        [(0.02, -1.0, 0.0), (0.04, -1.0, 1.0), (0.04, 0.0, 1.0), (0.06, 0.02, 0.5)]
    ):
        stage = "settle_1" if shaken_s < 0.0 else "vibrate_1"
        Snapshot(
            time_s, shaken_s, stage, one, one, place_m, none, np.zeros((1, 3)), np.array([0.002]),
            pattern_m=body.vertices_m + share * bent, pattern_load_n=load,
        ).save(folder / "snapshots" / f"{number:06d}.npz")  # fmt: skip
    write_ledger(folder)
    pd.DataFrame({"wall_s": [6.0]}).to_csv(folder / "cost.tsv", sep="\t", index=False)
    return folder


def tip_load(body: FoamBody) -> tuple[np.ndarray, np.ndarray]:
    load = np.zeros_like(body.vertices_m)
    load[np.argmax(body.vertices_m @ [1.0, 1.0]), 1] = FORCE_N
    return load, body.answer(load).displacement_m


def write_ledger(folder: Path) -> None:
    time_s = WINDOW_S * np.arange(1, 31)
    rows = pd.DataFrame(
        {
            "time_s": time_s, "window_s": WINDOW_S, "passes": 2, "factor": 0.02, "gain": np.nan,
            "residual_m": np.where(time_s < 0.041, 2e-4, 1e-4), "displacement_m": 1e-3,
            "largest_m": 2e-3, "load_n": 0.2, "imbalance_n": 2e-12, "moment_left_n_m": 1e-12,
            "work_j": 0.01 * time_s, "energy_j": 0.005 * time_s, "solve_s": 0.01,
        }
    )  # fmt: skip
    rows.to_csv(folder / LEDGER, sep="\t", index=False)


def measured(folder: Path) -> pd.DataFrame:
    write_measures(folder, folder / "measures.tsv")
    return pd.read_csv(folder / "measures.tsv", sep="\t")


def test_shape_and_answer_are_those_of_the_loads(folder: Path, body: FoamBody) -> None:
    table = measured(folder)
    _, bent = tip_load(body)
    tip_m = -bent[np.argmax(body.vertices_m @ [1.0, 1.0]), 1]
    assert table.pattern_tip_deflection_m.to_list() == pytest.approx(
        [0.0, tip_m, tip_m, 0.5 * tip_m]
    )
    assert table.pattern_tip_answered_m.to_list() == pytest.approx([tip_m] * 4)
    assert table.pattern_tip_filled_m.to_list() == pytest.approx([tip_m] * 4)
    assert table.pattern_tip_recovered_m.iloc[-1] == pytest.approx(0.5 * tip_m)
    largest_m = np.linalg.norm(bent, axis=1).max()
    assert table.pattern_largest_displacement_m.iloc[1] == pytest.approx(largest_m)
    # The flange sinks by nearly what its tip does, which a corner's distance cannot exceed.
    assert 0.8 * tip_m < table.pattern_distance_largest_m.iloc[1] <= largest_m
    assert 0.0 < table.pattern_distance_rms_m.iloc[1] < table.pattern_distance_largest_m.iloc[1]


def test_windows_of_the_ledger_go_to_the_snapshot_that_ends_them(folder: Path) -> None:
    table = measured(folder)
    assert table.pattern_windows.to_list() == [10, 20, 20, 30]
    assert table.pattern_passes.to_list() == [20, 40, 40, 60]
    assert table.pattern_residual_fraction.to_list() == pytest.approx([0.2, 0.2, 0.2, 0.1])
    assert table.pattern_work_j.to_list() == pytest.approx([2e-4, 4e-4, 4e-4, 6e-4])
    assert table.pattern_stored_fraction.iloc[-1] == pytest.approx(0.5 * 0.051 / 0.06)
    assert table.pattern_force_left_fraction.iloc[-1] == pytest.approx(1e-11)
    reach_m = np.hypot(0.05, 0.06)
    assert table.pattern_moment_left_fraction.iloc[-1] == pytest.approx(5e-12 / reach_m)
    assert table.pattern_outside_fraction.iloc[0] == pytest.approx(30 * 0.01 / 6.0)
    assert set(table.pattern_loop) == {"holds"}


def test_a_run_stopped_by_its_loop_diverged(folder: Path) -> None:
    RunOutcome(Outcome.COUPLING_DIVERGED, "", 0.06, 0.1).write(folder / "outcome.json")
    found, before = verdict_of(folder), verdict_of(folder, 0.04)
    assert found is not None
    assert before is not None
    assert (found.state, before.state) == ("diverged", "lags")


def test_a_run_without_a_ledger_has_its_shape_alone(folder: Path) -> None:
    (folder / LEDGER).unlink()
    table = measured(folder)
    assert "pattern_tip_deflection_m" in table
    assert "pattern_residual_fraction" not in table


def test_the_bent_pattern_is_written_for_tools_that_measure_shapes(
    folder: Path, body: FoamBody, scenario: Scenario
) -> None:
    write_exports(folder, folder / "exports")
    names = sorted(p.name for p in (folder / "exports").glob("pattern_*"))
    assert names == ["pattern_filled.stl", "pattern_filled.vtu", "pattern_final.stl",
                     "pattern_final.vtu"]  # fmt: skip
    load, bent = tip_load(body)
    final = meshio.read(folder / "exports" / "pattern_final.vtu")
    assert final.points[:, :2] == pytest.approx(body.vertices_m + 0.5 * bent)
    assert final.point_data["load_n"][:, :2] == pytest.approx(load)
    assert np.abs(final.point_data["distance_m"]).max() == pytest.approx(
        measured(folder).pattern_distance_largest_m.iloc[-1]
    )
    solid = meshio.read(folder / "exports" / "pattern_filled.stl")
    thickness_m = scenario.sand.disc_thickness_m
    assert np.ptp(solid.points[:, 2]) == pytest.approx(thickness_m, rel=1e-6)
    highest_m = (body.vertices_m + bent)[:, 1].max()
    assert solid.points[:, 1].max() == pytest.approx(highest_m, rel=1e-6)
