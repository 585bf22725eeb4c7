"""The exact critical step of the grains of a snapshot, whatever engine computed it."""

from __future__ import annotations

from sandmould.dem.critical_step import active_contacts, whole_step
from sandmould.engines.program import Program
from sandmould.engines.reference.model import grains_at, solver_of
from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.stages import is_filling


def exact_limit_s(program: Program, snapshot: Snapshot) -> float:
    """Find the step up to which the contacts of a moment stay bounded.

    Parameters
    ----------
    program : Program
        Of a scene without a pattern.
    snapshot : Snapshot

    Returns
    -------
    float, s
        Limit of the whole system with its dashpots, eq. (42); infinite where nothing touches. All
        contacts count as sticking, and none opens: the stiffest case.
    """
    scenario = program.scenario
    solver = solver_of(scenario, program.stages[0], scenario.step_s)
    grains = grains_at(scenario, snapshot)
    solver.add(grains)
    if scenario.discharge is not None and not is_filling(snapshot.stage):
        solver.remove_surface(scenario.discharge.gate)
    solver.place(grains.position, grains.velocity, grains.spin)
    return whole_step(active_contacts(solver)).damped_s
