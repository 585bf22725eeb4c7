"""A pattern in motion, step by step: Newmark's method and central differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from pattern_fe.factor import factorised
from pattern_fe.supports import Mask

Array = NDArray[np.float64]


def _check_step(step_s: float, damping_1_s: float) -> None:
    if not 0.0 < step_s < np.inf:
        raise ValueError(f"time step of the pattern is {step_s:g} s, valid is above 0")
    if not 0.0 <= damping_1_s < np.inf:
        raise ValueError(f"mass damping of the pattern is {damping_1_s:g} 1/s, valid is 0 or above")


class Newmark:
    """Linear motion by Newmark's average acceleration, stable at any step and without loss.

    M a + alpha M v + K u = f with beta = 1/4, gamma = 1/2 (Newmark, Journal of the Engineering
    Mechanics Division 85, 1959). Starts at rest on the drawing.
    """

    def __init__(
        self,
        stiffness: csc_array,
        mass: csc_array,
        fixed: Mask,
        step_s: float,
        damping_1_s: float = 0.0,
    ) -> None:
        _check_step(step_s, damping_1_s)
        self._free = np.flatnonzero(~fixed.ravel())
        self._stiffness = stiffness[self._free][:, self._free]
        self._mass = mass[self._free][:, self._free]
        self._damping_1_s = damping_1_s
        self.step_s = step_s
        factor = 1.0 + 0.5 * step_s * damping_1_s
        self._factor = factorised(factor * self._mass + 0.25 * step_s**2 * self._stiffness)
        self._mass_factor = factorised(self._mass)
        self.time_s = 0.0
        self.displacement_m = np.zeros(fixed.shape)
        """(n, d) float64, m; may be set before the first step, zero where fixed."""
        self.velocity_m_s = np.zeros(fixed.shape)
        self._acceleration: Array | None = None

    def _residual_n(self, load_n: Array, displacement: Array, velocity: Array) -> Array:
        drag = self._damping_1_s * (self._mass @ velocity)
        return np.asarray(load_n.ravel()[self._free] - self._stiffness @ displacement - drag)

    def advance(self, load_n: Array) -> None:
        """Go on by one step.

        Parameters
        ----------
        load_n : (n, d) float64, N
            At the end of the step; the first call takes it for the start as well.
        """
        h, free = self.step_s, self._free
        u, v = self.displacement_m.ravel()[free], self.velocity_m_s.ravel()[free]
        if self._acceleration is None:
            self._acceleration = self._mass_factor.solve(self._residual_n(load_n, u, v))
        a = self._acceleration
        ahead_u, ahead_v = u + h * v + 0.25 * h**2 * a, v + 0.5 * h * a
        new = self._factor.solve(self._residual_n(load_n, ahead_u, ahead_v))
        self.displacement_m = self._whole(ahead_u + 0.25 * h**2 * new)
        self.velocity_m_s = self._whole(ahead_v + 0.5 * h * new)
        self._acceleration = new
        self.time_s += h

    def _whole(self, values: Array) -> Array:
        whole = np.zeros(self.displacement_m.size)
        whole[self._free] = values
        return whole.reshape(self.displacement_m.shape)

    @property
    def energy_j(self) -> float:
        """Kinetic and elastic energy."""
        u, v = (x.ravel()[self._free] for x in (self.displacement_m, self.velocity_m_s))
        return float(0.5 * (v @ (self._mass @ v) + u @ (self._stiffness @ u)))


class CentralDifferences:
    """Motion with lumped masses by central differences, stable below the critical step.

    Velocities live half a step behind the displacements; mass damping is taken at their mean, so
    that it costs no stability. Starts at rest on the drawing.
    """

    def __init__(
        self,
        internal_force_n: Callable[[Array], Array],
        mass_kg: Array,
        fixed: Mask,
        step_s: float,
        damping_1_s: float = 0.0,
    ) -> None:
        _check_step(step_s, damping_1_s)
        self._force_n = internal_force_n
        self._mass_kg = mass_kg[:, None]
        self._free = ~fixed
        self._keeps = (1.0 - 0.5 * step_s * damping_1_s) / (1.0 + 0.5 * step_s * damping_1_s)
        self._gains = self._free * step_s / (1.0 + 0.5 * step_s * damping_1_s) / self._mass_kg
        self.step_s = step_s
        self.time_s = 0.0
        self.displacement_m = np.zeros(fixed.shape)
        """(n, d) float64, m; may be set before the first step, zero where fixed."""
        self.velocity_m_s = np.zeros(fixed.shape)
        """(n, d) float64, m/s, half a step before the displacement."""

    def advance(self, load_n: Array) -> None:
        """Go on by one step.

        Parameters
        ----------
        load_n : (n, d) float64, N
            At the start of the step, on nodes displaced as now.
        """
        force = load_n - self._force_n(self.displacement_m)
        self.velocity_m_s = self._keeps * self.velocity_m_s + self._gains * force
        self.displacement_m = self.displacement_m + self.step_s * self.velocity_m_s
        self.time_s += self.step_s
