"""Measures of a run with a pattern, from snapshots and a convergence log made up by hand."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pandas as pd
import pytest

from sandmould.definition.run import Run
from sandmould.kinds.sand.bending import verdict_of
from sandmould.kinds.sand.bent_files import write_bent, write_solids
from sandmould.kinds.sand.measure import write_measures
from sandmould.kinds.sand.moments import list_moments
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.scene import pattern_of
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.plan_files import read_run
from tests.bent_run import FORCE_N, SCENE, tip_load, write_bent_run
from tests.planned import write_plan


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return with_surface(Scenario.model_validate(SCENE))


@pytest.fixture(scope="module")
def body(scenario: Scenario) -> FoamBody:
    return FoamBody(pattern_of(scenario))


@pytest.fixture
def folder(tmp_path: Path, scenario: Scenario, body: FoamBody) -> Path:
    write_plan([Run("test", "one", {}, 1, scenario, {})], tmp_path)
    write_bent_run(tmp_path / "runs" / "one", body)
    return tmp_path / "runs" / "one"


def measured(folder: Path) -> pd.DataFrame:
    write_measures(read_run(folder / "scenario.yaml").scenario, folder, folder / "measures.tsv")
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


def test_supports_carry_the_sand_and_stress_is_that_of_the_load(
    folder: Path, body: FoamBody, scenario: Scenario
) -> None:
    table = measured(folder)
    # To the last digit that a table has, below a millionth of the load.
    assert table.pattern_support_y_n.to_list() == pytest.approx([-FORCE_N] * 4, rel=1e-7)
    assert table.pattern_support_x_n.to_list() == pytest.approx([0.0] * 4, abs=1e-7 * -FORCE_N)
    pattern = pattern_of(scenario)
    nodes_m = pattern.solve_linear(pattern.on_nodes(tip_load(body)[0]))
    stress_pa = pattern.compression_pa(nodes_m)
    assert table.pattern_compression_largest_pa.iloc[-1] == pytest.approx(stress_pa.max())
    # Plane strain: what is squeezed one way is squeezed across the plane too.
    assert table.pattern_von_mises_largest_pa.iloc[-1] < 1.1 * stress_pa.max()
    assert "pattern_crushed_fraction" not in table
    told = scenario.model_copy(
        update={
            "pattern": scenario.pattern.model_copy(  # type: ignore[union-attr]
                update={"crush_strength_pa": 0.5 * stress_pa.max(), "tolerance_m": 1e-5}
            )
        }
    )
    write_measures(told, folder, folder / "told.tsv")
    told_table = pd.read_csv(folder / "told.tsv", sep="\t")
    share = np.average(stress_pa > 0.5 * stress_pa.max(), weights=pattern.space.weight.sum(axis=1))
    assert 0.0 < share < 0.5
    assert told_table.pattern_crushed_fraction.to_list() == pytest.approx([share] * 4)
    # As drawn nothing is outside; bent, all of the flange is and the foot is not.
    outside = told_table.pattern_outside_tolerance_fraction
    assert outside.iloc[0] == 0.0
    assert 0.3 < outside.iloc[1] < 1.0


def test_the_solid_of_every_stage_has_its_stress(folder: Path, scenario: Scenario) -> None:
    write_solids(scenario, list_moments(folder), folder)
    assert sorted(p.name for p in folder.glob("pattern_*.vtu")) == [
        "pattern_settle_1.vtu", "pattern_vibrate_1.vtu"
    ]  # fmt: skip
    solid = meshio.read(folder / "pattern_settle_1.vtu")
    largest = measured(folder)[["pattern_von_mises_largest_pa", "pattern_compression_largest_pa"]]
    for name, value in zip(("von_mises_pa", "compression_pa"), largest.iloc[-1], strict=True):
        assert solid.cell_data[name][0].max() == pytest.approx(value)
    assert solid.cells[0].type == "quad"
    bent_m = np.linalg.norm(solid.point_data["displacement_m"], axis=1).max()
    assert bent_m == pytest.approx(measured(folder).pattern_largest_displacement_m[1], rel=0.01)


def test_windows_of_the_log_go_to_the_snapshot_that_ends_them(folder: Path) -> None:
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


def test_a_run_without_a_convergence_log_has_its_shape_alone(folder: Path) -> None:
    (folder / CONVERGENCE_LOG).unlink()
    table = measured(folder)
    assert "pattern_tip_deflection_m" in table
    assert "pattern_residual_fraction" not in table


def test_the_bent_pattern_is_written_for_tools_that_measure_shapes(
    folder: Path, body: FoamBody, scenario: Scenario
) -> None:
    write_bent(read_run(folder / "scenario.yaml").scenario, folder, folder / "exports")
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
    thickness_m = scenario.sand.thickness_m
    assert np.ptp(solid.points[:, 2]) == pytest.approx(thickness_m, rel=1e-6)
    highest_m = (body.vertices_m + bent)[:, 1].max()
    assert solid.points[:, 1].max() == pytest.approx(highest_m, rel=1e-6)
