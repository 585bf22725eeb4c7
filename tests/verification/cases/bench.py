"""A test bench: a few grains placed exactly in a box, computed by any engine."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_of, engine_problem
from sandmould.engines.session import Session
from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from tests.verification.cases.case import RefusedCase

Array = NDArray[np.float64]
RADIUS_M = 0.002
THICKNESS_M = 0.1
"""Of the discs."""
SMALL_M, LARGE_M = 0.0016, 0.0024
OMEGA_RAD_S = 2000.0
"""sqrt(k/m) of the stiffness that ``law`` gives unless told and the mass of a grain of RADIUS_M."""
LIGHT_M_S2 = 0.1
"""A gravity so light that a grain's sag, g/omega^2, is 1e-5 radii: where on the overlap an engine
puts the contact point then no longer matters."""


def sieve(dimension: int, radii_m: tuple[float, ...]) -> dict[str, Any]:
    """Section ``sand`` of one size, or of two sizes with as many grains of each."""
    if len(radii_m) == 1:
        openings, passing = [2 * radii_m[0] / 1.001, 2 * radii_m[0] * 1.001], [0.0, 1.0]
    else:
        # A class stands at the geometric mean of its bounds.
        small, large = 2 * radii_m[0], 2 * radii_m[1]
        step = math.sqrt(large / small)
        share = small**dimension / (small**dimension + large**dimension)
        openings, passing = [small / step, small * step, large * step], [0.0, share, 1.0]
    points = [
        {"opening_m": o, "passing_fraction": p} for o, p in zip(openings, passing, strict=True)
    ]
    return {
        "size_scale": 1.0,
        "size_classes": len(radii_m),
        "sieve": points,
        "disc_thickness_m": THICKNESS_M,
    }


def mass_kg(dimension: int, radius_m: float = RADIUS_M) -> float:
    """Mass of a grain of the bench: density 2400 kg/m3, discs THICKNESS_M thick."""
    if dimension == 2:
        return 2400.0 * THICKNESS_M * math.pi * radius_m**2
    return 2400.0 * 4 / 3 * math.pi * radius_m**3


def stiffness(dimension: int) -> float:
    """The stiffness, N/m, with which a grain of RADIUS_M swings at OMEGA_RAD_S."""
    return mass_kg(dimension) * OMEGA_RAD_S**2


def inertia_factor(engine: str, dimension: int) -> float:
    """Moment of inertia over m r^2, kappa: LIGGGHTS knows spheres alone."""
    return 0.5 if dimension == 2 and engine != "liggghts" else 0.4


def law(
    dimension: int,
    damping_ratio: float = 0.0,
    friction: float = 0.0,
    arm: float = 0.0,
    normal: float = 1.0,
    tangential: float = 1.0,
) -> dict[str, float]:
    """One contact law; stiffnesses in units of ``stiffness``. All is off unless asked for."""
    unit = stiffness(dimension)
    return {
        "normal_stiffness_n_m": normal * unit,
        "tangential_stiffness_n_m": tangential * unit,
        # LIGGGHTS knows no other rolling stiffness than the tangential one.
        "rolling_stiffness_n_m": tangential * unit,
        "friction": friction,
        "damping_ratio": damping_ratio,
        "rolling_arm_fraction": arm,
    }


def scene(
    engine: str,
    dimension: int,
    /,
    grains: int = 1,
    radii_m: tuple[float, ...] = (RADIUS_M,),
    pair: dict[str, float] | None = None,
    wall: dict[str, float] | None = None,
    step_s: float = 1e-6,
    **changes: Any,
) -> Scenario:
    """Some grains in a wide empty box: no gravity, no damping, smooth undamped contacts.

    LIGGGHTS has spheres alone, so its discs have their moment of inertia.
    """
    base: dict[str, Any] = {
        "dimension": dimension,
        "engine": {"name": engine},
        "gravity_m_s2": 0.0,
        "box": {"width_m": 0.2, "depth_m": 0.2, "height_m": 0.2},
        "sand": sieve(dimension, radii_m),
        "contact": {
            "grain_grain": pair or law(dimension),
            "grain_wall": wall or law(dimension),
            "springs_at_size_scale": None,
        },
        "background_damping": {"form": "none"},
        # Never at rest before the end.
        "fill": {
            "layers": [{"count": grains}],
            # LAMMPS and LIGGGHTS keep grains up to where the layer would be dropped from.
            "drop_height_m": 0.2,
            "settling": {"shortest_s": 99.0, "longest_s": 100.0},
        },
        "time_step": {"step_s": step_s},
        "rest": {"load_every_steps": 1000, "check_every_s": 1000 * step_s},
    }
    if engine == "liggghts" and dimension == 2:
        base["sand"]["disc_inertia"] = "sphere"
    return Scenario.model_validate(merge(base, changes, Origin(), "test"))


def vector(dimension: int, along: float, up: float) -> Array:
    """A vector from its parts along the floor and upwards; in 3D along means (0.6, 0.8, 0)."""
    return np.array([along, up] if dimension == 2 else [0.6 * along, 0.8 * along, up])


def spin(dimension: int, w: float) -> Array:
    """Spin that moves the lowest point of a grain by +r w along the floor; rolling has w = -v/r."""
    return np.array([0.0, 0.0, w] if dimension == 2 else [0.8 * w, -0.6 * w, 0.0])


def along_of(v: Array) -> Array:
    """Part of vectors (n, d) along the floor."""
    return v @ vector(v.shape[1], 1.0, 0.0)


def spin_of(dimension: int, w: Array) -> Array:
    """Rolling part of spins (n, 3)."""
    return w @ spin(dimension, 1.0)


def crossing(time_s: Array, values: Array) -> float:
    """Time at which values first change sign, between two samples."""
    i = int(np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))[0])
    share = values[i] / (values[i] - values[i + 1])
    return float(time_s[i] + share * (time_s[i + 1] - time_s[i]))


class Bench:
    """A session of one scenario in a folder of its own."""

    def __init__(self, scenario: Scenario) -> None:
        problem = engine_problem(scenario)
        if problem is not None:
            raise RefusedCase(problem.key, problem.valid)
        self.scenario = scenario
        self._folder = tempfile.TemporaryDirectory(prefix="bench_")
        self.folder = Path(self._folder.name)
        self.program = build_program(scenario)
        engine = engine_of(scenario)
        engine.write_deck(self.program, {}, self.folder, "bench", "verification")
        self.session: Session = engine.open_session(
            self.program, self.folder, self.folder / "engine.log"
        )
        self.session.insert_layer(1)

    def __enter__(self) -> Bench:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.session.close()
        self._folder.cleanup()

    @property
    def radius_m(self) -> Array:
        """Radii in the order of ids."""
        return self.state().radius_m

    def by_size(self) -> tuple[list[int], list[int]]:
        """Rows of the small and of the large grains."""
        radius = self.radius_m
        small = radius < radius.mean()
        return np.flatnonzero(small).tolist(), np.flatnonzero(~small).tolist()

    def place(
        self, position_m: Any, velocity_m_s: Any = None, spin_rad_s: Any = None, stage: int = 0
    ) -> None:
        """Put all grains in their places, which must be (n, d), and begin a stage."""
        position = np.array(position_m, dtype=float)
        velocity = np.zeros_like(position) if velocity_m_s is None else np.array(velocity_m_s)
        spins = np.zeros((len(position), 3)) if spin_rad_s is None else np.array(spin_rad_s)
        self.session.set_state(position, velocity.astype(float), spins.astype(float))
        self.session.start_stage(self.program.stages[stage])

    def advance(self, duration_s: float) -> Snapshot:
        """Compute for a while, and give the state then."""
        self.session.advance(duration_s)
        return self.state()

    def state(self) -> Snapshot:
        return self.session.snapshot()
