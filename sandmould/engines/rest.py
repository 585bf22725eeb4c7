"""When sand rests, and what holds it over an outlet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.fill import Rest
from sandmould.scenario.scenario import Scenario

STUCK_FRACTION = 0.3
"""Sand over an outlet, or right under it, over what a space as high as the outlet is wide holds:
above this sand stands there. A bed has 0.6 to 0.8, an outlet that has run empty nearly nothing."""


@dataclass
class RestWatch:
    """Counts the checks in a row that found the sand at rest in a stage.

    A check is at rest when the sand is slow and the vertical loads on all surfaces, as means over
    the check's interval, carry its weight. A bed that swings is slow where its loads are off, and
    the other way round.
    """

    rest: Rest
    speed_limit_m_s: float
    in_row: int = 0
    """Checks at rest up to now, without one in between that was not."""
    all_in_row: int = 0
    """Those of them in which nobody held the stage."""
    held: str = ""
    """Why the stage was held last since the check before."""
    speed_m_s: float = math.nan
    """Of the last check."""
    last_held: str = ""
    """Why it was held before the last check."""
    load_error: float = math.nan
    """Loads less weight over the weight, of the last check; NaN where loads are not asked."""

    def check(self, speed_m_s: float, support_n: float, weight_n: float) -> None:
        """Take in one check, whose whole interval lies in the stage.

        ``speed_m_s``: root mean square speed of all grains, weighted by mass. ``support_n``: sum of
        the vertical loads on all surfaces, mean over the interval, downwards. ``weight_n``: of all
        grains; loads are not asked of sand without weight.
        """
        self.speed_m_s, self.load_error = speed_m_s, math.nan
        at_rest = speed_m_s < self.speed_limit_m_s
        tolerance = self.rest.load_tolerance
        if tolerance is not None and weight_n > 0.0:
            self.load_error = support_n / weight_n - 1.0
            at_rest = at_rest and abs(self.load_error) <= tolerance
        self.in_row = self.in_row + 1 if at_rest else 0
        self.all_in_row = self.all_in_row + 1 if at_rest and not self.held else 0
        self.last_held, self.held = self.held, ""

    def hold(self, why: str) -> None:
        """Let the stage go on: something else than the sand has moved since the last check."""
        self.held = why

    @property
    def sand_rests(self) -> bool:
        """Whether enough checks in a row found the sand at rest."""
        return self.in_row >= self.rest.checks

    @property
    def at_rest(self) -> bool:
        """Whether the sand was at rest in so many checks, and nobody held the stage."""
        return self.all_in_row >= self.rest.checks

    @property
    def sentence(self) -> str:
        """What the last check found, beside what is allowed."""
        found = f"rms speed {self.speed_m_s:.3g} m/s (limit {self.speed_limit_m_s:g})"
        if not math.isnan(self.load_error):
            found += (
                f", vertical loads {100 * self.load_error:+.2g} % off the sand's weight "
                f"(rest.load_tolerance {100 * (self.rest.load_tolerance or 0.0):g} %)"
            )
        found = f"at the last check: {found}"
        if self.last_held and self.sand_rests:
            return f"the sand itself was at rest, but {self.last_held}; {found}"
        return f"{found}{'; ' if self.last_held else ''}{self.last_held}"


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
