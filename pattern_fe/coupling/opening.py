"""Open a scene of sand and pattern on the scenario's engine."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from sandmould.bad_input import BadInputError, Problem
from sandmould.engines.program import Program, StepCounts
from sandmould.engines.registry import engine_of
from sandmould.engines.session import Session
from sandmould.pattern_fe.coupling.explicit_foam import ExplicitFoam
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.free_body import FreeBody
from sandmould.pattern_fe.coupling.schemes import explicit_foam, in_step_foam
from sandmould.pattern_fe.coupling.selective_mass import SelectiveMass
from sandmould.pattern_fe.coupling.session import CoupledSession
from sandmould.pattern_fe.coupling.stepped_sessions import InStepSession, MonolithicSession
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.scene import pattern_of, surroundings_of
from sandmould.scenario.pattern import PatternDrawing
from sandmould.scenario.scenario import Scenario

MASSES_LOG = "pattern.log"


def open_coupled(
    program: Program, folder: Path, log: Path, checkpoint: Path | None = None
) -> Session:
    """Open a coupled session on a rendered deck, afresh or from a checkpoint.

    ``program``: of a scenario whose pattern is among its obstacles. ``folder``: where the deck
    lies. ``log``: the engine's log; tables of the pattern lie beside it.
    """
    scenario = program.scenario
    config = scenario.pattern
    assert config is not None
    name, loop, counts = config.name, config.loop, StepCounts.of(scenario)
    pattern, work, tolerance = pattern_of(scenario), log.parent, scenario.rest.load_tolerance
    _refuse_other_mesh(scenario, pattern)
    open_session = engine_of(scenario).open_session
    large = config.statics == "large"
    around = surroundings_of(scenario, pattern)
    if loop.scheme == "in_step":
        sand = open_session(program, folder, log, checkpoint)
        foam = in_step_foam(scenario, pattern)
        (work / MASSES_LOG).write_text(_selective_masses(foam.mass), encoding="utf-8")
        held = FreeBody(pattern, foam) if pattern.is_free else FoamBody(pattern, False, around)
        return InStepSession(sand, foam, held, name, work, checkpoint, tolerance)
    body = FoamBody(pattern, large, around)
    if loop.scheme == "monolithic":
        explicit = explicit_foam(scenario, pattern)
        sand = open_session(program, folder, log, checkpoint)
        with log.open("a", encoding="utf-8") as lines:
            lines.write(_explicit_masses(explicit))
        limit_m = loop.largest_displacement_m
        return MonolithicSession(
            sand, explicit, body, name, limit_m, counts, work, checkpoint, tolerance
        )
    sand = open_session(program, folder, log, checkpoint)
    return CoupledSession(sand, body, name, loop, counts, work, checkpoint, tolerance, around)


def _refuse_other_mesh(scenario: Scenario, pattern: Pattern) -> None:
    """Refuse a drawn pattern that is not meshed here as where the study was planned."""
    config = scenario.pattern
    assert config is not None
    drawn = [b.shape.file for b in config.bodies if isinstance(b.shape, PatternDrawing)]
    if not drawn:
        return
    planned_m = next(m.vertices_m for m in scenario.scene.meshes if m.name == config.name)
    here_m = pattern.surface.outer.vertices_m
    if planned_m.shape != here_m.shape or not np.allclose(planned_m, here_m, rtol=0.0, atol=1e-9):
        valid = "a drawing that Gmsh meshes here as where the study was planned: the same version"
        raise BadInputError([Problem("pattern.shape.file", ", ".join(drawn), valid)])


def _explicit_masses(foam: ExplicitFoam) -> str:
    """How the pattern's masses are scaled in the monolithic scheme."""
    return (
        f"pattern in every step: masses times {foam.mass_scale:.4g}, {foam.sub_steps} steps in one "
        f"of the grains, first frequency {foam.first_hz:.4g} Hz\n"
    )


def _selective_masses(mass: SelectiveMass) -> str:
    """How the pattern's masses are scaled in step, and what is left of its first frequency."""
    return (
        f"pattern in every step: own masses times {mass.scale:.4g} and stiffness over the square "
        f"of 2 pi {mass.omega_1_s / (2.0 * math.pi):.4g} Hz, one step in one of the grains, first "
        f"frequency {mass.first_hz:.4g} Hz ({mass.own_first_hz:.4g} Hz with its own masses)\n"
    )
