"""Whether sand is at rest: the one decision that ends a stage of settling, on every engine."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sandmould.scenario.rest import Rest


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
