"""How the paper judges a flow: figure 6 and table 2."""

from __future__ import annotations

from enum import Enum

from sandmould.casting.mps.probes import History

STEPS_S, COUNTS = (1e-4, 5e-4, 1e-3, 2e-3), (1, 2, 5, 10)
"""Largest time steps and numbers of relaxations, table 2: paired there, crossed in figure 6."""
SHARES = (1.0, 0.5, 0.2, 0.1)
"""c_poi, table 2."""
QUIET_PA = 200.0
"""Standard deviation at 70 mm below which 'the ideal pressure distribution could be achieved'."""
HOP_PARTICLES = 3.0
"""Rise of the highest particle above the filled height, in particles, beyond which fluid hops:
waves of a noisy surface lift whole rows by one or two, a particle three above it has left."""


class StabilityRating(Enum):
    """The signs of figure 6."""

    EXCELLENT = "excellent"
    """Pressure deviates by less than ``QUIET_PA`` and nothing hops."""
    GOOD = "good"
    """The run ends, but the pressure oscillates more or fluid hops."""
    FAILED = "failed"
    """A guard stopped the run: the velocity diverged, fluid left the mould, no pressure found."""


def rate_stability(stopped: str, hops: bool, deviation_pa: float) -> StabilityRating:
    """Rate a run as the paper's figure 6 does, by numbers its text gives.

    Parameters
    ----------
    stopped : str
        Why a guard stopped it, or nothing.
    hops : bool
    deviation_pa : float, Pa
        Standard deviation in time of the pressure at the deepest place.
    """
    if stopped:
        return StabilityRating.FAILED
    calm = deviation_pa < QUIET_PA and not hops
    return StabilityRating.EXCELLENT if calm else StabilityRating.GOOD


def still_hops(history: History, filled_m: float, spacing_m: float) -> bool:
    """Whether a particle left fluid that started at rest, filled to a height."""
    return float(history.top_m.max(initial=0.0)) > filled_m + HOP_PARTICLES * spacing_m
