"""The critical time step of a bed of springs and dashpots, eqs. (40)-(54)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from sandmould.scenario.contact import Contact, ContactLaw
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED, Sand


class TimeStep(Section):
    """How the time step is chosen."""

    fraction: float = quantity(
        0.7, "Time step over the critical one.", source=ARGUED, first=0.5, ge=1e-3, le=1
    )
    rotational_inertia: Literal["physical", "scaled"] = quantity(
        "physical",
        "Moments of inertia. physical: as they are. scaled: raised to m r^2 k_T / k_n, so that "
        "rotation does not set the critical step.",
        source=ARGUED,
    )
    step_s: float | None = quantity(
        None, "A time step of the user's own. Above the critical one it is that of what follows "
        "the fill, and at most the exact limit of the filled bed.", unit="s",
        source="user", ge=1e-12,
    )  # fmt: skip
    bed_fraction: float | None = quantity(
        None,
        "Time step after the fill over the exact limit of the filled bed, which is found when the "
        "fill is at rest; 0.7 unless given. 0: the step of the fill stays, as it does without "
        "vibration, with a pattern and with a step_s.",
        source=ARGUED,
        ge=0,
        le=1,
    )


BED_FRACTION = 0.7
"""Unless given; it leaves room for a bed that vibration packs."""
CONTACTS = 6.0
"""Of a grain in the lattice whose limit is planned: that of hexagonal discs, and the least that
holds spheres without friction. Beds, filled and filling, had the limit of 4.0 to 5.2 (discs) and
3.6 to 5.6 contacts (spheres), fewer the wider their sizes are spread, and of 5.8 without
friction."""
LEAST_STEPS_A_PERIOD = 20
"""Time steps of a period of vibration."""


@dataclass(frozen=True)
class CriticalStep:
    """The smallest critical step of all grains, and what sets it."""

    step_s: float
    cause: str


def damped_step(omega_rad_s: float, damping_ratio: float, correction_per_s: float = 0.0) -> float:
    """Critical step of one mode, eq. (42), h = omega dt: h^2 + 4 xi h = 4.

    Corrected dashpots, c' = c/(1 + b dt), are the weaker the longer the step that they are found
    for: h^2 + 4 xi h/(1 + b h/omega) = 4. ``damping_ratio``: xi of the mode, that of plain
    dashpots. ``correction_per_s``: b = c/(4 m) of its contacts with m of eq. (21), at most xi
    omega; 0 of plain dashpots.
    """
    xi, b = damping_ratio, correction_per_s / omega_rad_s
    if b == 0.0:
        return 2 / omega_rad_s * (math.sqrt(1 + xi**2) - xi)
    # Newton's way down a convex cubic that grows, from above its one positive root.
    h, last = 2.0, math.inf
    while h < last:
        last = h
        value = ((b * h + 1) * h + 4 * (xi - b)) * h - 4
        h -= value / ((3 * b * h + 2) * h + 4 * (xi - b))
    return last / omega_rad_s


def _modes(
    law: ContactLaw,
    mass_kg: float,
    contacts: float,
    inertia_factor: float,
    pair_masses: int,
    corrected: bool,
) -> tuple[float, float]:
    """Critical steps of the stiffest normal and rotational mode of equal grains, eqs. (50)-(54)."""
    # With n contacts a grain the highest normal mode has omega^2 = n k_n / m and zeta omega /
    # omega_pair of critical damping, omega_pair^2 = 2 k_n / m (k_n / m at a wall); the highest
    # rotational one omega^2 = 2 n k_T / (I / r^2) (n k_T at a wall), and no damping.
    omega_n = math.sqrt(contacts * law.normal_stiffness_n_m / mass_kg)
    omega_pair = math.sqrt(pair_masses * law.normal_stiffness_n_m / mass_kg)
    inertia_kg = inertia_factor * mass_kg
    omega_r = math.sqrt(pair_masses * contacts * law.tangential_stiffness_n_m / inertia_kg)
    # c / (4 m) of a contact, m = mass_kg / pair_masses.
    correction = 0.5 * law.damping_ratio * omega_pair if corrected else 0.0
    xi = law.damping_ratio * omega_n / omega_pair
    return damped_step(omega_n, xi, correction), 2 / omega_r


def inertia_factor(sand: Sand, contact: Contact, time_step: TimeStep, dimension: int) -> float:
    """Moment of inertia over m r^2 that the equations of motion use.

    Scaled, eqs. (51) and (52) give the same frequency: I = m r^2 k_T / k_n, section 3.5.
    """
    physical = sand.inertia_factor(dimension)
    if time_step.rotational_inertia == "physical":
        return physical
    law = contact.grain_grain
    return max(physical, law.tangential_stiffness_n_m / law.normal_stiffness_n_m)


def critical_step(
    sand: Sand, contact: Contact, time_step: TimeStep, dimension: int
) -> CriticalStep:
    """Critical time step of a scene, set by its smallest grains.

    ``time_step``: its rotational inertia counts.

    Notes
    -----
    The paper's (51) is the case of one contact with a fixed body. The smallest class stands for
    all, since omega goes as 1/sqrt(m).
    """
    factor = inertia_factor(sand, contact, time_step, dimension)
    smallest = sand.classes(dimension)[0].diameter_m
    mass = sand.grain_mass_kg(smallest, dimension)
    corrected = contact.dashpot == "corrected"
    grain_n, grain_r = _modes(contact.grain_grain, mass, CONTACTS, factor, 2, corrected)
    # At most `dimension` walls meet in a corner.
    wall_n, wall_r = _modes(contact.grain_wall, mass, dimension, factor, 1, corrected)
    steps = {
        "normal grain-grain contact": grain_n,
        "rotation at grain-grain contacts": grain_r,
        "normal grain-wall contact": wall_n,
        "rotation at grain-wall contacts": wall_r,
    }
    cause = min(steps, key=lambda name: steps[name])
    return CriticalStep(steps[cause], cause)
