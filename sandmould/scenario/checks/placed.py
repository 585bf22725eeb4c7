"""What keeps grains that are placed by hand from being where they are placed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sandmould.bad_input import Problem
from sandmould.scenario.placement import placed_grains
from sandmould.scenario.scenario import Scenario

ROUND_OFF = 1e-6
"""Share of a diameter: digits that a user leaves out of it, or of a place."""


def placed_problems(s: Scenario) -> Iterator[Problem]:
    """Grains of no size class, beyond the box, in a solid or in one another."""
    faults = [*_faults(s)]
    yield from faults
    if faults or not s.fill.grains:
        return
    from scipy.spatial import cKDTree  # few scenes place grains

    placed = placed_grains(s)
    centre_m, radius_m = placed.position_m, placed.radius_m
    for i in np.flatnonzero(s.scene.clearance_m(centre_m) < radius_m * (1 - ROUND_OFF)).tolist():
        valid = f"a place {radius_m[i]:.6g} m or more from walls and obstacles, its radius"
        yield Problem(f"fill.grains.{i}.position_m", centre_m[i].tolist(), valid)
    top_m = s.box.height_m * (1 + ROUND_OFF)
    for i in np.flatnonzero(centre_m[:, -1] + radius_m > top_m).tolist():
        valid = f"a place in the box, {s.box.size_text(s.dimension)}"
        yield Problem(f"fill.grains.{i}.position_m", centre_m[i].tolist(), valid)
    for i, j in sorted(cKDTree(centre_m).query_pairs(2 * radius_m.max())):
        least_m = radius_m[i] + radius_m[j]
        if np.linalg.norm(centre_m[i] - centre_m[j]) < least_m * (1 - ROUND_OFF):
            valid = f"a place {least_m:.6g} m or more from fill.grains.{i}, so that they only touch"
            yield Problem(f"fill.grains.{j}.position_m", centre_m[j].tolist(), valid)


def _faults(s: Scenario) -> Iterator[Problem]:
    """What each grain says of itself."""
    diameters_m = [c.diameter_m for c in s.sand.classes(s.dimension)]
    for i, grain in enumerate(s.fill.grains):
        for name in ("position_m", "velocity_m_s"):
            numbers = getattr(grain, name)
            if numbers is not None and len(numbers) != s.dimension:
                valid = f"{s.dimension} numbers, one a dimension"
                yield Problem(f"fill.grains.{i}.{name}", list(numbers), valid)
        if not any(abs(grain.diameter_m / d - 1) < ROUND_OFF for d in diameters_m):
            known = ", ".join(f"{d:.8g}" for d in diameters_m)
            valid = f"the diameter of a size class of the sand: {known}"
            yield Problem(f"fill.grains.{i}.diameter_m", grain.diameter_m, valid)
