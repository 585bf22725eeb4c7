"""A vibrating table driven by an unbalance: its mass, its mounts and its rotating masses.

Two equal masses m/2 turn in opposite directions at the eccentricity e. Their forces across the
direction of vibration cancel, and along it m e omega^2 sin(omega t) is left. Table and flask, of
the mass M, stand on mounts of the stiffness K and the damping C and move along that direction
alone:

    M x'' + C x' + K x = m e omega^2 sin(omega t) + s (F - F_0)

F is the sand's force on all that is fixed to the box, and F_0 that of the resting sand, its weight
along the direction. So x counts from where the table stands with the resting sand on it. In 2D, s
is the depth of the flask over the thickness of a disc; in 3D it is 1.
"""

from __future__ import annotations

import math

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED

BRAKE_PERIODS = 1.0
"""Periods of the drive in which the brake comes on once the vibration is over."""


class Unbalance(Section):
    """Two counter-rotating masses on a table that stands on mounts."""

    moment_kg_m: float = quantity(
        ...,
        "Rotating mass times its eccentricity, of both masses together.",
        unit="kg m",
        source="user",
        gt=0,
        le=1e4,
    )
    moving_mass_kg: float = quantity(
        ...,
        "All that moves with the table: table, motors, rotating masses and empty flask, without "
        "the sand.",
        unit="kg",
        source="user",
        gt=0,
        le=1e6,
    )
    mount_frequency_hz: float = quantity(
        ...,
        "Natural frequency of the moving mass on its mounts, without the sand.",
        unit="Hz",
        source="user",
        ge=0.01,
        le=1000,
    )
    mount_damping_ratio: float = quantity(
        0.05,
        "Damping of the mounts over the critical damping of the moving mass.",
        source=ARGUED,
        ge=0,
        le=10,
    )
    flask_depth_m: float | None = quantity(
        None,
        "Depth of the flask across the plane; required in 2D, absent in 3D. The sand's force on "
        "the table is that of the discs, times this depth over sand.disc_thickness_m.",
        unit="m",
        source="user",
        gt=0,
        le=100,
    )

    @property
    def stiffness_n_m(self) -> float:
        """K of the mounts."""
        return self.moving_mass_kg * (2 * math.pi * self.mount_frequency_hz) ** 2

    @property
    def critical_damping_kg_s(self) -> float:
        """C of mounts on which the table comes to rest without swinging."""
        return 2 * self.moving_mass_kg * 2 * math.pi * self.mount_frequency_hz

    @property
    def damping_kg_s(self) -> float:
        """C of the mounts."""
        return self.mount_damping_ratio * self.critical_damping_kg_s

    def force_n(self, angular_frequency_rad_s: float) -> float:
        """Amplitude of the force of the rotating masses, m e omega^2."""
        return self.moment_kg_m * angular_frequency_rad_s**2

    def empty_amplitude_m(
        self, angular_frequency_rad_s: float, added_mass_kg: float = 0.0
    ) -> float:
        """Steady amplitude of the table without sand, or with a mass that moves with it.

        m e omega^2/|K - (M + m_added) omega^2 + i omega C|; infinite at a resonance without
        damping.
        """
        omega = angular_frequency_rad_s
        mass_kg = self.moving_mass_kg + added_mass_kg
        resistance = math.hypot(self.stiffness_n_m - mass_kg * omega**2, omega * self.damping_kg_s)
        return self.force_n(omega) / resistance if resistance > 0.0 else math.inf

    def largest_amplitude_m(self, angular_frequency_rad_s: float, sand_kg: float) -> float:
        """Largest steady amplitude with any share of the sand as a mass that moves with the table.

        ``sand_kg``: all sand, as the table feels it.
        """
        resonant = self.stiffness_n_m / angular_frequency_rad_s**2 - self.moving_mass_kg
        shares = (0.0, sand_kg, min(max(resonant, 0.0), sand_kg))
        return max(self.empty_amplitude_m(angular_frequency_rad_s, share) for share in shares)
