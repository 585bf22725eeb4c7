"""Which frequency may be recommended in Hz, and why none is.

An optimum that does not follow the springs holds for any sand as hard as the model or harder. One
that follows them is a property of the sand's hardness: f goes as the wave speed, df/f = dc/c, so it
is known as well as that speed is, and from a source of the real sand alone.
"""

from __future__ import annotations

from dataclasses import dataclass

from sandmould.runs.formatting import number
from sandmould.statistics.config import SandWaveSpeed
from sandmould.statistics.robustness import Robustness
from sandmould.statistics.spring_dependence import FOLLOWS, STAYS, held_text


@dataclass(frozen=True)
class ModelWaveSpeed:
    """Speed of compression waves in the model's bed."""

    speed_m_s: float
    how: str
    """How it is known, in a few words."""


@dataclass(frozen=True)
class Recommendation:
    """A frequency to set on a table, or the reason why none is named."""

    interval_hz: tuple[float, float] | None
    sentence: str


def recommend(
    robustness: Robustness,
    interval_hz: tuple[float, float],
    model: ModelWaveSpeed,
    sand: SandWaveSpeed | None,
) -> Recommendation | None:
    """Recommend a frequency where the controls allow it.

    Parameters
    ----------
    robustness : Robustness
    interval_hz : (float, float)
        95 % interval of the optimum.
    model : ModelWaveSpeed
    sand : SandWaveSpeed, optional
        Of the real sand, from a source.

    Returns
    -------
    Recommendation or None
        None where the control of the springs was not run.
    """
    if robustness.springs is None:
        return None
    own = robustness.springs.own
    held = held_text(own.hold)
    if robustness.cause == "artefact of the numerics":
        return _none("the optimum moves with the numerics")
    if own.dependence == STAYS:
        return _said(interval_hz, held, "the optimum does not follow the springs")
    if own.dependence != FOLLOWS:
        lacking = "there is no inner optimum" if own.dependence == "none" else (
            "whether the optimum follows the springs is not resolved"
        )  # fmt: skip
        return _none(f"{held} {lacking}")
    if sand is None:
        return _none(
            "the optimum follows the springs, so it is known only as well as the wave speed of "
            "the real sand. certificate.sand_wave_speed states no source of that speed"
        )
    speed = f"{number(model.speed_m_s)} m/s ({model.how})"
    spread = f"{number(sand.low_m_s)} to {number(sand.high_m_s)} m/s ({sand.by})"
    if not sand.low_m_s <= model.speed_m_s <= sand.high_m_s:
        return _none(
            f"the optimum follows the springs, and the model's wave speed, {speed}, is not that of "
            f"the sand, {spread}"
        )
    low_hz, high_hz = interval_hz
    wide_hz = (
        low_hz * sand.low_m_s / model.speed_m_s, high_hz * sand.high_m_s / model.speed_m_s
    )  # fmt: skip
    return _said(
        wide_hz, held,
        f"the optimum follows the springs, so the interval holds the spread of the sand's wave "
        f"speed, {spread}; the model's is {speed}",
    )  # fmt: skip


def _none(why: str) -> Recommendation:
    return Recommendation(None, f"No frequency in Hz is recommended: {why}.")


def _said(interval_hz: tuple[float, float], held: str, why: str) -> Recommendation:
    low, high = (number(f) for f in interval_hz)
    return Recommendation(interval_hz, f"Recommended {held}: {low} to {high} Hz; {why}.")
