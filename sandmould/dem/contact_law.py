"""The contact law of section 3.2 and 3.3: spring and dashpot, friction, rolling moment.

One function serves grains against grains and grains against surfaces, here and inside LAMMPS.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numba import njit

from sandmould.dem.vectors import (
    INLINED,
    dot,
    in_space,
    plus,
    rolling_part,
    spin_slip,
    tangent,
    tangent_moment,
    times,
    turned,
    turned_moment,
)


class Law(NamedTuple):
    """Parameters of one contact law; compiled code takes it as it is."""

    k_n: float
    """Normal stiffness, N/m, eq. (16)."""
    k_t: float
    """Tangential stiffness, N/m, eq. (25)."""
    friction: float
    """Coulomb coefficient, eq. (26)."""
    damping_ratio: float
    """Share of critical damping, eqs. (19)-(21)."""
    rolling_arm: float
    """tan(alpha): the arm f of eq. (29) over the smaller radius, eq. (32)."""
    k_roll: float
    """Stiffness, N/m, of the spring at the effective radius that regularises eq. (29)."""
    clip_total: bool
    """Whether 'no tension' (18) holds for the total normal force or for its elastic part alone."""
    twist: bool
    """Whether rolling resistance also resists twist about the normal in 3D, as (31) reads."""


@njit(**INLINED)
def limited(action: Any, limit: float) -> Any:
    """Return mapping, eqs. (26)-(28): an action no larger than the limit stays as it is.

    Without a branch: which contacts slip cannot be foretold, and a wrong guess costs more.
    """
    size2, limit2 = dot(action, action), limit * limit + 1e-300
    return times(action, limit / math.sqrt(size2 if size2 > limit2 else limit2))


@njit(**INLINED)
def contact(
    n: Any,
    overlap: float,
    v: Any,
    w_1: Any,
    w_2: Any,
    arm_1: float,
    arm_2: float,
    mass: float,
    smaller: float,
    effective: float,
    law: Law,
    dt: float,
    friction: Any,
    rolling: Any,
) -> Any:
    """Force and moments of one contact, eqs. (15)-(33).

    Parameters
    ----------
    n : tuple of d floats
        Unit normal from body 1 to body 2.
    overlap : float, m
        Positive.
    v : tuple of d floats, m/s
        Velocity of the centre of body 2 minus that of body 1; for a surface its own velocity at
        the contact point.
    w_1, w_2 : tuple of floats, rad/s
        Spins, one component in 2D.
    arm_1, arm_2 : float, m
        Distances of the centres from the contact point; 0 for a surface.
    mass : float, kg
        m1 m2 / (m1 + m2), or m1 at a surface, eq. (21).
    smaller : float, m
        Smaller of the two radii, eq. (33).
    effective : float, m
        r1 r2 / (r1 + r2), or r1 at a surface.
    law : Law
    dt : float, s
    friction, rolling : tuple of floats, N and N m
        Friction force on body 1 as a tangent and rolling moment on body 1 after the last step.

    Returns
    -------
    force : tuple of d floats, N
        On body 1.
    moment_1, moment_2 : tuple of floats, N m
        On bodies 1 and 2.
    friction, rolling : tuple of floats, N and N m
        To be kept for the next step.
    normal : float, N
        Normal force, positive in compression.
    """
    damping = 2.0 * law.damping_ratio * math.sqrt(mass * law.k_n)
    normal = law.k_n * overlap - damping * dot(v, n)
    least = 0.0 if law.clip_total else -math.inf
    normal = normal if normal > least else least
    # Slip of body 2 over body 1 drags body 1 along: the sign that (25) needs under (14).
    slip = plus(tangent(n, v), -1.0, spin_slip(n, plus(times(w_1, arm_1), arm_2, w_2)))
    friction = plus(turned(n, friction), law.k_t * dt, slip)
    friction = limited(friction, law.friction * abs(normal))
    force = plus(in_space(n, friction), -normal, n)
    turning = tangent_moment(n, friction)
    moment_1 = times(turning, arm_1)
    moment_2 = times(turning, arm_2)
    if law.rolling_arm > 0.0:
        relative = rolling_part(n, plus(w_1, -1.0, w_2), law.twist)
        stiffness = law.k_roll * effective * effective
        rolling = plus(turned_moment(n, rolling, law.twist), -stiffness * dt, relative)
        rolling = limited(rolling, law.rolling_arm * smaller * abs(normal))
        moment_1 = plus(moment_1, 1.0, rolling)
        moment_2 = plus(moment_2, -1.0, rolling)
    return force, moment_1, moment_2, friction, rolling, normal
