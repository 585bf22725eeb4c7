"""The springs that a scene is computed with, which depend on the size of its grains."""

from __future__ import annotations

import math

from sandmould.scenario.contact import Contact
from sandmould.scenario.sand import Sand


def wave_speed_m_s(sand: Sand, contact: Contact, dimension: int) -> float:
    """Speed of a compression wave along a straight row of mass-median grains, m/s.

    c = d sqrt(k_n/m) of equal masses m between springs k_n, a distance d apart and far shorter
    than the wave: sqrt(4 k_n/(pi rho b)) of discs of thickness b, sqrt(6 k_n/(pi rho d)) of
    spheres. A bed has more contacts a grain, in all directions, and its own speed
    (docs/hard_sand.md).

    Parameters
    ----------
    sand : Sand
    contact : Contact
        Springs as they are computed with.
    dimension : int
    """
    diameter_m = sand.mass_median_diameter_m
    mass_kg = sand.grain_mass_kg(diameter_m, dimension)
    return diameter_m * math.sqrt(contact.grain_grain.normal_stiffness_n_m / mass_kg)


def spring_factor(sand: Sand, contact: Contact, dimension: int) -> float:
    """What the given springs are multiplied by."""
    if contact.wave_speed_m_s is not None:
        return (contact.wave_speed_m_s / wave_speed_m_s(sand, contact, dimension)) ** 2
    own_thickness = dimension == 2 and sand.disc_thickness_m != "grain"
    if contact.springs_at_size_scale is None or own_thickness:
        return 1.0
    return sand.size_scale / contact.springs_at_size_scale


def springs_in_use(sand: Sand, contact: Contact, dimension: int) -> Contact:
    """Contact laws with the springs that the scene is computed with.

    Pressure over stiffness stays when grains are coarsened, kappa = k_n/(P b) and k_n/(P d), and
    so does the wave speed: springs grow with the grains. A wave speed that is given settles them.
    """
    factor = spring_factor(sand, contact, dimension)
    if factor == 1.0:
        return contact
    return contact.stiffer(factor).model_copy(update={"wave_speed_m_s": contact.wave_speed_m_s})
