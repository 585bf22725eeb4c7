"""What each scheme of the coupling asks of a scenario, told before anything starts."""

from __future__ import annotations

from pattern_fe.coupling.explicit_foam import ContactBound, ExplicitFoam
from pattern_fe.pattern import Pattern
from sandmould.scenario.bad_input import BadInputError, Problem
from sandmould.scenario.scenario import Scenario

REFERENCE_ALONE = ("measured", "monolithic")
"""Schemes that need what one engine has: to go back to a kept state, and to stop in every step."""
ABOVE_VIBRATION = 5.0
"""Least ratio of the pattern's first frequency to that of the box, for an answer as if at rest."""


def refuse_scheme(scenario: Scenario, pattern: Pattern) -> None:
    """Refuse a scheme that cannot go with the rest of the scenario.

    Raises
    ------
    BadInputError
    """
    assert scenario.pattern is not None
    loop, engine = scenario.pattern.loop, scenario.engine.name
    scheme = loop.scheme
    if engine == "liggghts":
        valid = "lammps or reference in a scene with a pattern: its meshes do not bend"
        raise BadInputError([Problem("engine.name", engine, valid)])
    if scenario.discharge is not None:
        # Loads on vertices are forgotten when a gate is taken away.
        valid = "absent in a scene with a pattern"
        raise BadInputError([Problem("discharge.gate", scenario.discharge.gate, valid)])
    if loop.repeats and engine != "reference":
        raise _bad("repeats", loop.repeats, f"0 on engine {engine}, or engine reference")
    if scheme in REFERENCE_ALONE and engine != "reference":
        raise _bad("scheme", scheme, f"another scheme on engine {engine}, or engine reference")
    if scheme == "monolithic":
        explicit_foam(scenario, pattern)


def explicit_foam(scenario: Scenario, pattern: Pattern) -> ExplicitFoam:
    """The pattern of the monolithic scheme, at rest.

    Raises
    ------
    BadInputError
        With large displacements, with masses too small for the contacts, or so large that the
        pattern swings with the box.
    """
    told = scenario.pattern
    assert told is not None
    loop = told.loop
    if told.statics == "large":
        raise _bad("scheme", loop.scheme, "a staggered scheme with pattern.statics = large")
    bound = ContactBound.of(scenario, pattern)
    try:
        foam = ExplicitFoam(pattern, scenario.step_s, bound, loop.mass_scale, loop.damping_ratio)
    except ValueError as fault:
        raise _bad("mass_scale", loop.mass_scale, f"one that can be computed: {fault}") from fault
    between = scenario.fill.vibration_between_layers
    stages = (*scenario.vibration, *((between,) if between else ()))
    shaken_hz = max((stage.frequency_hz for stage in stages), default=0.0)
    if foam.first_hz < ABOVE_VIBRATION * shaken_hz:
        valid = (
            f"a scale or a time step at which the pattern's first frequency, now "
            f"{foam.first_hz:.3g} Hz, is {ABOVE_VIBRATION:g} times the box's {shaken_hz:g} Hz"
        )
        raise _bad("mass_scale", round(foam.mass_scale, 1), valid)
    return foam


def _bad(key: str, value: object, valid: str) -> BadInputError:
    return BadInputError([Problem(f"pattern.loop.{key}", value, valid)])
