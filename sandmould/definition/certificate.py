"""Which controls a study runs round its optimum, and what keeps it from running them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal

from pydantic import Field

from sandmould.bad_input import Problem
from sandmould.definition.sweep import Sweep, points
from sandmould.scenario.box import Tube
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.config import SandWaveSpeed, fewest_points

Control = Literal[
    "hold", "springs", "bed_depth", "grain_scale", "tube_length", "time_step", "engine",
    "spectrum",
]  # fmt: skip

RATIO = 1.41
"""Between neighbouring frequencies of the controls."""
SEEDS = 4
"""Of every control."""


class RobustnessChecks(Section):
    """Controls at frequencies round the optimum, which tell the sand from the model."""

    controls: tuple[Control, ...] = quantity(
        (),
        "hold: the other amplitudes held constant. springs: springs of bed and walls x 0.25 and "
        "4, with each amplitude held, at seven frequencies. bed_depth: x 0.5 and 2. grain_scale: "
        "x 0.75 and 1.5. tube_length: x 0.6 and 1.5. time_step: x 0.5. engine: lammps, or "
        "reference in a study on lammps. spectrum: the bed's own frequencies, from a small shake. "
        "Each is computed with four seeds at the best frequency, 1.41 times it and 1/1.41 of it.",
        source=ARGUED,
    )
    sand_wave_speed: SandWaveSpeed | None = Field(
        None,
        description="Speed of compression waves in the real sand, with its source. An optimum that "
        "follows the springs is recommended in Hz only with the spread of this speed.",
    )


def frequency_key(sweep: Sweep) -> str:
    """The one swept key, a frequency; empty where a sweep is of anything else."""
    return frequency_among(sweep.swept)


def frequency_among(keys: Sequence[str]) -> str:
    """The one of some swept keys, a frequency; empty where there are several, or another."""
    (key,) = keys if len(keys) == 1 else ("",)
    return key if key.endswith(".frequency_hz") else ""


def round_best_hz(best_hz: float) -> tuple[float, ...]:
    """Frequencies of the controls: the best in the middle."""
    return tuple(float(f"{best_hz * by:.3g}") for by in (1 / RATIO, 1.0, RATIO))


def spanned_hz(certified_hz: Sequence[float]) -> dict[int, float]:
    """All frequencies that a control may be run at, by their steps from the best.

    ``certified_hz``, sequence of float, Hz: as ``round_best_hz`` gives them.

    Returns
    -------
    dict of int to float, Hz
        From -3 to 3; equal ratios outside those given.
    """
    low, best, high = certified_hz
    ratio = math.sqrt(high / low)
    outside = {step: float(f"{best * ratio**step:.3g}") for step in (-3, -2, 2, 3)}
    return dict(sorted({-1: low, 0: best, 1: high, **outside}.items()))


def provisional_hz(checks: RobustnessChecks, sweep: Sweep, scenario: Section) -> tuple[float, ...]:
    """Frequencies for a trial of the controls before the best is known; none without controls."""
    if not checks.controls:
        return ()
    swept = sorted(float(p[frequency_key(sweep)]) for p in points(sweep, scenario))
    return round_best_hz(swept[len(swept) // 2])


def problems(
    checks: RobustnessChecks, sweep: Sweep, scenario: Scenario, better: str
) -> Iterator[Problem]:
    """List what is wrong with the robustness checks of a study whose sweep has no problems."""
    if not checks.controls:
        return
    if not frequency_key(sweep):
        valid = "one swept key, a frequency such as vibration.0.frequency_hz"
        yield Problem("certificate.controls", sweep.swept, f"absent, or a study with {valid}")
    elif sweep.number_of_points < fewest_points(1):
        valid = f"at least {fewest_points(1)} frequencies to find the best among"
        yield Problem("sweep", f"{sweep.number_of_points} points", valid)
    if better == "neither":
        yield Problem(
            "certificate.controls", list(checks.controls), "absent: nothing is to be best"
        )
    for i, control in enumerate(checks.controls):
        where = f"certificate.controls.{i}"
        if control in checks.controls[:i]:
            yield Problem(where, control, "each control once")
        if control == "tube_length" and not any(isinstance(o, Tube) for o in scenario.obstacles):
            yield Problem(where, control, "a control of what the scene has: there is no tube")
