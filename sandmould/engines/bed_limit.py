"""The exact limit of a bed that another engine computes, by our own solver's contacts."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sandmould.dem.critical_step import active_contacts, whole_step
from sandmould.dem.grains import Grains
from sandmould.engines.guard import grain_masses_kg
from sandmould.engines.program import Stage
from sandmould.engines.reference.model import solver_of
from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.time_step import inertia_factor


def limit_of_snapshot_s(
    scenario: Scenario, stage: Stage, snapshot: Snapshot, opened: Iterable[str]
) -> float:
    """Find the step up to which the contacts of a snapshot stay bounded.

    Grains and surfaces that overlap touch. What they remember does not count: all contacts stick.

    ``opened``: plates that were taken away.

    See ``sandmould.engines.session.Session.exact_limit_s``.
    """
    d, n = scenario.dimension, len(snapshot.id)
    still, unturned = np.zeros((n, d)), np.zeros((n, 1 if d == 2 else 3))
    mass = grain_masses_kg(scenario, snapshot)
    factor = inertia_factor(scenario.sand, scenario.laws, scenario.time_step, d)
    solver = solver_of(scenario, stage, scenario.step_s)
    solver.add(
        Grains.of(
            snapshot.id,
            snapshot.position_m,
            still,
            unturned,
            snapshot.radius_m,
            mass,
            factor * mass * snapshot.radius_m**2,
        )
    )
    for gate in opened:
        solver.remove_surface(gate)
    solver.place(snapshot.position_m, still, unturned)
    of_step_s = scenario.step_s if scenario.has_step_of_bed else None
    return whole_step(active_contacts(solver), of_step_s).damped_s
