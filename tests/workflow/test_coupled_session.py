"""The staggered loop on engines: a plate on springs under sand, whose rest is known exactly."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from sandmould.engines.program import StepCounts, build_program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.session import EngineStop, Session
from sandmould.pattern_fe.coupling.body import StaticSolution
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.session import CoupledSession
from sandmould.pattern_fe.coupling.shapes_file import SHAPES
from sandmould.runs.outcome import Outcome
from sandmould.scenario.pattern import Loop
from sandmould.scenario.scenario import Scenario
from tests.patterns import read_shapes
from tests.scenes import open_lammps, tube_scene

Array = NDArray[np.float64]
SLAB_M = np.array([[0.001, 0.02], [0.04, 0.02], [0.079, 0.02], [0.079, 0.025], [0.04, 0.025],
                   [0.001, 0.025]])  # fmt: skip
STIFFNESS_N_M = 1e4
SCENE: dict[str, Any] = {
    "obstacles": [{"kind": "polygon", "name": "pattern", "vertices_m": SLAB_M.tolist()}],
    # The plate follows the sand within some windows: rest takes longer than on a fixed floor.
    "fill": {"layers": [{"count": 40, "repeat": 2}], "settling": {"shortest_s": 0.8}},
    "background_damping": {"form": "none"},
    "vibration": [],
    "rest": {"load_every_steps": 5},
}


@dataclass
class Plate:
    """Rigid plate on springs that let it move up and down alone."""

    vertices_m: Array
    stiffness_n_m: float = STIFFNESS_N_M

    def solve(self, load_n: Array) -> StaticSolution:
        """Weight over stiffness."""
        force_n = load_n.sum(axis=0)
        sinks = np.zeros_like(self.vertices_m)
        sinks[:, 1] = force_n[1] / self.stiffness_n_m
        return StaticSolution(sinks, sinks, 0.5 * force_n[1] ** 2 / self.stiffness_n_m, -force_n)


def settings(**changes: Any) -> Loop:
    values: dict[str, Any] = {
        "window_s": 0.002, "scheme": "fixed", "factor": 0.02, "least_factor": 0.005,
        "most_factor": 1.0, "repeats": 0, "tolerance": 0.01,
        "largest_displacement_m": 0.02,
    }  # fmt: skip
    return Loop(**(values | changes))


def opened(engine: str, folder: Path, scenario: Scenario, checkpoint: Path | None) -> Session:
    if engine == "lammps":
        return open_lammps(scenario, folder, checkpoint)
    return ReferenceSession(build_program(scenario), checkpoint)


def coupled(
    folder: Path, engine: str = "reference", checkpoint: Path | None = None, **changes: Any
) -> CoupledSession:
    scenario = tube_scene(**SCENE)
    inner = opened(engine, folder, scenario, checkpoint)
    plate = Plate(SLAB_M, changes.pop("stiffness_n_m", STIFFNESS_N_M))
    counts, share = StepCounts.of(scenario), changes.pop("load_tolerance", None)
    loop = settings(**changes)
    return CoupledSession(inner, plate, "pattern", loop, counts, folder, checkpoint, share)


def filled(session: CoupledSession, records: int = 10**6) -> int:
    """Fill both layers, or as far as so many records go."""
    scenario, done = tube_scene(**SCENE), 0
    for stage in build_program(scenario).stages:
        session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over and done < records:
            session.advance()
            done += 1
    return done


@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_the_plate_comes_to_rest_where_its_springs_carry_the_sand(
    engine: str, tmp_path: Path
) -> None:
    session = coupled(tmp_path, engine)
    filled(session)
    log, last = after(session, tmp_path)
    weight_n = (session.snapshot().radius_m ** 2).sum() * np.pi * 2400 * 0.1 * 9.80665
    loads = session.surface_loads()
    assert loads is not None
    session.close()
    # Walls carry a part of the weight by friction; plate and sand still swing by a few per cent.
    assert 0.5 * weight_n < -loads["pattern"][1] < 1.05 * weight_n
    sunk_m = -session.displacement_m[:, 1]
    assert np.ptp(sunk_m) < 1e-15
    # The sand is at rest by its rule, not exactly: its load still moves a little.
    assert sunk_m[0] == pytest.approx(-loads["pattern"][1] / STIFFNESS_N_M, rel=0.05)
    assert last.residual_m < 0.05 * last.displacement_m
    # Damped sand loses what the plate does not store: falling sand works on it more than slow sand.
    assert log.energy_j.iloc[-1] <= last.work_j


def after(session: CoupledSession, folder: Path) -> tuple[pd.DataFrame, Any]:
    """Ledger up to now, and its last window."""
    session._log.size()
    session._shapes.flush()
    log = read_convergence_log(folder / CONVERGENCE_LOG)
    return log, log.iloc[-1]


def test_shapes_and_loads_are_those_of_every_record(tmp_path: Path) -> None:
    session = coupled(tmp_path)
    records = filled(session, records=4)
    loads, snapshot = session.surface_loads(), session.snapshot()
    assert loads is not None
    assert snapshot.pattern_load_n is not None
    np.testing.assert_allclose(snapshot.pattern_load_n.sum(axis=0), loads["pattern"], rtol=1e-9)
    np.testing.assert_array_equal(snapshot.pattern_m, SLAB_M + session.displacement_m)
    session.close()
    time_s, shapes_m = read_shapes(tmp_path / SHAPES, len(SLAB_M), 2)
    assert len(time_s) == records
    np.testing.assert_array_equal(shapes_m[-1], session.displacement_m)


def test_vertex_loads_of_all_windows_make_up_the_record(tmp_path: Path) -> None:
    for engine in ("reference", "lammps"):
        folder = tmp_path / engine
        folder.mkdir()
        scenario = tube_scene(**SCENE)
        session = opened(engine, folder, scenario, None)
        session.insert_layer(1)
        session.start_stage(build_program(scenario).stages[0])
        counts = StepCounts.of(scenario)
        samples = counts.check // counts.load
        parts = [samples // 3, samples // 4, samples - samples // 3 - samples // 4]
        while session.time_s < 0.1:  # sand has come down
            session.advance()
        mean = np.zeros_like(SLAB_M)
        for part in parts:
            session.advance(part * counts.load * session.step_s)
            load = session.vertex_loads("pattern")
            assert load is not None
            mean += load * part / samples
        whole = session.surface_loads()
        assert whole is not None
        np.testing.assert_allclose(mean.sum(axis=0), whole["pattern"], rtol=1e-9, atol=1e-9)
        assert np.abs(mean[3:]).sum() > 10 * np.abs(mean[:3]).sum()  # sand lies on top
        assert session.vertex_loads("pattern") is None
        session.close()


@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_a_stopped_loop_goes_on_as_if_never_stopped(engine: str, tmp_path: Path) -> None:
    (tmp_path / "straight").mkdir()
    (tmp_path / "stopped").mkdir()
    straight = coupled(tmp_path / "straight", engine, scheme="aitken")
    first = coupled(tmp_path / "stopped", engine, scheme="aitken")
    stage = build_program(tube_scene(**SCENE)).stages[0]
    checkpoints = [tmp_path / "straight" / "kept", tmp_path / "stopped" / "kept"]
    for session, folder in zip((straight, first), checkpoints, strict=True):
        folder.mkdir()
        session.insert_layer(1)
        session.start_stage(stage)
        for _ in range(6):
            session.advance()
        session.write_checkpoint(folder)
    load_n = first.snapshot().pattern_load_n
    first.advance()  # beyond what the checkpoint vouches for
    first.close()
    second = coupled(tmp_path / "stopped", engine, checkpoints[1], scheme="aitken")
    np.testing.assert_array_equal(second.snapshot().pattern_load_n, load_n)
    for _ in range(3):
        straight.advance()
        second.advance()
    straight.close()
    second.close()
    exact = 0.0 if engine == "reference" else 1e-9  # DESIGN, section 3
    np.testing.assert_allclose(
        second.displacement_m, straight.displacement_m, rtol=exact, atol=exact
    )
    one, two = (
        read_convergence_log(tmp_path / name / CONVERGENCE_LOG) for name in ("straight", "stopped")
    )
    np.testing.assert_allclose(
        two.drop(columns="solve_s"), one.drop(columns="solve_s"), rtol=exact, atol=exact
    )


def test_repeated_windows_end_with_the_answer_that_was_shown(tmp_path: Path) -> None:
    plain, repeated = tmp_path / "plain", tmp_path / "repeated"
    logs = []
    for folder, repeats in ((plain, 0), (repeated, 12)):
        folder.mkdir()
        session = coupled(folder, scheme="quasi_newton", repeats=repeats)
        filled(session, records=12)
        session.close()
        logs.append(read_convergence_log(folder / CONVERGENCE_LOG).iloc[20:])
    within = [(log.residual_m <= 0.01 * log.displacement_m).mean() for log in logs]
    assert within[1] > 0.9 > within[0]
    assert logs[1].passes.max() > 1


def test_loads_of_one_way_bend_a_pattern_that_the_sand_never_sees_move(tmp_path: Path) -> None:
    session = coupled(tmp_path, scheme="one_way", repeats=12)
    filled(session, records=8)
    log, last = after(session, tmp_path)
    session.close()
    assert not log.displacement_m.any()
    assert (log.passes == 1).all()
    sunk_m = -session.displacement_m[:, 1]
    assert sunk_m[0] == pytest.approx(last.residual_m)  # of a plate all of whose vertices sink
    assert sunk_m[0] > 0.0


def test_by_layers_the_plate_stands_still_until_the_sand_rests(tmp_path: Path) -> None:
    session = coupled(tmp_path, scheme="per_layer", factor=0.02, load_tolerance=0.01)
    ended = []
    for stage in build_program(tube_scene(**SCENE)).stages:
        session.insert_layer(stage.layer)
        session.start_stage(stage)
        before, rested = session.displacement_m.copy(), False
        while not session.stage_over:
            session.advance()
            rested = rested or session.sand.sand_rests
            if not ended and not rested:
                np.testing.assert_array_equal(session.displacement_m, before)
        ended.append(session.displacement_m[0, 1])
        assert session.at_rest, session.rest_sentence
    session.close()
    # The stage was held until it had come to where its springs carry the sand.
    assert ended[1] == pytest.approx(session._load.sum(axis=0)[1] / STIFFNESS_N_M, rel=0.01)
    assert ended[1] < 1.5 * ended[0] < 0.0


def test_a_soft_plate_runs_away_in_the_plain_loop_and_holds_by_aitken(tmp_path: Path) -> None:
    (tmp_path / "plain").mkdir()
    (tmp_path / "aitken").mkdir()
    soft = 200.0
    with pytest.raises(EngineStop, match="pattern is to move by") as stop:
        filled(coupled(tmp_path / "plain", factor=1.0, stiffness_n_m=soft))
    assert stop.value.outcome is Outcome.COUPLING_DIVERGED
    held = coupled(tmp_path / "aitken", scheme="aitken", factor=0.02, stiffness_n_m=soft)
    filled(held, records=10)
    held.close()
