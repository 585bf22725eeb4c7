"""A box on a table that the grains push: reaction, threads, state."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sandmould.dem import moving_state
from sandmould.dem.motion import NONE, Damping
from sandmould.dem.steps import DemScene
from sandmould.dem.table import MountedTable, TableDrive, TableSolver, sand_force
from sandmould.dem.vectors import dim_of
from tests.unit.dem.test_solver import LAW, STEP_S, box, cloud

GRAINS = {2: 150, 3: 350}
LANDED = 6000
"""Steps after which grains lie on the floor."""


def table_solver(dimension: int, box_frame: bool, threads: int = 1) -> TableSolver:
    down, up = ((0.0,) * (dimension - 1) + (sign,) for sign in (-9.81, 1.0))
    scene = DemScene(LAW, LAW, Damping(NONE, 0.0, 0.0), down, up, box_frame, STEP_S)
    grains, width_m = cloud(dimension, GRAINS[dimension], fall_m_s=1.0)
    made = TableSolver(scene, box(dimension, width_m), 6e-4, threads)
    made.add(grains)
    return made


def drive(first: int, steps: int, table: MountedTable) -> TableDrive:
    """A push of 100 Hz that throws the grains, and a brake that comes on."""
    n = np.arange(first, first + steps)
    return TableDrive(
        60.0 * table.mass_kg * np.sin(2 * np.pi * 100.0 * n * STEP_S), 0.01 * n * table.mass_kg
    )


def table_of(solver: TableSolver) -> MountedTable:
    mass_kg = float(solver.grains.mass.sum())
    return MountedTable(2.0 * mass_kg, 2.0 * mass_kg * 100.0**2, 1.5, -9.81 * mass_kg)


def shaken(solver: TableSolver, *windows: int) -> np.ndarray:
    """Places of the table at the ends of windows of steps."""
    table, first, places = table_of(solver), 0, []
    for steps in windows:
        places.append(solver.advance_on_table(table, drive(first, steps, table))[-1])
        first += steps
    return np.array(places)


def by_id(solver: TableSolver) -> Any:
    order = np.argsort(solver.grains.id)
    return solver.grains.position[order], solver.grains.velocity[order]


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_forces_on_the_grains_tell_the_force_on_the_walls(dimension: int) -> None:
    solver = table_solver(dimension, box_frame=True)
    shaken(solver, LANDED - 1)
    solver.mean_loads(1)
    shaken(solver, 1)
    loads = solver.mean_loads(1)
    for axis in np.eye(dimension):
        on_walls = sum(float(force @ axis) for force in loads.values())
        found = sand_force(dim_of(dimension), solver.grains.force, tuple(axis.tolist()))
        # round-off of a few hundred contacts of some newtons
        assert found == pytest.approx(on_walls, abs=1e-12)
    assert abs(loads["floor"][-1]) > 0.01


@pytest.mark.parametrize("dimension", [2, 3])
def test_windows_threads_and_a_restart_change_no_digit(
    dimension: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(moving_state, "CHUNK", 40)
    straight = table_solver(dimension, box_frame=True)
    end = shaken(straight, LANDED)[-1]
    assert straight.lists > 2, "grains must have been listed again on the way"
    assert abs(end) > 1e-5

    threaded = table_solver(dimension, box_frame=True, threads=2)
    threaded._threads = 2  # also where the machine has one core
    assert shaken(threaded, 1400, LANDED - 1400)[-1] == end

    first = table_solver(dimension, box_frame=True)
    table = table_of(first)
    shaken(first, 1400)
    kept = {name: values.copy() for name, values in first.state().items()}
    second = table_solver(dimension, box_frame=True)
    second.restore(kept)
    assert second.advance_on_table(table, drive(1400, LANDED - 1400, table))[-1] == end
    for other in (threaded, second):
        for ours, theirs in zip(by_id(straight), by_id(other), strict=True):
            np.testing.assert_array_equal(ours, theirs)


def test_both_frames_move_the_table_alike() -> None:
    # 1e-9 of 1e-4 m: round-off, before collisions have made more of it
    ends = [shaken(table_solver(2, box_frame), 1000)[-1] for box_frame in (True, False)]
    assert abs(ends[0]) > 1e-4
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)


def test_a_table_without_a_push_stays_under_resting_grains() -> None:
    solver = table_solver(2, box_frame=True)
    solver.advance(np.zeros(60002))  # the fall, and rest
    table = table_of(solver)
    still = TableDrive(np.zeros(4000), np.full(4000, 2 * 100.0 * table.mass_kg))
    places = solver.advance_on_table(table, still)
    # a thousandth of the sag that the grains' weight would make
    sag_m = table.share * 9.81 * solver.grains.mass.sum() / table.stiffness_n_m
    assert np.abs(places).max() < 1e-3 * sag_m
