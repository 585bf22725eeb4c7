"""Whether sand that came to rest over an open outlet has flowed out or got stuck."""

from __future__ import annotations

import numpy as np

from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.scenario import Scenario

STUCK_FRACTION = 0.3
"""Sand over an outlet, or right under it, over what a space as high as the outlet is wide holds:
above this sand stands there. A bed has 0.6 to 0.8, an outlet that has run empty nearly nothing."""


def what_blocks(scenario: Scenario, snapshot: Snapshot) -> str:
    """Say what holds the sand over an outlet; empty where it flowed out or the gate was upright.

    ``scenario``: with a discharge. ``snapshot``: at rest after it.
    """
    gate = scenario.gate
    if gate is None or not gate.is_level:
        return ""
    centre, half = np.array(gate.centre_m), np.array(gate.size_m) / 2
    width = 2 * float(half[:-1].min())
    stuck = STUCK_FRACTION * float(np.prod(1.6 * half[:-1])) * width
    # Over the middle of the outlet at any height: an arch may rise higher than it is wide.
    above = (centre[-1] + half[-1], np.inf)
    below = (centre[-1] - half[-1] - width, centre[-1] - half[-1])
    if _sand(scenario, snapshot, centre, 0.8 * half, above) < stuck:
        return ""
    largest_m = scenario.largest_diameter_m
    if _sand(scenario, snapshot, centre, 0.8 * half, below) >= stuck:
        return "the heap has grown up to the outlet: raise the hopper or fill in less sand"
    return (
        f"an arch holds the sand over the outlet, which is {width:g} m wide, "
        f"{width / largest_m:.2g} of the largest grains"
    )


def _sand(
    scenario: Scenario,
    snapshot: Snapshot,
    centre_m: np.ndarray,
    half_m: np.ndarray,
    height_m: tuple[float, float],
) -> float:
    """Area (m2) or volume (m3) of the grains whose centres lie in a part of space."""
    position, d = snapshot.position_m, scenario.dimension
    inside = (np.abs(position - centre_m)[:, :-1] < half_m[:-1]).all(axis=1)
    inside &= (position[:, -1] > height_m[0]) & (position[:, -1] < height_m[1])
    unit = scenario.sand.grain_measure(1.0, d)
    return unit * float(((2 * snapshot.radius_m[inside]) ** d).sum())
