"""What each control changes in the scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sandmould.definition.certificate import RobustnessChecks
from sandmould.engines.registry import engine_of
from sandmould.scenario.box import Tube
from sandmould.scenario.scenario import FULL_OVERLAP, Scenario
from sandmould.scenario.vibration import VibrationStage
from sandmould.statistics.config import SPRINGS, ControlCase
from sandmould.statistics.grain_check import FACTOR

SPRING_FACTORS = (0.25, 4.0)
"""Of all springs: a wave speed and a resonance go as the root, by 2 either way."""
_SPAN = (-3, -2, -1, 0, 1, 2, 3)
"""Steps of the springs' curves: where a resonance goes, and one more beyond for its other limb."""
SHAKEN_HZ = tuple(float(f"{f:.3g}") for f in np.geomspace(12.0, 400.0, 16))
"""Frequencies of the small shake."""
SHAKE_G = 0.05
SHAKE_PERIODS = 8
SHAKE_LEAST_S = 0.06
WINDOWS_A_PERIOD = 8
Change = Callable[[Scenario], Scenario]


@dataclass(frozen=True)
class Case(ControlCase):
    """One case of a control with what it changes in the scene."""

    change: Change
    steps: tuple[int, ...] = (-1, 0, 1)
    """Which frequencies are run, by their steps from the best; see ``spanned_hz``."""


def cases(checks: RobustnessChecks, scenario: Scenario, best_hz: float) -> Iterator[Case]:
    """Cases of all controls of a study.

    ``best_hz``: the middle frequency, where every amplitude that is held is that of the sweep.
    """
    for control in checks.controls:
        if control == "hold":
            # At the middle frequency nothing differs from a sweep whose motion is laid down.
            steps = (-1, 0, 1) if scenario.vibrations[0].hold == "unbalance" else (-1, 1)
            for hold in _other_holds(scenario):
                yield Case(control, hold, None, partial(_holding, hold, best_hz), steps)
        elif control == SPRINGS:
            yield from _of_springs(scenario, best_hz)
        elif control in BY_FACTOR:
            factors, changed = BY_FACTOR[control]
            for factor in factors:
                yield Case(control, f"x{factor:g}", factor, partial(changed, factor))
        elif control == "engine":
            engine = "reference" if scenario.engine.name == "lammps" else "lammps"
            yield Case(control, engine, None, partial(_on, engine))
        else:
            yield Case(control, "small shake", None, _shaken, (0,))


def swept_steps(checks: RobustnessChecks) -> tuple[int, ...]:
    """Which frequencies the sweep itself is run at beside the controls."""
    return _SPAN if SPRINGS in checks.controls else Case.steps


def _other_holds(scenario: Scenario) -> list[str]:
    holds = {"acceleration", "velocity", "displacement"}
    return sorted(holds - {scenario.vibrations[0].hold})


def _of_springs(scenario: Scenario, best_hz: float) -> Iterator[Case]:
    """Softer and stiffer springs with each amplitude held, over the whole span.

    At the best frequency all holds are one motion, which the study's own stands for where it is
    laid down.
    """
    is_free = scenario.vibrations[0].hold == "unbalance"
    beside = _SPAN if is_free else tuple(step for step in _SPAN if step)
    for factor in SPRING_FACTORS:
        stiffer = partial(_stiffer, factor)
        own = scenario.vibrations[0].hold
        yield Case(SPRINGS, f"x{factor:g} {own}", factor, stiffer, _SPAN, hold=own)
        for hold in _other_holds(scenario):
            change = partial(_both, stiffer, partial(_holding, hold, best_hz))
            yield Case(SPRINGS, f"x{factor:g} {hold}", factor, change, beside, hold=hold)


def _both(first: Change, second: Change, scenario: Scenario) -> Scenario:
    return second(first(scenario))


def _holding(hold: str, best_hz: float, scenario: Scenario) -> Scenario:
    stage = scenario.vibrations[0]
    at_best = stage.model_copy(update={"frequency_hz": best_hz})
    # The same motion at the best frequency, whatever is held from there; that of the empty
    # table where the sweep has an unbalance.
    new = VibrationStage(
        **stage.model_dump(
            exclude={"hold", "unbalance", "acceleration_g", "velocity_m_s", "displacement_m",
                     "reference_frequency_hz"}
        ),
        hold=hold,
        displacement_m=at_best.amplitude_m,
        reference_frequency_hz=best_hz,
    )  # fmt: skip
    place = scenario.vibration.index(stage)
    stages = (*scenario.vibration[:place], new, *scenario.vibration[place + 1 :])
    return scenario.model_copy(update={"vibration": stages})


def _stiffer(factor: float, scenario: Scenario) -> Scenario:
    """All springs, so that k_n/b changes and nothing between them.

    A grain of the same speed presses a spring in by the root of one over its stiffness (half of
    m v^2 is half of k x^2). The guard allows soft ones so much more, since what it stops are
    scenes that run away.
    """
    allowed = scenario.guard.largest_overlap_fraction * max(1.0, factor**-0.5)
    overlap = {"largest_overlap_fraction": min(allowed, FULL_OVERLAP)}
    guard = scenario.guard.model_copy(update=overlap)
    contact = scenario.contact.stiffer(factor)
    return scenario.model_copy(update={"contact": contact, "guard": guard})


def _deeper(factor: float, scenario: Scenario) -> Scenario:
    layers = tuple(
        layer.model_copy(
            update={
                key: round(factor * value) if key == "count" else factor * value
                for key in ("height_m", "mass_kg", "count")
                for value in [getattr(layer, key)]
                if value is not None
            }
        )
        for layer in scenario.fill.layers
    )
    fill = scenario.fill.model_copy(update={"layers": layers})
    height_m = scenario.box.height_m * max(1.0, factor)
    box = scenario.box.model_copy(update={"height_m": height_m})
    return scenario.model_copy(update={"fill": fill, "box": box})


def _coarser(factor: float, scenario: Scenario) -> Scenario:
    size_scale = factor * scenario.sand.size_scale
    sand = scenario.sand.model_copy(update={"size_scale": size_scale})
    # As much sand, where it is given by the number of its grains.
    fewer = factor**-scenario.dimension
    layers = tuple(
        layer.model_copy(update={"count": round(fewer * layer.count)}) if layer.count else layer
        for layer in scenario.fill.layers
    )
    fill = scenario.fill.model_copy(update={"layers": layers})
    return scenario.model_copy(update={"sand": sand, "fill": fill})


def _longer(factor: float, scenario: Scenario) -> Scenario:
    """All tubes, their closed ends where they are."""

    def changed(obstacle: Any) -> Any:
        if not isinstance(obstacle, Tube):
            return obstacle
        length_m = factor * obstacle.length_m
        closed_right = obstacle.closed_end == "right"
        left_m = obstacle.right_end_x_m - length_m if closed_right else obstacle.left_end_x_m
        return obstacle.model_copy(update={"length_m": length_m, "left_end_x_m": left_m})

    return scenario.model_copy(update={"obstacles": tuple(map(changed, scenario.obstacles))})


def _finer(factor: float, scenario: Scenario) -> Scenario:
    step = scenario.time_step
    finer = {"fraction": factor * step.fraction}
    if step.bed_fraction is not None:
        finer["bed_fraction"] = factor * step.bed_fraction
    return scenario.model_copy(update={"time_step": step.model_copy(update=finer)})


COARSER = Case("grain_scale", f"x{FACTOR:g}", FACTOR, partial(_coarser, FACTOR))
"""Of a study's grain check."""
BY_FACTOR: dict[str, tuple[tuple[float, ...], Callable[[float, Scenario], Scenario]]] = {
    "bed_depth": ((0.5, 2.0), _deeper),
    "grain_scale": ((0.75, FACTOR), _coarser),
    "tube_length": ((0.6, 1.5), _longer),
    "time_step": ((0.5,), _finer),
}
"""Controls that multiply a property of the scene: by which factors, and how."""


def _on(engine: str, scenario: Scenario) -> Scenario:
    return scenario.model_copy(
        update={"engine": scenario.engine.model_copy(update={"name": engine})}
    )


def _shaken(scenario: Scenario) -> Scenario:
    """A shake too weak to move grains, one frequency after the other."""
    direction = scenario.vibrations[0].direction
    stages = tuple(
        VibrationStage(
            direction=direction,
            frequency_hz=f,
            acceleration_g=SHAKE_G,
            duration_s=max(SHAKE_PERIODS / f, SHAKE_LEAST_S),
        )
        for f in SHAKEN_HZ
    )
    # what is read of it is the load on the floor while it is shaken
    changed = {"vibration": stages, "measure_at_rest": False}
    return scenario.model_copy(update=changed | _often(scenario))


def _often(scenario: Scenario) -> dict[str, Any]:
    """Loads, which are means over checks, often enough for the highest frequency.

    The fill keeps its checks where the engine can change them, and is shared with the sweep.
    """
    window_s = float(f"{1.0 / (WINDOWS_A_PERIOD * SHAKEN_HZ[-1]):.2g}")
    rest = scenario.rest
    if engine_of(scenario).CAPABILITIES.changes_checks:
        shaken_s = min(window_s, rest.check_every_s)
        return {"rest": rest.model_copy(update={"shaken_check_every_s": shaken_s})}
    # As many of the shorter checks as make up the same time.
    checks = max(rest.checks, round(rest.checks * rest.check_every_s / window_s))
    rest = rest.model_copy(update={"check_every_s": window_s, "checks": checks})
    record = scenario.record.model_copy(update={"series_every_s": window_s})
    return {"rest": rest, "record": record}
