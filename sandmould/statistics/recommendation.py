"""Which frequency may be recommended in Hz, and why none is.

An optimum that does not follow the springs holds for any sand as hard as the model or harder. One
that follows them is a property of the sand's hardness: f goes as the wave speed, df/f = dc/c, so it
is known as well as that speed is, and from a source of the real sand alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from sandmould.statistics.config import SandWaveSpeed
from sandmould.statistics.robustness import Robustness
from sandmould.statistics.spring_dependence import FOLLOWS, STAYS


@dataclass(frozen=True)
class ModelWaveSpeed:
    """Speed of compression waves in the model's bed."""

    speed_m_s: float
    how: str
    """How it is known, in a few words."""


class Why(StrEnum):
    """What a recommendation rests on, or why none is made."""

    STAYS = "stays"
    """The optimum does not follow the springs."""
    OF_SAND = "of sand"
    """It does, and the interval holds the spread of the sand's wave speed."""
    NUMERICS = "numerics"
    """It moves with the numerics."""
    AT_END = "at end"
    """Its interval reaches the end of what was swept."""
    NO_OPTIMUM = "no optimum"
    UNRESOLVED = "unresolved"
    NO_SOURCE = "no source"
    """It follows the springs, and the wave speed of the real sand has no source."""
    OTHER_SAND = "other sand"
    """It follows the springs, and the model's wave speed is not that of the sand."""


@dataclass(frozen=True)
class Recommendation:
    """A frequency to set on a table, or the reason why none is named."""

    interval_hz: tuple[float, float] | None
    why: Why
    hold: str = ""
    model: ModelWaveSpeed | None = None
    sand: SandWaveSpeed | None = None


def recommend(
    robustness: Robustness,
    interval_hz: tuple[float, float],
    model: ModelWaveSpeed,
    sand: SandWaveSpeed | None,
) -> Recommendation | None:
    """Recommend a frequency where the controls allow it; None where springs were not controlled.

    ``interval_hz``: 95 % interval of the optimum; ``sand``: of the real sand, from a source.
    """
    if robustness.springs is None:
        return None
    own = robustness.springs.own
    if robustness.cause == "numerics artefact":
        return Recommendation(None, Why.NUMERICS, own.hold)
    if own.dependence == STAYS:
        return Recommendation(interval_hz, Why.STAYS, own.hold)
    if own.dependence != FOLLOWS:
        why = Why.NO_OPTIMUM if own.dependence == "none" else Why.UNRESOLVED
        return Recommendation(None, why, own.hold)
    if sand is None:
        return Recommendation(None, Why.NO_SOURCE, own.hold)
    if not sand.low_m_s <= model.speed_m_s <= sand.high_m_s:
        return Recommendation(None, Why.OTHER_SAND, own.hold, model, sand)
    low_hz, high_hz = interval_hz
    wide_hz = (
        low_hz * sand.low_m_s / model.speed_m_s, high_hz * sand.high_m_s / model.speed_m_s
    )  # fmt: skip
    return Recommendation(wide_hz, Why.OF_SAND, own.hold, model, sand)
