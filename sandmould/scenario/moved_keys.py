"""Keys that stand elsewhere since, and other names of values, so that a file is told."""

from __future__ import annotations

from collections.abc import Sequence

MOVED = {
    "fill.settling.rms_speed_m_s": "rest.rms_speed_m_s",
    "discharge.settling.rms_speed_m_s": "rest.discharge_rms_speed_m_s",
    "record.load_every_steps": "rest.load_every_steps",
}

CALLED = {("hold", "stroke"): "displacement", ("hold", "amplitude"): "displacement"}
"""Other names of values, by key."""


def called(key: str, value: str) -> str:
    """What a value is called here; empty where no other name is known."""
    return CALLED.get((key, value.lower()), "")


def moved_to(parts: Sequence[str]) -> str | None:
    """Where the key of a path stands now; None of one that has not moved."""
    path = ".".join(parts)
    return next((new for old, new in MOVED.items() if f".{path}".endswith(f".{old}")), None)
