"""Motion of the grains: central differences (3)-(13) and the background damping (34)-(39)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from sandmould.compiled import njit
from sandmould.dem.grains import Floats, Grains
from sandmould.dem.lanes import where
from sandmould.dem.vectors import (
    INLINED,
    OPTIONS,
    damped_by_component,
    dot,
    load,
    load_spin,
    plus,
    rotate,
    store,
    times,
)

NONE, VISCOUS, ISOTROPIC, COMPONENTWISE = 0, 1, 2, 3


class Damping(NamedTuple):
    """Background damping; its form is one of the constants of this module."""

    form: int
    translation: float
    """alpha^vt (1/s) of eq. (36) or alpha^nvt of eq. (38)."""
    rotation: float
    """alpha^vr (1/s) of eq. (37) or alpha^nvr of eq. (39)."""


@njit(**INLINED)
def damped(action: Any, rate: Any, inert: float, form: int, alpha: float) -> Any:
    """Force or moment with the background damping added, eqs. (34)-(39).

    Parameters
    ----------
    action : tuple of floats, N or N m
        All that acts, gravity included.
    rate : tuple of floats, m/s or rad/s
        Velocity or spin half a step ago.
    inert : float, kg or kg m2
    """
    if form == VISCOUS:
        return plus(action, -alpha * inert, rate)
    if form == ISOTROPIC:
        rate2 = dot(rate, rate)
        rate2 = where(rate2 > 0.0, rate2, math.inf)
        return plus(action, -alpha * math.sqrt(dot(action, action) / rate2), rate)
    if form == COMPONENTWISE:
        return damped_by_component(action, rate, alpha)
    return action


@njit(**INLINED)
def kicked(
    v: Any,
    w: Any,
    force: Any,
    moment: Any,
    m: Any,
    inert: Any,
    dt: float,
    body: Any,
    damping: Damping,
) -> Any:
    """Velocity and spin of a grain, or of grains in lanes, one step on: see ``kick``."""
    push = damped(plus(force, m, body), v, m, damping.form, damping.translation)
    torque = damped(moment, w, inert, damping.form, damping.rotation)
    return plus(v, dt / m, push), plus(w, dt / inert, torque)


@njit(**OPTIONS)
def kick(
    dim: Any, first: int, last: int, grains: Grains, body: Any, damping: Damping, dt: float
) -> None:
    """Advance velocities and spins of some grains, eqs. (3)-(4) and (6)-(7).

    ``body``, tuple of d floats, m/s2: gravity and, in the frame of the box, minus its acceleration,
    eq. (58). ``dt``, s: negative for half a step back to the time of the positions.
    """
    velocity, spin, force, moment = grains.velocity, grains.spin, grains.force, grains.moment
    kind, mass, inertia = grains.kind, grains.mass_of, grains.inertia_of
    for i in range(first, last):
        v, w = kicked(
            load(dim, velocity, i),
            load_spin(dim, spin, i),
            load(dim, force, i),
            load_spin(dim, moment, i),
            mass[kind[i]],
            inertia[kind[i]],
            dt,
            body,
            damping,
        )
        store(v, velocity, i)
        store(w, spin, i)


@njit(**OPTIONS)
def drift(dim: Any, first: int, last: int, grains: Grains, dt: float) -> float:
    """Advance positions of some grains, eq. (5).

    Gives the largest squared speed, m2/s2; not a number as soon as one speed is none.
    """
    position, velocity = grains.position, grains.velocity
    largest2, sound = 0.0, 0.0
    for i in range(first, last):
        v = load(dim, velocity, i)
        store(plus(load(dim, position, i), dt, v), position, i)
        speed2 = dot(v, v)
        sound += speed2
        largest2 = max(largest2, speed2)
    return largest2 if sound < math.inf else math.nan


@njit(**OPTIONS)
def turn(dim: Any, first: int, last: int, spin: Floats, orientation: Floats, dt: float) -> None:
    """Advance orientations, eqs. (8)-(13): angles (n, 1) in 2D, matrices (n, 9) in 3D."""
    for i in range(first, last):
        rotate(times(load_spin(dim, spin, i), dt), orientation, i)
