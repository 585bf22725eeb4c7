"""Flows with exact solutions: between plates, a decaying vortex, a rotating patch."""

from __future__ import annotations

import math

import numpy as np

from sandmould.arrays import Flags, Floats
from sandmould.casting.mps.flow import Flow
from sandmould.casting.mps.particles import (
    FLUID,
    WALL_LAYERS,
    at_rest,
    lattice,
    make_kernel,
    mould_around,
)
from sandmould.casting.mps.scheme import LiquidMetal, Scheme

COLUMNS = 6
"""Of a channel along its flow, which is periodic: the fewest that a kernel allows."""


def channel(
    rows: int,
    width_m: float,
    metal: LiquidMetal,
    scheme: Scheme,
    upper_m_s: float = 0.0,
) -> Flow:
    """Fluid at rest between two plates along x, periodic along the flow.

    Fluid sticks to the first layer of the plates: the plates of the exact solutions lie at its
    centres, half a particle beyond the lattice's edge.

    Parameters
    ----------
    rows : int
        Of particles across.
    width_m : float, m
        Between the centres of the plates' first layers: rows + 1 particles.
    metal : LiquidMetal
        Its gravity along x drives a Poiseuille flow.
    scheme : Scheme
    upper_m_s : float, m/s
        Velocity of the upper plate, for a Couette flow.
    """
    size_m = width_m / (rows + 1)

    def is_cavity(place: Floats) -> Flags:
        return np.asarray((place[:, 1] > 0.0) & (place[:, 1] < rows * size_m))

    sites = lattice((0, -WALL_LAYERS), (COLUMNS, rows + WALL_LAYERS), size_m)
    plates = mould_around(sites, is_cavity, size_m)
    plates.velocity_m_s[plates.position_m[:, 1] > rows * size_m, 0] = upper_m_s
    both = at_rest(lattice((0, 0), (COLUMNS, rows), size_m), FLUID).joined(plates)
    both.position_m[:, 1] += 0.5 * size_m
    return Flow(both, make_kernel(2, size_m, period_m=(COLUMNS * size_m, 0.0, 0.0)), metal, scheme)


def couette_m_s(y_m: Floats, time_s: float, width_m: float, nu: float, upper_m_s: float) -> Floats:
    """Velocity after the upper plate started from rest, m/s (Batchelor 1967, section 4.3)."""
    n = np.arange(1, 60)[:, None]
    decay = np.exp(-nu * (n * math.pi / width_m) ** 2 * time_s)
    wave = (-1.0) ** n / n * np.sin(n * math.pi * y_m / width_m) * decay
    return np.asarray(upper_m_s * (y_m / width_m + 2.0 / math.pi * wave.sum(axis=0)))


def poiseuille_m_s(y_m: Floats, time_s: float, width_m: float, nu: float, force: float) -> Floats:
    """Velocity after a body force (m/s2) set in on fluid at rest, m/s (the same section)."""
    n = 2 * np.arange(40)[:, None] + 1
    decay = np.exp(-nu * (n * math.pi / width_m) ** 2 * time_s)
    wave = np.sin(n * math.pi * y_m / width_m) / n**3 * decay
    steady = 0.5 * y_m * (width_m - y_m)
    return np.asarray(force / nu * (steady - 4.0 * width_m**2 / math.pi**3 * wave.sum(axis=0)))


def taylor_green_m_s(
    position_m: Floats, time_s: float, nu: float, speed_m_s: float = 1.0
) -> Floats:
    """Velocity of four vortices in a periodic square of 1 m, (n, 3) float64, m/s.

    It decays as exp(-8 pi^2 nu t) (Taylor and Green 1937).
    """
    x, y = 2.0 * math.pi * position_m[:, 0], 2.0 * math.pi * position_m[:, 1]
    largest = speed_m_s * math.exp(-8.0 * math.pi**2 * nu * time_s)
    across, along = -np.cos(x) * np.sin(y), np.sin(x) * np.cos(y)
    return largest * np.stack((across, along, np.zeros_like(x)), axis=1)


def taylor_green(
    cells: int, scheme: Scheme, nu: float, speed_m_s: float = 1.0, reach: float = 2.1
) -> Flow:
    """Start the vortices of ``taylor_green_m_s`` on a lattice.

    Parameters
    ----------
    cells : int
        Particles along a side.
    scheme : Scheme
    nu : float, m2/s
    speed_m_s : float, m/s
        Largest at the beginning.
    reach : float
        c_k.
    """
    size_m = 1.0 / cells
    fluid = at_rest(lattice((0, 0), (cells, cells), size_m), FLUID)
    fluid.velocity_m_s[:] = taylor_green_m_s(fluid.position_m, 0.0, nu, speed_m_s)
    metal = LiquidMetal(1000.0, nu, (0.0, 0.0, 0.0))
    return Flow(fluid, make_kernel(2, size_m, reach, (1.0, 1.0, 0.0)), metal, scheme)


def rotating_patch(cells: int, scheme: Scheme, spin_rad_s: float = 1.0) -> Flow:
    """A square of 1 m without walls, gravity or viscosity that starts in rigid rotation.

    Its corners are thrown out; momentum and angular momentum stay what they were.
    """
    size_m = 1.0 / cells
    fluid = at_rest(lattice((0, 0), (cells, cells), size_m), FLUID)
    fluid.position_m[:, :2] -= 0.5
    fluid.velocity_m_s[:, 0] = -spin_rad_s * fluid.position_m[:, 1]
    fluid.velocity_m_s[:, 1] = spin_rad_s * fluid.position_m[:, 0]
    return Flow(fluid, make_kernel(2, size_m), LiquidMetal(1000.0, 0.0, (0.0, 0.0, 0.0)), scheme)


def momentum_m_s(flow: Flow) -> Floats:
    """Momentum over mass, (3,) float64, m/s."""
    return np.asarray(flow.particles.velocity_m_s[flow.fluid].mean(axis=0))


def angular_momentum_m2_s(flow: Flow) -> Floats:
    """Angular momentum about the origin over mass, (3,) float64, m2/s."""
    state = flow.particles
    return np.cross(state.position_m[flow.fluid], state.velocity_m_s[flow.fluid]).mean(axis=0)
