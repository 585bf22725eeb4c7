"""What each scheme of the coupling asks of a scenario, told before anything starts."""

from __future__ import annotations

from threadpoolctl import threadpool_limits

from pattern_fe.coupling.contact_rows import ContactRows
from pattern_fe.coupling.explicit_foam import ContactBound, ExplicitFoam
from pattern_fe.coupling.in_step_foam import InStepFoam
from pattern_fe.pattern import Pattern
from sandmould.scenario.bad_input import BadInputError, Problem
from sandmould.scenario.pattern import Loop
from sandmould.scenario.scenario import Scenario

WITH_LIGGGHTS = ("one_way", "per_layer", "fixed", "aitken", "quasi_newton")
"""Schemes whose windows need a mesh to be exchanged and its loads read, no more."""
ABOVE_VIBRATION = 5.0
"""Least ratio of the pattern's first frequency to that of the box, for an answer as if at rest."""
LIKE_FOAM = 0.9
"""Ratio of the pattern's first frequency to the foam's own from which on it moves like the foam."""


def refuse_scheme(scenario: Scenario, pattern: Pattern) -> None:
    """Refuse a scheme that cannot go with the rest of the scenario.

    Raises
    ------
    BadInputError
    """
    assert scenario.pattern is not None
    loop, engine = scenario.pattern.loop, scenario.engine.name
    scheme = loop.scheme
    if scenario.dimension == 3:
        _refuse_in_space(loop, engine)
    if engine == "liggghts" and scheme not in WITH_LIGGGHTS:
        raise _bad("scheme", scheme, f"{', '.join(WITH_LIGGGHTS)} on engine liggghts")
    if engine == "liggghts" and scenario.frame == "laboratory":
        # A mesh that moves with the box cannot be exchanged.
        valid = "box in a scene with a pattern on engine liggghts"
        raise BadInputError([Problem("frame", scenario.frame, valid)])
    if scenario.discharge is not None:
        # Loads on vertices are forgotten when a gate is taken away.
        valid = "absent in a scene with a pattern"
        raise BadInputError([Problem("discharge.gate", scenario.discharge.gate, valid)])
    if loop.most_passes > 1 and engine == "liggghts":
        raise _bad("repeats", loop.repeats, "0 on engine liggghts, which cannot go back")
    if scheme == "monolithic" and engine != "reference":
        raise _bad("scheme", scheme, f"another scheme on engine {engine}, or engine reference")
    if loop.exchange == "files" and not loop.has_windows:
        raise _bad(
            "exchange", loop.exchange, f"memory in the scheme {scheme}, which has no windows"
        )
    if scheme == "monolithic":
        explicit_foam(scenario, pattern)
    if scheme == "in_step":
        in_step_foam(scenario, pattern)


def _refuse_in_space(loop: Loop, engine: str) -> None:
    """Refuse what is coupled in the plane alone."""
    if engine == "liggghts":
        valid = "reference or lammps in a scene in 3D with a pattern"
        raise BadInputError([Problem("engine.name", engine, valid)])
    if not loop.has_windows:
        raise _bad("scheme", loop.scheme, "a scheme with windows in 3D")
    if loop.exchange == "files":
        raise _bad("exchange", loop.exchange, "memory in 3D")


def explicit_foam(scenario: Scenario, pattern: Pattern) -> ExplicitFoam:
    """The pattern of the monolithic scheme, at rest.

    Raises
    ------
    BadInputError
        With large displacements, with masses too small for the contacts, or so large that the
        pattern swings with the box.
    """
    loop = _loop_of_small_displacements(scenario)
    bound = ContactBound.of(scenario, pattern)
    try:
        foam = ExplicitFoam(pattern, scenario.step_s, bound, loop.mass_scale, loop.damping_ratio)
    except ValueError as fault:
        raise _bad("mass_scale", loop.mass_scale, f"one that can be computed: {fault}") from fault
    shaken_hz = _shaken_hz(scenario)
    if foam.first_hz < ABOVE_VIBRATION * shaken_hz:
        raise _swings(foam.mass_scale, foam.first_hz, shaken_hz)
    return foam


def in_step_foam(scenario: Scenario, pattern: Pattern) -> InStepFoam:
    """The pattern of the in-step scheme, at rest.

    Raises
    ------
    BadInputError
        With large displacements, or with masses so large that the pattern swings with the box
        where the foam's own would not.
    """
    loop = _loop_of_small_displacements(scenario)
    # Threads of small matrices wait for one another, longest beside other runs.
    with threadpool_limits(1):
        foam = InStepFoam(
            pattern,
            scenario.step_s,
            ContactRows.of(scenario, pattern),
            loop.largest_displacement_m,
            loop.mass_scale,
            loop.damping_ratio,
        )
    mass, shaken_hz = foam.mass, _shaken_hz(scenario)
    if mass.first_hz < min(ABOVE_VIBRATION * shaken_hz, LIKE_FOAM * mass.own_first_hz):
        also = f" or {LIKE_FOAM:g} times the foam's own {mass.own_first_hz:.3g} Hz"
        raise _swings(mass.scale, mass.first_hz, shaken_hz, also)
    return foam


def _loop_of_small_displacements(scenario: Scenario) -> Loop:
    """The loop of a scheme that is linear; raises BadInputError where it shall not be."""
    assert scenario.pattern is not None
    loop = scenario.pattern.loop
    if scenario.pattern.statics == "large":
        raise _bad("scheme", loop.scheme, "a staggered scheme with pattern.statics = large")
    return loop


def _shaken_hz(scenario: Scenario) -> float:
    """Highest frequency of the box, 0 where it stands still."""
    between = scenario.fill.vibration_between_layers
    stages = (*scenario.vibration, *((between,) if between else ()))
    return max((stage.frequency_hz for stage in stages), default=0.0)


def _swings(scale: float, first_hz: float, shaken_hz: float, also: str = "") -> BadInputError:
    """What is told where scaled masses let the pattern swing with the box."""
    valid = (
        f"a scale or a time step at which the pattern's first frequency, now {first_hz:.3g} Hz, "
        f"is {ABOVE_VIBRATION:g} times the box's {shaken_hz:g} Hz{also}"
    )
    return _bad("mass_scale", round(scale, 1), valid)


def _bad(key: str, value: object, valid: str) -> BadInputError:
    return BadInputError([Problem(f"pattern.loop.{key}", value, valid)])
