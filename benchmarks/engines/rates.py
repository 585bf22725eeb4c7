"""Grain-steps per second of the three engines on the same settled bed, on one core."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from functools import partial
from typing import Any

import numpy as np

from benchmarks.engines.beds import PERIOD_S, Bed, opened, scene
from benchmarks.engines.timing import Extent, interleaved, ratio, seconds, spread, steps_lasting
from sandmould.engines.deck_lines import skin_m
from sandmould.engines.neighbours import touching_pairs
from sandmould.engines.program import build_program
from sandmould.engines.reference.model import SKIN_OVER_DIAMETER
from sandmould.engines.registry import engine_problem
from sandmould.engines.session import Session
from sandmould.scenario.scenario import Scenario

ENGINES = ("reference", "lammps", "liggghts")
TARGETS = {2: {"lammps": 6.0}, 3: {"lammps": 4.0, "liggghts": 2.5}}
"""Least ratio of the reference's rate to another engine's, on settled beds."""


def _skin_m(scenario: Scenario) -> float:
    """Neighbour skin that an engine's deck takes by itself."""
    if scenario.engine.name != "reference":
        return skin_m(scenario)
    classes = scenario.sand.classes(scenario.dimension)
    return SKIN_OVER_DIAMETER * sum(c.diameter_m * c.count_fraction for c in classes)


def _per_grain(session: Session, gap_m: float) -> float:
    """Pairs of grains nearer than a gap, over grains."""
    state = session.snapshot()
    pairs = touching_pairs(state.position_m, state.radius_m, gap_m)
    return sum(len(first) for first, _, _ in pairs) / session.grains


def _advance(session: Session, steps: int) -> None:
    if steps > 0:
        session.advance(steps * session.step_s)


def _steps_of_turn(sessions: Iterable[Session], block_s: float, shaken: bool) -> int:
    """Steps of a turn, the same for all engines, and all brought to the same step before it.

    A turn at rest takes the slowest engine half as long again as a block; of shaking, a period.
    """
    sessions = list(sessions)
    if shaken:
        steps = [round(PERIOD_S / sessions[0].step_s)]
    else:
        steps = [steps_lasting(partial(_advance, session), block_s) for session in sessions]
    begun = max(steps[0] if shaken else session.steps for session in sessions)
    for session in sessions:
        _advance(session, begun - session.steps)
    return steps[0] if shaken else round(1.5 * min(steps))


def _rate(session: Session, steps: int) -> float:
    """Grain-steps per second of a turn."""
    return session.grains * steps / seconds(lambda: _advance(session, steps))


def _begin(session: Session, scenario: Scenario, bed: Bed, shaken: bool) -> None:
    session.set_state(bed.position_m, bed.velocity_m_s, bed.spin_rad_s)
    session.start_stage(build_program(scenario).stages[1 if shaken else 0])


def _ratios(rates: dict[str, list[float]]) -> dict[str, dict[str, float]]:
    """Rate of the reference over those of the others."""
    return {
        name: ratio(rates["reference"], rate) for name, rate in rates.items() if name != "reference"
    }


def measure_bed(bed: Bed, extent: Extent, shaken: bool = False) -> dict[str, Any]:
    """Rates of all engines that are installed, from one state."""
    rows: dict[str, dict[str, Any]] = {}
    missing: dict[str, str] = {}
    sessions: dict[str, Session] = {}
    with ExitStack() as stack:
        for name in ENGINES:
            scenario = scene(bed.dimension, bed.grains, bed.width_m, bed.depth_m, name)
            problem = engine_problem(scenario)
            if problem is not None:
                missing[name] = str(problem)
                continue
            session = sessions[name] = stack.enter_context(opened(scenario))
            _begin(session, scenario, bed, shaken)
            skin = _skin_m(scenario)
            rows[name] = {"skin_m": skin, "listed_per_grain": _per_grain(session, skin)}
        steps = _steps_of_turn(sessions.values(), extent.block_s, shaken)
        blocks = {name: partial(_rate, session, steps) for name, session in sessions.items()}
        rates = interleaved(blocks, (extent.rounds + 1) // 2 if shaken else extent.rounds)
        for name, session in sessions.items():
            moved = np.linalg.norm(session.snapshot().position_m - bed.position_m, axis=1)
            rows[name] |= {
                "grain_steps_per_s": spread(rates[name]),
                "contacts_per_grain": _per_grain(session, 0.0),
                "farthest_moved_m": float(moved.max()),
            }
    return {
        "bed": bed.name + (", shaken at 50 Hz and 1.5 g" if shaken else ""),
        "dimension": bed.dimension,
        "grains": bed.grains,
        "settled": not shaken,
        "step_s": scenario.step_s,
        "steps": session.steps,
        "engines": rows,
        "missing": missing,
        "reference_over": _ratios(rates),
    }
