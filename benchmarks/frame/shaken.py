"""A bed of the reference engine, filled, shaken and measured at rest, without a run's files."""

from __future__ import annotations

from sandmould.engines.program import build_program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.scenario import Scenario


def shaken(scenario: Scenario) -> Snapshot:
    """Compute all stages of a scenario and give its grains in the end.

    Raises
    ------
    RuntimeError
        Where the sand does not come to rest.
    """
    program = build_program(scenario)
    session = ReferenceSession(program)
    for stage in program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
        session.end_stage()
    if not session.at_rest:
        raise RuntimeError("the sand did not come to rest")
    return session.snapshot()
