"""A pattern in motion, step by step, by central differences."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from sandmould.pattern_fe.supports import Mask

Array = NDArray[np.float64]


class CentralDifferences:
    """Motion with lumped masses by central differences, stable below the critical step.

    Velocities live half a step behind the displacements; mass damping is taken at their mean, so
    that it costs no stability. Starts at rest on the drawing.
    """

    def __init__(
        self,
        stiffness: csr_array,
        mass_kg: Array,
        fixed: Mask,
        step_s: float,
        damping_1_s: float = 0.0,
    ) -> None:
        self._stiffness = stiffness
        self._mass_kg = mass_kg[:, None]
        self._free = ~fixed
        self._keeps = (1.0 - 0.5 * step_s * damping_1_s) / (1.0 + 0.5 * step_s * damping_1_s)
        self._gains = self._free * step_s / (1.0 + 0.5 * step_s * damping_1_s) / self._mass_kg
        self.step_s = step_s
        self.displacement_m = np.zeros(fixed.shape)
        """(n, d) float64, m; may be set before the first step, zero where fixed."""
        self.velocity_m_s = np.zeros(fixed.shape)
        """(n, d) float64, m/s, half a step before the displacement."""

    def advance(self, load_n: Array) -> None:
        """Go on by one step.

        ``load_n``, (n, d) float64, N: at the start of the step, on nodes displaced as now.
        """
        force = load_n - self.internal_force_n
        self.velocity_m_s = self._keeps * self.velocity_m_s + self._gains * force
        self.displacement_m = self.displacement_m + self.step_s * self.velocity_m_s

    @property
    def internal_force_n(self) -> Array:
        """Elastic forces of the displacement, (n, d) float64, N."""
        moved_m = self.displacement_m
        return np.asarray((self._stiffness @ moved_m.ravel()).reshape(moved_m.shape))

    @property
    def mobility_m_n(self) -> Array:
        """Displacement in a step under a force of 1 N at its start, (n, d) float64, m/N."""
        return np.asarray(self.step_s * self._gains)

    def push(self, force_n: Array) -> None:
        """Add forces, (n, d) float64, N, to those of the step that was just taken."""
        pushed = self._gains * force_n
        self.velocity_m_s = self.velocity_m_s + pushed
        self.displacement_m = self.displacement_m + self.step_s * pushed
