"""How the staggered loop goes."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

from pattern_fe.coupling.relaxation import Aitken, Fixed, Measured, QuasiNewton, Relaxation
from sandmould.scenario.pattern import Loop

Scheme = Literal["one_way", "fixed", "measured", "aitken", "quasi_newton"]
_COLUMNS = 10
_FILTER = 1e-2
"""Share of a change that must be new: below it is noise of the sand."""


@dataclass(frozen=True)
class LoopSettings:
    """Settings of the loop; the scenario's section ``pattern.loop`` says what they mean."""

    window_s: float
    scheme: Scheme
    factor: float
    """Of the fixed scheme; of the others in their first window."""
    least_factor: float
    most_factor: float
    limit_share: float
    """Of the measured limit that the measured scheme goes."""
    repeats: int
    """Times that a window is computed again at most, from the state at its beginning."""
    tolerance: float
    """Residual over displacement, both rms, below which a window is not repeated."""
    predicts: bool
    """Whether a window begins where the last displacements point to."""
    largest_displacement_m: float
    """Beyond it the loop has diverged."""

    @classmethod
    def of(cls, loop: Loop) -> LoopSettings:
        """Settings of a scenario's loop that has windows."""
        names = (field.name for field in fields(cls))
        return cls(**{name: getattr(loop, name) for name in names})

    def relaxation(self) -> Relaxation:
        """A fresh memory of the scheme."""
        if self.scheme == "one_way":
            return Fixed(0.0)
        if self.scheme == "fixed":
            return Fixed(self.factor)
        if self.scheme == "measured":
            least, most = self.least_factor, self.most_factor
            return Measured(self.factor, least, most, self.limit_share)
        if self.scheme == "aitken":
            return Aitken(self.factor, self.least_factor, self.most_factor)
        return QuasiNewton(self.factor, _COLUMNS, _FILTER)
