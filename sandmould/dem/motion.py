"""Motion of the grains: central differences (3)-(13) and the background damping (34)-(39)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from sandmould.compiled import njit
from sandmould.dem.grains import Floats, Grains
from sandmould.dem.vectors import (
    INLINED,
    OPTIONS,
    damped_by_component,
    dot,
    load,
    load_spin,
    no_spin,
    no_vector,
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
    form : int
    alpha : float
    """
    if form == VISCOUS:
        return plus(action, -alpha * inert, rate)
    if form == ISOTROPIC:
        rate2 = dot(rate, rate)
        if rate2 > 0.0:
            return plus(action, -alpha * math.sqrt(dot(action, action) / rate2), rate)
    elif form == COMPONENTWISE:
        return damped_by_component(action, rate, alpha)
    return action


@njit(**OPTIONS)
def kick(
    dim: Any, first: int, last: int, grains: Grains, body: Any, damping: Damping, dt: float
) -> None:
    """Advance velocities and spins of some grains, eqs. (3)-(4) and (6)-(7).

    Parameters
    ----------
    dim : tuple
    first, last : int
        Range of grains.
    grains : Grains
    body : tuple of d floats, m/s2
        Gravity and, in the frame of the box, minus its acceleration, eq. (58).
    damping : Damping
    dt : float, s
        Negative for half a step back to the time of the positions.
    """
    velocity, spin, force, moment = grains.velocity, grains.spin, grains.force, grains.moment
    kind, mass, inertia = grains.kind, grains.mass_of, grains.inertia_of
    # Quotients are found once for each kind.
    per_mass, per_inertia = dt / mass, dt / inertia
    for i in range(first, last):
        k = kind[i]
        m, v = mass[k], load(dim, velocity, i)
        push = plus(load(dim, force, i), m, body)
        push = damped(push, v, m, damping.form, damping.translation)
        store(plus(v, per_mass[k], push), velocity, i)
        inert, w = inertia[k], load_spin(dim, spin, i)
        torque = damped(load_spin(dim, moment, i), w, inert, damping.form, damping.rotation)
        store(plus(w, per_inertia[k], torque), spin, i)


@njit(**OPTIONS)
def drift(dim: Any, first: int, last: int, grains: Grains, dt: float) -> float:
    """Advance positions of some grains, eq. (5), and clear their forces.

    Returns
    -------
    float, m2/s2
        Largest squared speed; not a number as soon as one speed is none.
    """
    position, velocity, force, moment = (
        grains.position,
        grains.velocity,
        grains.force,
        grains.moment,
    )
    largest2, sound = 0.0, 0.0
    for i in range(first, last):
        v = load(dim, velocity, i)
        store(plus(load(dim, position, i), dt, v), position, i)
        store(no_vector(dim), force, i)
        store(no_spin(dim), moment, i)
        speed2 = dot(v, v)
        sound += speed2
        largest2 = max(largest2, speed2)
    return largest2 if sound < math.inf else math.nan


@njit(**OPTIONS)
def turn(dim: Any, first: int, last: int, grains: Grains, orientation: Floats, dt: float) -> None:
    """Advance orientations, eqs. (8)-(13): angles (n, 1) in 2D, matrices (n, 9) in 3D."""
    for i in range(first, last):
        rotate(times(load_spin(dim, grains.spin, i), dt), orientation, i)
