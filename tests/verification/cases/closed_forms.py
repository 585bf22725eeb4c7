"""Closed forms and independent integrations of single contacts."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.integrate import solve_ivp


def _angle(damping_ratio: float, no_tension: str) -> float:
    """Phase of the damped swing at which the contact ends, zeta < 1."""
    z = damping_ratio
    if no_tension == "elastic":
        return math.pi
    return math.atan2(2 * z * math.sqrt(1 - z * z), 2 * z * z - 1)


def restitution(damping_ratio: float, no_tension: str) -> float:
    """Restitution of a linear spring and dashpot, u'' + 2 zeta omega u' + omega^2 u = 0.

    Elastic part alone clipped: the contact ends where the overlap does, half a period after the
    first touch. Total force clipped: it ends where the force first vanishes (Schwager and
    Poeschel 2007), which tends to exp(-2) at critical damping.
    """
    z = damping_ratio
    if z == 1.0:
        return math.exp(-2) if no_tension == "total" else 0.0
    return math.exp(-z / math.sqrt(1 - z * z) * _angle(z, no_tension))


def contact_time_s(omega_rad_s: float, damping_ratio: float, no_tension: str) -> float:
    """Duration of that contact; infinite where a critically damped one may pull."""
    z = damping_ratio
    if z == 1.0:
        return 2 / omega_rad_s if no_tension == "total" else math.inf
    return _angle(z, no_tension) / (omega_rad_s * math.sqrt(1 - z * z))


@dataclass(frozen=True)
class Oblique:
    """Oblique undamped impact of linear springs with friction, the overlap small beside the radius.

    The overlap is u = v_n/omega sin(omega t) with omega^2 = k_n/m. The elongation x of the
    tangential spring follows the slip v_s while it sticks, x' = v_s, and lies on Coulomb's limit
    k_t |x| = mu k_n u while it slips. Either way the contact points have
    v_s' = -(1 + 1/kappa) k_t x / m, with I = kappa m r^2 and the mass m of (21), also for two
    unequal grains of one kappa.
    """

    omega_rad_s: float
    k_t_over_k_n: float
    friction: float
    kappa: float

    def impulse(self, v_n: float, v_s: float) -> float:
        """Tangential impulse over mass, m/s, against the slip, by events of stick and slip."""
        w, ratio, mu = self.omega_rad_s, self.k_t_over_k_n, self.friction
        end = math.pi / w
        compliance = (1 + 1 / self.kappa) * ratio * w * w

        def limit(t: float) -> float:
            return mu / ratio * v_n / w * math.sin(w * t)

        def limit_rate(t: float) -> float:
            return mu / ratio * v_n * math.cos(w * t)

        # Slip starts at once where the spring would grow faster than its limit.
        t, x, v, impulse = 0.0, 0.0, v_s, 0.0
        sticks = abs(v) <= limit_rate(0.0)
        sign = math.copysign(1.0, v)
        options = {"rtol": 1e-11, "atol": 1e-13 * abs(v_s) / w, "max_step": end / 200}
        while t < end * (1 - 1e-9):
            if sticks:

                def rates(_: float, y: list[float]) -> list[float]:
                    return [y[1], -compliance * y[0], compliance / (1 + 1 / self.kappa) * y[0]]

                def reaches(time: float, y: list[float]) -> float:
                    return limit(time) - abs(y[0])

                reaches.terminal, reaches.direction = True, -1  # type: ignore[attr-defined]
                found = solve_ivp(rates, (t, end), [x, v, impulse], events=reaches, **options)
                t, (x, v, impulse) = found.t[-1], found.y[:, -1]
                sticks, sign = False, math.copysign(1.0, x)
            else:

                def slides(time: float, y: list[float], sign: float = sign) -> list[float]:
                    pull = sign * compliance * limit(time)
                    return [-pull, pull / (1 + 1 / self.kappa)]

                def holds(time: float, y: list[float], sign: float = sign) -> float:
                    return sign * y[0] - limit_rate(time)

                holds.terminal, holds.direction = True, -1  # type: ignore[attr-defined]
                found = solve_ivp(slides, (t, end), [v, impulse], events=holds, **options)
                t, (v, impulse) = found.t[-1], found.y[:, -1]
                x = sign * limit(t)
                sticks = True
        return float(impulse)
