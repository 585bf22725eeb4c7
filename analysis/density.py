"""Apparent density of the sand round each grain, equation (55) of Rojek et al. (2004)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sandmould.analysis.free_space import free_part
from sandmould.analysis.intersections import disc_lens_m2, sphere_lens_m3
from sandmould.arrays import Centres, Radii
from sandmould.engines.neighbours import near_pairs
from sandmould.geometry.geometry import Array, Scene


@dataclass(frozen=True)
class ApparentDensity:
    """Apparent density of a porous body, a value for each grain."""

    raw_kg_m3: Array
    """(n,) float64: equation (55) as printed, low where a wall cuts the control volume."""
    corrected_kg_m3: Array
    """(n,) float64: the same sand over the free part of the control volume; NaN if none is free."""
    free_fraction: Array
    """(n,) float64: share of the control volume inside the box and outside the solids."""


def apparent_density(
    position_m: Centres,
    radius_m: Radii,
    density_kg_m3: float,
    scene: Scene | None = None,
    control_radius_m: float | None = None,
) -> ApparentDensity:
    """Apparent density of the sand in a disc or sphere round the centre of each grain.

    Equation (55): density of the grains times the share of the control volume that they take up,
    each counted by its exact common part with it, the grain in the middle included. The pores are
    what is left. The correction allows for walls and solids only: grains at the free surface
    of the bed still read low, for the air above them counts as pores. An overlap of two grains
    counts twice, as in the paper.

    ``density_kg_m3``: of the grains' own material. ``scene``: walls and solids; without it nothing
    is corrected. ``control_radius_m``: twice the largest radius, as in the paper, unless given.

    Raises
    ------
    ValueError
        When a wall of a 3D scene is oblique.

    References
    ----------
    Rojek, Zarate, Agelet de Saracibar, Gilbourne, Verdot (2004), section 3.7, equation (55).
    """
    n, dimension = position_m.shape
    if control_radius_m is None:
        control_radius_m = 2.0 * float(radius_m.max(initial=0.0))
    control = np.full(n, control_radius_m)
    measure = np.pi * control**2 if dimension == 2 else 4.0 / 3.0 * np.pi * control**3
    sand = _sand_in_control(position_m, radius_m, control_radius_m)
    free = measure if scene is None else free_part(position_m, control, scene)
    # less than round-off of the control volume is none
    some = free > 1e-9 * measure
    corrected = np.where(some, sand / np.where(some, free, 1.0), np.nan)
    return ApparentDensity(
        raw_kg_m3=density_kg_m3 * sand / measure,
        corrected_kg_m3=density_kg_m3 * corrected,
        free_fraction=free / measure,
    )


def _sand_in_control(position_m: Array, radius_m: Array, control_radius_m: float) -> Array:
    """Sum of the common parts of all grains with the control volume of each, (n,) m2 or m3."""
    n, dimension = position_m.shape
    lens = disc_lens_m2 if dimension == 2 else sphere_lens_m3
    sand = lens(np.zeros(n), np.full(n, control_radius_m), radius_m)
    for first, second, distance_m in near_pairs(
        position_m, control_radius_m + float(radius_m.max(initial=0.0))
    ):
        control = np.full(len(distance_m), control_radius_m)
        for centre, other in ((first, second), (second, first)):
            part = lens(distance_m, control, radius_m[other])
            sand += np.bincount(centre, weights=part, minlength=n)
    return sand
