"""The moving box in both frames, eqs. (57) and (58), and the scaling of stiffness by thickness."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from tests.verification.cases.bench import OMEGA_RAD_S, RADIUS_M, Array, Bench, law, scene, vector
from tests.verification.cases.case import Measured, case

GRAVITY = 9.80665
_FRAMES = "1e-10: round-off of the second difference of 1e-4 m over dt^2"


def _shaken(
    engine: str, dimension: int, frame: str, direction: Any, ramp_s: float, **changes: Any
) -> tuple[Bench, Any]:
    stage = {
        "acceleration_g": 3.0,
        "frequency_hz": 50.0,
        "duration_s": 0.06,
        "direction": direction,
        "ramp_s": ramp_s,
    }
    given = scene(
        engine,
        dimension,
        wall=law(dimension, 0.5, 0.35, 0.1),
        step_s=2e-5,
        frame=frame,
        vibration=[stage],
        measure_at_rest=False,
        # no setup within the case: engines forget the velocity of moving walls there
        rest={"load_every_steps": 50, "check_every_s": 5e-3},
        **changes,
    )
    return Bench(given), given.vibration[0]


@case("(57), (58)", _FRAMES)
def both_frames(engine: str, dimension: int) -> Iterator[Measured]:
    """A rough damped grain thrown obliquely by the floor: relative to the box alike in both frames.

    The body force of (58) is the second difference of the walls' own motion. Contacts feel the
    walls' velocity of the half step. So one grain moves alike to round-off.
    """
    direction = [0.6, 0.8] if dimension == 2 else [0.48, 0.36, 0.8]
    yield _frames_apart(engine, dimension, direction, 0.0)


@case("(57), (58)", _FRAMES, dimensions=(2,), engines=("lammps", "reference"))
def both_frames_with_a_ramp(engine: str, dimension: int) -> Iterator[Measured]:
    """The same shaken vertically with a ramp; LIGGGHTS's is in ``test_liggghts_session.py``."""
    yield _frames_apart(engine, dimension, "vertical", 0.02)


def _frames_apart(engine: str, dimension: int, direction: Any, ramp_s: float) -> Measured:
    tracks = []
    for frame in ("box", "laboratory"):
        bench, _ = _shaken(engine, dimension, frame, direction, ramp_s, gravity_m_s2=GRAVITY)
        with bench:
            sag = GRAVITY / OMEGA_RAD_S**2
            bench.place([vector(dimension, 0.05, RADIUS_M - sag)], stage=-1)
            track = []
            while not bench.session.stage_over:
                now = bench.advance(2e-3)
                track.append([*now.position_m[0], *now.velocity_m_s[0]])
        tracks.append(np.array(track))
    box, laboratory = tracks
    assert np.ptp(box[:, dimension - 1]) > 4e-4, "the grain was not thrown"
    apart = float(np.abs(box - laboratory).max())
    return Measured("box frame against laboratory frame", apart, 0.0, 1e-10, "m, m/s")


@case("(57), (58)", "1e-12: round-off", frame=["box", "laboratory"])
def free_grain_in_a_moving_box(engine: str, dimension: int, frame: str) -> Iterator[Measured]:
    """Without gravity a free grain stays where it was while the box moves by s(t) = a sin(omega t).

    Relative to the box it is at x_0 - s(t) e; the motion begins one step into the stage.
    """
    direction = [0.6, 0.8] if dimension == 2 else [0.48, 0.36, 0.8]
    bench, vibration = _shaken(engine, dimension, frame, direction, 0.0)
    start = vector(dimension, 0.05, 0.05)
    worst: Array = np.zeros(1)
    amplitude = vibration.amplitude_m
    with bench:
        bench.place([start], stage=-1)
        for _ in range(10):
            now = bench.advance(1.7e-3)
            t = now.time_s - bench.session.step_s
            s = amplitude * np.sin(vibration.angular_frequency_rad_s * t)
            course = start - s * np.array(direction)
            worst = np.maximum(worst, np.abs(now.position_m[0] - course).max())
    yield Measured(f"off its course, {frame} frame", float(worst[0]), 0.0, 1e-12, "m")


@case("(16)-(33)", "0: all is scaled by a power of two, which changes no digit", dimensions=(2,))
def stiffness_over_thickness(engine: str, dimension: int) -> Iterator[Measured]:
    """In 2D, four times the stiffness of discs four times as thick changes nothing.

    Forces and masses are then four times as large. Six discs of two sizes fall, meet each other and
    the floor, with damping, friction and rolling resistance.
    """
    radii = (0.8 * RADIUS_M, 1.2 * RADIUS_M)
    found = []
    for factor in (1.0, 4.0):
        contact_law = {
            name: value * factor if name.endswith("_n_m") else value
            for name, value in law(dimension, 0.3, 0.5, 0.1).items()
        }
        given = scene(
            engine,
            dimension,
            6,
            radii,
            contact_law,
            contact_law,
            1e-5,
            gravity_m_s2=GRAVITY,
            sand={"disc_thickness_m": 0.1 * factor},
        )
        with Bench(given) as bench:
            rows = np.arange(6)
            place = np.column_stack([0.05 + 0.0012 * (rows % 3), 0.003 + 0.0055 * rows])
            velocity = np.column_stack([0.02 * (rows - 2.5), np.full(6, -0.1)])
            bench.place(place, velocity)
            now = bench.advance(0.1)
            found.append(np.concatenate([now.position_m.ravel(), now.spin_rad_s[:, 2]]))
    assert np.abs(found[0][-6:]).max() > 1.0, "nothing rolled"
    yield Measured("change", float(np.abs(found[0] - found[1]).max()), 0.0, 0.0, "m, rad/s")
