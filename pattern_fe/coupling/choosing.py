"""The relaxation that a scenario's loop asks for."""

from __future__ import annotations

from pattern_fe.coupling.relaxation import Aitken, Fixed, Measured, QuasiNewton, Relaxation
from sandmould.scenario.pattern import Loop

_COLUMNS = 10
_FILTER = 1e-2
"""Share of a change that must be new: below it is noise of the sand."""


def relaxation_of(loop: Loop) -> Relaxation:
    """A fresh memory of the scheme of a loop that has windows."""
    if loop.scheme == "one_way":
        return Fixed(0.0)
    if loop.scheme in ("fixed", "per_layer"):
        return Fixed(loop.factor)
    if loop.scheme == "measured":
        return Measured(loop.factor, loop.least_factor, loop.most_factor, loop.limit_share)
    if loop.scheme == "aitken":
        return Aitken(loop.factor, loop.least_factor, loop.most_factor)
    return QuasiNewton(loop.factor, _COLUMNS, _FILTER)
