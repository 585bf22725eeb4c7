"""Settled beds for the speed measurements: made once, the same for every engine."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.frame import SCRATCH, Parts
from sandmould.dem import source_hash
from sandmould.dem.solver import Solver
from sandmould.engines.program import build_program
from sandmould.engines.reference.model import grains_of, solver_of
from sandmould.engines.registry import engine_of
from sandmould.engines.session import Session
from sandmould.scenario.placement import PlannedLayer
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario

Floats = NDArray[np.float64]
SPRING_N_M = 7e4
"""Stiffness of all contacts, walls included: softer walls let a grain through in deep beds."""
PERIOD_S = 0.02
"""Of the shaking."""
_SOFTER = {2: 4.0, 3: 100.0}
"""By how much the springs are softer during the fall."""
_WIDTH_PER_DISC_M = 0.131 / 2_500
_VOLUME_PER_SPHERE_M3 = 0.045**3 / 8_000
"""Of a cube as wide as the box; the bed fills some two thirds of it."""


@dataclass(frozen=True)
class Bed:
    """A settled bed in a box."""

    dimension: int
    width_m: float
    depth_m: float
    """Of the box, 3D only."""
    position_m: Floats
    velocity_m_s: Floats
    spin_rad_s: Floats
    radius_m: Floats

    @property
    def grains(self) -> int:
        """How many."""
        return len(self.radius_m)

    @property
    def name(self) -> str:
        """For people."""
        number = f"{self.grains:,}".replace(",", " ")
        return f"{number} {'discs' if self.dimension == 2 else 'spheres'}"


def floor_m(dimension: int, grains: int) -> float:
    """Width of the box: beds of discs are all equally high, of spheres of one shape."""
    if dimension == 2:
        return _WIDTH_PER_DISC_M * grains
    return math.cbrt(_VOLUME_PER_SPHERE_M3 * grains)


def scene(
    dimension: int,
    grains: int,
    width_m: float,
    depth_m: float,
    engine: str = "reference",
    threads: int = 1,
    **changes: Any,
) -> Scenario:
    """Default sand as all engines can compute it, without background damping, in a box."""
    wall = {
        "normal_stiffness_n_m": SPRING_N_M,
        "tangential_stiffness_n_m": SPRING_N_M,
        "rolling_stiffness_n_m": SPRING_N_M,
    }
    base: dict[str, Any] = {
        "dimension": dimension,
        "box": {"width_m": width_m, "depth_m": depth_m, "height_m": 0.5},
        "sand": {"disc_inertia": "sphere", "disc_thickness_m": 0.1},
        "contact": {"grain_wall": wall},
        "background_damping": {"form": "none"},
        "fill": {
            "layers": [{"count": grains}],
            "settling": {"longest_s": 5.0},
        },
        "vibration": [{"frequency_hz": 1 / PERIOD_S, "acceleration_g": 1.5, "duration_s": 10.0}],
        "engine": {"name": engine, "ranks": threads},
    }
    return Scenario.model_validate(merge(base, changes, Origin(), "benchmark"))


@contextmanager
def opened(scenario: Scenario) -> Iterator[Session]:
    """Open a session of any engine with its grains in the box."""
    program, engine = build_program(scenario), engine_of(scenario)
    engine.refuse(scenario)
    with tempfile.TemporaryDirectory(prefix="bed_") as name:
        folder = Path(name)
        engine.write_deck(program, {}, folder, "bed", "benchmark")
        session = engine.open_session(program, folder, folder / "engine.log")
        try:
            session.insert_layer(1)
            yield session
        finally:
            session.close()


def falling(dimension: int) -> dict[str, Any]:
    """Changes for the fall: springs that allow longer steps."""
    springs_n_m = SPRING_N_M / _SOFTER[dimension]
    law = {
        "normal_stiffness_n_m": springs_n_m,
        "tangential_stiffness_n_m": springs_n_m,
        "rolling_stiffness_n_m": springs_n_m,
    }
    return {
        "contact": {"grain_grain": law, "grain_wall": law},
        "time_step": {"fraction": 0.8},
        "rest": {"rms_speed_m_s": 1e-3},
    }


def resting() -> dict[str, Any]:
    """Changes for coming to rest with the springs as they are: in a thick oil."""
    return {
        "time_step": {"fraction": 0.8},
        "background_damping": {
            "form": "viscous",
            "viscous_translation_per_s": 1000.0,
            "viscous_rotation_per_s": 1000.0,
        },
        "fill": {"settling": {"shortest_s": 0.005}},
        "rest": {"rms_speed_m_s": 1e-3, "check_every_s": 0.001},
    }


def _rested(scenario: Scenario, bed: Bed | None) -> Bed:
    """Let grains fall, or a bed whose springs have changed come to rest again."""
    program = build_program(scenario)
    with opened(scenario) as session:
        if bed is not None:
            session.set_state(bed.position_m, bed.velocity_m_s, bed.spin_rad_s)
        session.start_stage(program.stages[0])
        while not session.stage_over:
            session.advance()
        if not session.at_rest:
            raise SystemExit(f"{session.grains} grains are not at rest after {session.time_s} s")
        state = session.snapshot()
    return Bed(
        scenario.dimension,
        scenario.box.width_m,
        scenario.box.depth_m,
        state.position_m,
        state.velocity_m_s,
        state.spin_rad_s,
        state.radius_m,
    )


def settled(dimension: int, grains: int) -> Bed:
    """Settle a bed on the reference engine, or take the one kept from an earlier run.

    It falls with softer springs, which takes longer steps, and comes to rest again with its own
    under a viscous damping. Both are off when speeds are measured.
    """
    width_m = floor_m(dimension, grains)

    def changed(changes: dict[str, Any]) -> Scenario:
        return scene(dimension, grains, width_m, width_m, **changes)

    soft, stiff = changed(falling(dimension)), changed(resting())
    origin = {
        "falling": soft.model_dump_json(), "resting": stiff.model_dump_json(),
        "solver": source_hash(),
    }  # fmt: skip

    def settle() -> dict[str, list[Any]]:
        print(f"settling {grains} grains in {dimension}D", flush=True)
        bed = _rested(stiff, _rested(soft, None))
        return {k: v.tolist() for k, v in vars(bed).items() if isinstance(v, np.ndarray)}

    arrays = Parts(SCRATCH / "beds", origin).get(f"bed {dimension}d {grains}", settle)
    return Bed(dimension, width_m, width_m, **{k: np.array(v) for k, v in arrays.items()})


def tiled(bed: Bed, grains: int) -> Bed:
    """Copies of a bed side by side in one long box, cut off after so many grains."""
    copies = math.ceil(grains / bed.grains)
    order = np.argsort(bed.position_m[:, 0])
    shift = np.zeros((copies, 1, bed.dimension))
    shift[:, 0, 0] = bed.width_m * np.arange(copies)
    position = (bed.position_m[order] + shift).reshape(-1, bed.dimension)[:grains]
    radius = np.tile(bed.radius_m[order], copies)[:grains]
    return Bed(
        bed.dimension,
        float((position[:, 0] + radius).max()),
        bed.depth_m,
        position,
        np.tile(bed.velocity_m_s[order], (copies, 1))[:grains],
        np.tile(bed.spin_rad_s[order], (copies, 1))[:grains],
        radius,
    )


def solver_on(bed: Bed, threads: int = 1, **changes: Any) -> Solver:
    """Bare solver of the reference engine with a bed in it, the scene changed as said."""
    scenario = scene(
        bed.dimension, bed.grains, bed.width_m, bed.depth_m, threads=threads, **changes
    )
    solver = solver_of(scenario, build_program(scenario).stages[0], scenario.step_s)
    kinds = np.ones(bed.grains, dtype=np.int64)
    solver.add(grains_of(scenario, PlannedLayer(kinds, bed.radius_m, bed.position_m), 0.0, 1))
    spins = solver.grains.spin.shape[1]
    solver.place(bed.position_m, bed.velocity_m_s, bed.spin_rad_s[:, 3 - spins :])
    return solver
