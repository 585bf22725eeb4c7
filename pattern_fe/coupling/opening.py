"""Open a scene of sand and pattern on the scenario's engine."""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

from pattern_fe.coupling.body import ElasticBody
from pattern_fe.coupling.files_body import EXCHANGE, FilesBody
from pattern_fe.coupling.foam_body import FoamBody
from pattern_fe.coupling.in_step import InStepSession
from pattern_fe.coupling.monolithic_session import JudgeSession
from pattern_fe.coupling.schemes import explicit_foam, in_step_foam
from pattern_fe.coupling.selective_mass import SelectiveMass
from pattern_fe.coupling.session import CoupledSession
from pattern_fe.scene import pattern_of
from sandmould.engines.program import Program
from sandmould.engines.registry import engine_of
from sandmould.engines.session import Session
from sandmould.engines.step_counts import StepCounts

MASSES_LOG = "pattern.log"


def open_coupled(
    program: Program, folder: Path, log: Path, checkpoint: Path | None = None
) -> Session:
    """Open a coupled session on a rendered deck, afresh or from a checkpoint.

    Parameters
    ----------
    program : Program
        Of a scenario whose pattern is among its obstacles.
    folder : Path
        Where the deck lies.
    log : Path
        The engine's log; tables of the pattern lie beside it.
    checkpoint : Path, optional
    """
    scenario = program.scenario
    told = scenario.pattern
    assert told is not None
    if told.loop.scheme == "monolithic":
        return cast(Session, _open_judge(program, log, checkpoint))
    pattern = pattern_of(scenario)
    body: ElasticBody = FoamBody(pattern, told.statics == "large")
    inner = engine_of(scenario).open_session(program, folder, log, checkpoint)
    if told.loop.exchange == "files":
        body = FilesBody(pattern, told.statics == "large", folder / EXCHANGE, inner)
    if told.loop.scheme == "in_step":
        foam = in_step_foam(scenario, pattern)
        (log.parent / MASSES_LOG).write_text(_told_masses(foam.mass), encoding="utf-8")
        in_step = InStepSession(inner, foam, body, told.name, log.parent, checkpoint)
        return cast(Session, in_step)
    counts = StepCounts.of(scenario)
    session = CoupledSession(inner, body, told.name, told.loop, counts, log.parent, checkpoint)
    return cast(Session, session)


def _told_masses(mass: SelectiveMass) -> str:
    """How the pattern's masses are scaled, and what is left of its first frequency."""
    return (
        f"pattern in every step: own masses times {mass.scale:.4g} and stiffness over the square "
        f"of 2 pi {mass.omega_1_s / (2.0 * math.pi):.4g} Hz, one step in one of the grains, first "
        f"frequency {mass.first_hz:.4g} Hz ({mass.own_first_hz:.4g} Hz with its own masses)\n"
    )


def _open_judge(program: Program, log: Path, checkpoint: Path | None) -> JudgeSession:
    """Open the judge; the log says how the pattern's masses are scaled."""
    scenario = program.scenario
    told = scenario.pattern
    assert told is not None
    foam = explicit_foam(scenario, pattern_of(scenario))
    limit_m = told.loop.largest_displacement_m
    session = JudgeSession(program, foam, told.name, limit_m, log.parent, checkpoint)
    log.write_text(
        f"reference solver, kernels {session.version}\n"
        f"pattern in every step: masses times {foam.mass_scale:.4g}, {foam.sub_steps} steps in one "
        f"of the grains, first frequency {foam.first_hz:.4g} Hz\n",
        encoding="utf-8",
    )
    return session
