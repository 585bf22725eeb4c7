"""What each scheme of the coupling asks of an engine and of a scenario, before anything starts."""

from __future__ import annotations

from typing import get_args

from threadpoolctl import threadpool_limits

from sandmould.bad_input import BadInputError, Problem
from sandmould.engines.registry import engine_of, engines_that
from sandmould.engines.session import Capabilities
from sandmould.limits import STEPPED_COMPONENTS
from sandmould.pattern_fe.coupling.contact_rows import ContactRows
from sandmould.pattern_fe.coupling.explicit_foam import ContactBound, ExplicitFoam
from sandmould.pattern_fe.coupling.gain_prediction import predicted_gain
from sandmould.pattern_fe.coupling.in_step_foam import InStepFoam
from sandmould.pattern_fe.coupling.selective_mass import LIKE_FOAM, selective_mass
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.scene import surroundings_of
from sandmould.scenario.pattern import Loop, Scheme
from sandmould.scenario.scenario import Scenario

SCHEMES: tuple[Scheme, ...] = get_args(Scheme)
ABOVE_VIBRATION = 5.0
"""Least ratio of the pattern's first frequency to that of the box, for a solution as if at rest."""


def can_couple(scheme: Scheme, engine: Capabilities) -> bool:
    """Whether an engine has what a scheme asks for; others need a mesh that bends, no more."""
    if scheme in ("measured", "quasi_newton"):
        return engine.repeats_windows
    if scheme == "in_step":
        return engine.calls_movers
    if scheme == "monolithic":
        return engine.loads_of_every_step
    return True


def refuse_scheme(scenario: Scenario, pattern: Pattern) -> None:
    """Refuse a scheme that cannot go with the rest of the scenario (BadInputError)."""
    assert scenario.pattern is not None
    loop, scheme = scenario.pattern.loop, scenario.pattern.loop.scheme
    name, engine = scenario.engine.name, engine_of(scenario).CAPABILITIES
    if scenario.dimension not in engine.bends_meshes:
        raise BadInputError([Problem("engine.name", name, _engines_in(scenario.dimension))])
    if scenario.dimension == 3:
        _refuse_in_space(scenario, pattern, loop)
    if scenario.pattern.supports.free and scheme != "in_step":
        valid = (
            "in_step for a free pattern, which at rest is held by nothing that the others know; "
            "supports.hung or supports.bedding_n_m3 for them"
        )
        raise _bad("scheme", scheme, valid)
    if not can_couple(scheme, engine):
        raise _bad("scheme", scheme, _schemes_on(name, engine, scheme))
    if scenario.frame not in engine.bends_in_frames:
        frames = " or ".join(engine.bends_in_frames)
        valid = f"{frames} in a scene with a pattern on engine {name}"
        raise BadInputError([Problem("frame", scenario.frame, valid)])
    if scenario.discharge is not None:
        # Loads on vertices are forgotten when a gate is taken away.
        valid = "absent in a scene with a pattern"
        raise BadInputError([Problem("discharge.gate", scenario.discharge.gate, valid)])
    if loop.most_passes > 1 and not engine.repeats_windows:
        raise _bad("repeats", loop.repeats, f"0 on engine {name}, which cannot go back")
    if scheme == "quasi_newton" and loop.repeats == 0:
        valid = (
            "at least 1 in the scheme quasi_newton, which learns the sand's stiffness from a "
            "window that is computed again; another scheme for windows that are computed once"
        )
        raise _bad("repeats", loop.repeats, valid)
    if scheme == "per_layer":
        _refuse_foam_by_layers(scenario, pattern, loop)
    if scheme == "monolithic":
        explicit_foam(scenario, pattern)
    if scheme == "in_step":
        in_step_foam(scenario, pattern)


def _engines_in(dimension: int) -> str:
    """Engines that can couple a pattern in a dimension, as a valid value."""
    names = engines_that(lambda engine: dimension in engine.bends_meshes)
    return f"{' or '.join(names)} in a scene in {dimension}D with a pattern"


def _schemes_on(name: str, engine: Capabilities, refused: Scheme) -> str:
    """Schemes on an engine, as a valid value; engines too where one scheme alone is missing."""
    schemes = [scheme for scheme in SCHEMES if can_couple(scheme, engine)]
    if len(schemes) < len(SCHEMES) - 1:
        return f"{', '.join(schemes)} on engine {name}"
    others = " or ".join(engines_that(lambda other: can_couple(refused, other)))
    return f"another scheme on engine {name}, or engine {others}"


def _refuse_in_space(scenario: Scenario, pattern: Pattern, loop: Loop) -> None:
    """Refuse what is coupled in the plane alone, and a surface too fine for its matrix."""
    assert scenario.pattern is not None
    if loop.scheme == "monolithic":
        raise _bad("scheme", loop.scheme, "another scheme in 3D")
    if loop.scheme == "in_step":
        STEPPED_COMPONENTS.check(
            "pattern.element_m", pattern.surface.vertices_m.size, scenario.pattern.element_m
        )
        near = surroundings_of(scenario, pattern).solids
        if near:
            valid = (
                f"a scheme with windows in 3D beside the obstacle '{near[0].name}', which the "
                "pattern may reach"
            )
            raise _bad("scheme", loop.scheme, valid)


def _refuse_foam_by_layers(scenario: Scenario, pattern: Pattern, loop: Loop) -> None:
    """Refuse layers on a pattern so soft that the fixed share would swing beside resting sand."""
    limit = predicted_gain(scenario, pattern, loop.window_s).limit
    if loop.factor > limit:
        valid = (
            f"another scheme for so soft a foam: under sand at rest its surface would swing, for a "
            f"share of pattern.loop.factor = {loop.factor:g} holds below {limit:.2g} only"
        )
        raise _bad("scheme", loop.scheme, valid)


def explicit_foam(scenario: Scenario, pattern: Pattern) -> ExplicitFoam:
    """The pattern of the monolithic scheme, at rest.

    Raises
    ------
    BadInputError
        With large displacements, with masses too small for the contacts, or so large that the
        pattern swings with the box.
    """
    loop = _loop_of_small_displacements(scenario)
    bound, around = ContactBound.of(scenario, pattern), surroundings_of(scenario, pattern)
    try:
        foam = ExplicitFoam(
            pattern, scenario.step_s, bound, loop.mass_scale, loop.damping_ratio, around
        )
    except ValueError as fault:
        raise _bad("mass_scale", loop.mass_scale, f"one that can be computed: {fault}") from fault
    shaken_hz = _shaken_hz(scenario)
    if foam.first_hz < ABOVE_VIBRATION * shaken_hz:
        swings = _swings(foam.mass_scale, foam.first_hz, shaken_hz)
        raise _bad("scheme", loop.scheme, f"in_step, or a shorter time step: {swings}")
    return foam


def in_step_foam(scenario: Scenario, pattern: Pattern) -> InStepFoam:
    """The pattern of the in-step scheme, at rest.

    Raises
    ------
    BadInputError
        With large displacements, with masses so large that the pattern swings with the box where
        the foam's own would not, or with a scale that contacts do not leave to it.
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
            surroundings_of(scenario, pattern),
        )
        mass, given = foam.mass, loop.mass_scale
        least_hz = min(ABOVE_VIBRATION * _shaken_hz(scenario), LIKE_FOAM * mass.own_first_hz)
        if mass.first_hz < least_hz:
            raise BadInputError([_too_heavy(scenario, pattern, foam, least_hz)])
    if given is not None and mass.scale > given:
        valid = (
            f"null, or at least {1.01 * mass.scale:.3g}, at which contacts in a time step of "
            f"{scenario.step_s:.3g} s leave the pattern its first frequency"
        )
        raise _bad("mass_scale", given, valid)
    return foam


def _too_heavy(scenario: Scenario, pattern: Pattern, foam: InStepFoam, least_hz: float) -> Problem:
    """What lets a stepped pattern swing with the box, and a time step that does not."""
    assert scenario.pattern is not None
    given, mass = scenario.pattern.loop.mass_scale, foam.mass
    key = "fraction" if scenario.time_step.step_s is None else "step_s"
    step = asked = getattr(scenario.time_step, key)
    first_hz = mass.first_hz if given is None else 0.0
    while first_hz < least_hz:
        # the masses that contacts ask for go with the step
        step = float(f"{0.95 * step * (first_hz / least_hz) ** 2:.2g}") if first_hz else step
        time_step = scenario.time_step.model_copy(update={key: step})
        other = scenario.model_copy(update={"time_step": time_step})
        contacts = ContactRows.of(other, pattern)
        first_hz = selective_mass(pattern.condensed, contacts, other.step_s).first_hz
    why = (
        f"{_swings(mass.scale, mass.first_hz, _shaken_hz(scenario))} or {LIKE_FOAM:g} times the "
        f"foam's own {mass.own_first_hz:.3g} Hz"
    )
    if given is not None:
        return Problem(
            "pattern.loop.mass_scale", given, f"null with time_step.{key} = {step:g}: {why}"
        )
    otherwise = "" if pattern.is_free else ", or another pattern.loop.scheme"
    return Problem(f"time_step.{key}", asked, f"at most {step:g}{otherwise}: {why}")


def _loop_of_small_displacements(scenario: Scenario) -> Loop:
    """The loop of a scheme that is linear; raises BadInputError where it shall not be."""
    assert scenario.pattern is not None
    loop = scenario.pattern.loop
    if scenario.pattern.statics == "large":
        raise _bad("scheme", loop.scheme, "a staggered scheme with pattern.statics = large")
    return loop


def _shaken_hz(scenario: Scenario) -> float:
    """Highest frequency of the box, 0 where it stands still."""
    shakings = (*scenario.vibrations, *scenario.fill.shakings)
    return max((shaking.frequency_hz for shaking in shakings), default=0.0)


def _swings(scale: float, first_hz: float, shaken_hz: float) -> str:
    """How far a pattern's first frequency is from what the box asks of it."""
    return (
        f"at {scale:.3g} times the foam's mass the pattern's first frequency is {first_hz:.3g} Hz, "
        f"below {ABOVE_VIBRATION:g} times the box's {shaken_hz:g} Hz"
    )


def _bad(key: str, value: object, valid: str) -> BadInputError:
    return BadInputError([Problem(f"pattern.loop.{key}", value, valid)])
