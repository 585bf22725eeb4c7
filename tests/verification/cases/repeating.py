"""Restarts, threads and orientations: what must hold to the last digit, or to round-off."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sandmould.dem import moving_state
from sandmould.dem.contact_law import Law
from sandmould.dem.grains import Grains
from sandmould.dem.motion import NONE, Damping
from sandmould.dem.solver import Solver
from sandmould.dem.steps import DemScene
from sandmould.dem.surfaces import Surfaces
from sandmould.engines.registry import engine_of
from sandmould.engines.session import Session
from sandmould.scenario.scenario import Scenario
from tests.verification.cases.bench import RADIUS_M, Array, Bench, law, scene, stiffness
from tests.verification.cases.case import Measured, case

WINDOW_S = 1e-3


def _crowd(engine: str, dimension: int, /, **changes: Any) -> tuple[Scenario, Array, Array]:
    """Sixty grains that fall into a narrow box, and where they start."""
    contact_law = law(dimension, 0.3, 0.5, 0.1)
    given = scene(
        engine,
        dimension,
        60,
        wall=contact_law,
        pair=contact_law,
        step_s=2e-5,
        gravity_m_s2=9.80665,
        box={"width_m": 0.026, "depth_m": 0.014},
        rest={"load_every_steps": 50, "check_every_s": WINDOW_S},
        **changes,
    )
    rng = np.random.default_rng(3)
    columns = (6, 1) if dimension == 2 else (6, 3)
    rows = np.arange(60)
    place = np.zeros((60, dimension))
    place[:, 0] = 0.003 + 0.004 * (rows % columns[0]) + 1e-4 * rng.random(60)
    if dimension == 3:
        place[:, 1] = 0.003 + 0.004 * (rows // 6 % 3) + 1e-4 * rng.random(60)
    place[:, -1] = 0.003 + 0.0042 * (rows // (columns[0] * columns[1]))
    velocity = 0.05 * rng.normal(size=place.shape)
    velocity[:, -1] -= 0.3
    return given, place, velocity


def _apart(one: Session, other: Session) -> float:
    a, b = one.snapshot(), other.snapshot()
    names = ("position_m", "velocity_m_s", "spin_rad_s")
    return max(float(np.abs(getattr(a, n) - getattr(b, n)).max()) for n in names)


@case("-", "0 on the reference engine; 1e-9 asked of the others")
def restored_equals_straight(engine: str, dimension: int) -> Iterator[Measured]:
    """Sixty rough grains fall into a box; a checkpoint amid the collisions, then 1 000 steps more.

    The session that wrote it is compared with one that started from it: the largest difference of
    any position, velocity or spin.
    """
    given, place, velocity = _crowd(engine, dimension)
    with Bench(given) as bench, tempfile.TemporaryDirectory() as folder:
        bench.place(place, velocity)
        bench.advance(30 * WINDOW_S)
        bench.session.write_checkpoint(Path(folder))
        program, files = bench.program, bench.folder
        other = engine_of(given).open_session(program, files, files / "restored.log", Path(folder))
        for session in (bench.session, other):
            session.advance(1000 * given.step_s)
        moved = float(np.abs(bench.state().position_m - place).max())
        apart = _apart(bench.session, other)
        other.close()
    assert moved > RADIUS_M
    yield Measured(
        "largest difference", apart, 0.0, 0.0 if engine == "reference" else 1e-9, "m, m/s, rad/s"
    )


@case("-", "0: the order of all sums is fixed", engines=("reference",))
def two_threads_equal_one(engine: str, dimension: int) -> Iterator[Measured]:
    """The same grains in eight chunks on one and on two threads."""
    usual, moving_state.CHUNK = moving_state.CHUNK, 7
    try:
        ends = []
        for threads in (1, 2):
            given, place, velocity = _crowd(engine, dimension, engine={"ranks": threads})
            with Bench(given) as bench:
                bench.place(place, velocity)
                solver = bench.session.solver  # type: ignore[attr-defined]
                solver._threads = threads  # also where the machine has one core
                now = bench.advance(40 * WINDOW_S)
                ends.append(np.hstack([now.position_m, now.velocity_m_s, now.spin_rad_s]))
    finally:
        moving_state.CHUNK = usual
    yield Measured(
        "largest difference", float(np.abs(ends[0] - ends[1]).max()), 0.0, 0.0, "m, m/s, rad/s"
    )


def _lone_grain(dimension: int, step_s: float) -> Solver:
    """A solver that records the orientation of one grain in empty space."""
    unit = stiffness(dimension)
    smooth = Law(unit, unit, 0.0, 0.0, 0.0, unit, True, False)
    nothing, up = (0.0,) * dimension, (0.0,) * (dimension - 1) + (1.0,)
    given = DemScene(smooth, smooth, Damping(NONE, 0.0, 0.0), nothing, up, True, step_s)
    solver = Solver(given, Surfaces(dimension), RADIUS_M, orientations=True)
    spins = 1 if dimension == 2 else 3
    zeros, one = np.zeros((1, dimension)), np.ones(1)
    solver.add(
        Grains.of(
            np.ones(1, dtype=np.int64), zeros.copy(), zeros.copy(), np.zeros((1, spins)),
            RADIUS_M * one, one.copy(), one.copy(),
        )
    )  # fmt: skip
    return solver


@case("(8)-(13)", "1e-12: round-off of 1 000 steps", engines=("reference",))
def orientation(engine: str, dimension: int) -> Iterator[Measured]:
    """Ten constant spins one after the other turn a grain by ten exact rotations.

    In 2D the angle is the sum of w t. In 3D the grain is turned at the start. Its matrix is the
    product of the rotations by |w| t about w, the later on the left (12). It stays orthogonal.
    """
    step, steps = 1e-4, 100
    solver = _lone_grain(dimension, step)
    rng = np.random.default_rng(5)
    spins = rng.normal(0.0, 200.0, (10, 1 if dimension == 2 else 3))
    if dimension == 2:
        exact: Any = 0.0
    else:
        exact = Rotation.from_rotvec([0.3, -0.7, 1.1])
        solver.orientation[0] = exact.as_matrix().ravel()
    for w in spins:
        solver.grains.spin[0] = w
        solver.advance(np.zeros(steps + 2))
        turn = w * step * steps
        exact = exact + turn[0] if dimension == 2 else Rotation.from_rotvec(turn) * exact
    found = solver.orientation[0]
    if dimension == 2:
        yield Measured("angle", found[0], exact, 1e-12 * abs(exact), "rad")
        return
    matrix = found.reshape(3, 3)
    off = float(np.abs(matrix - exact.as_matrix()).max())
    yield Measured("largest error of the matrix", off, 0.0, 1e-12)
    yield Measured(
        "largest part of L L^T - 1", float(np.abs(matrix @ matrix.T - np.eye(3)).max()), 0.0, 1e-12
    )
