"""The contact law of section 3.2 and 3.3: spring and dashpot, friction, rolling moment.

One function serves grains against grains and grains against surfaces, here and inside LAMMPS.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from sandmould.compiled import njit
from sandmould.dem.lanes import fused
from sandmould.dem.vectors import (
    INLINED,
    dot,
    in_space,
    limited,
    plus,
    rolling_part,
    spin_slip,
    tangent_after,
    tangent_moment,
    times,
    turned_spin,
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
    torsion: bool
    """Whether rolling resistance also resists spin about the normal in 3D, as (31) reads."""
    lag_s: float = 0.0
    """Time step, s, whose lag the dashpot makes up for, or 0: see ``pair_coefficients``."""
    lead_s: float = 0.0
    """Half a step, s, by which normals are ahead of velocities, or 0: see ``contact``."""

    @property
    def springs_n_m(self) -> tuple[float, float, float]:
        """Normal, tangential and rolling stiffness of a contact that sticks, N/m.

        0 where the law has no such spring.
        """
        k_t = self.k_t if self.friction > 0.0 else 0.0
        k_roll = self.k_roll if self.rolling_arm > 0.0 else 0.0
        return self.k_n, k_t, k_roll


class PairCoefficients(NamedTuple):
    """What the law makes of the sizes of two bodies in contact, or of a grain at a surface."""

    damping: float
    """Coefficient of the dashpot, N s/m, eqs. (19)-(21)."""
    rolling_stiffness: float
    """N m, the spring that regularises eq. (29)."""
    rolling_arm: float
    """m, largest rolling moment over the normal force, eqs. (30)-(33)."""


@njit(**INLINED)
def pair_coefficients(law: Law, mass: float, smaller: float, effective: float) -> PairCoefficients:
    """Apply a law to sizes.

    ``mass``, kg: m1 m2 / (m1 + m2), or m1 at a surface, eq. (21). ``smaller``, m: smaller of the
    two radii, eq. (33), or r1 at a surface. ``effective``, m: r1 r2 / (r1 + r2), or r1 at a
    surface.

    Notes
    -----
    A dashpot c that sees the velocity of half a step ago damps as one of c / sqrt(1 - c dt / (2 m))
    would (docs/stability.md); c' = c / (1 + c dt / (4 m)) takes the bias of first order away.
    """
    damping = 2.0 * law.damping_ratio * math.sqrt(mass * law.k_n)
    return PairCoefficients(
        damping / (1.0 + damping * law.lag_s / (4.0 * mass)),
        law.k_roll * effective * effective,
        law.rolling_arm * smaller,
    )


@njit(**INLINED)
def contact(
    n: Any,
    overlap: float,
    v: Any,
    w_1: Any,
    w_2: Any,
    arm_1: float,
    arm_2: float,
    turn: float,
    sizes: PairCoefficients,
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
    turn : float, s/m
        Time by which the normal is ahead of the velocities over the distance of the centres; 0
        where the slip is that of the normal as it is, such as at a face, whose normal stays.
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

    Notes
    -----
    Velocities are those of half a step ago, when the normal was n - turn v_t to first order. The
    slip in that plane is v_t (1 + turn v_n) - (w + turn w_n v) x n with w = arm_1 w_1 + arm_2 w_2.
    Taken in the plane of n instead, a grain that rolls and twists, as in the groove between two
    others, slips a little in every step, always the same way (docs/developers/size_ratio.md).
    """
    approach = dot(v, n)
    normal = fused(-sizes.damping, approach, law.k_n * overlap)
    normal = max(normal, 0.0 if law.clip_total else -math.inf)
    # Slip of body 2 over body 1 drags body 1 along: the sign that (25) needs under (14). Both
    # bodies find the same digits: nothing here rounds by which of them is the first.
    rolled = plus(times(w_1, arm_1), 1.0, times(w_2, arm_2))
    spun = spin_slip(n, turned_spin(n, rolled, turn, v))
    moved = law.k_t * dt * fused(turn, approach, 1.0)
    friction = plus(tangent_after(n, friction, moved, v), -law.k_t * dt, spun)
    friction = limited(friction, law.friction * abs(normal))
    force = plus(in_space(n, friction), -normal, n)
    turning = tangent_moment(n, friction)
    moment_1 = times(turning, arm_1)
    moment_2 = times(turning, arm_2)
    if law.rolling_arm > 0.0:
        relative = plus(w_1, -1.0, w_2)
        rolling = plus(rolling, -sizes.rolling_stiffness * dt, relative)
        rolling = rolling_part(n, rolling, law.torsion)
        rolling = limited(rolling, sizes.rolling_arm * abs(normal))
        moment_1 = plus(moment_1, 1.0, rolling)
        moment_2 = plus(moment_2, -1.0, rolling)
    return force, moment_1, moment_2, friction, rolling, normal
