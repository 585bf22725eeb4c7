"""Keys that have moved or gone, and other names of values: what to write instead."""

from __future__ import annotations

from collections.abc import Sequence

MOVED = {
    "fill.settling.rms_speed_m_s": "rest.rms_speed_m_s",
    "discharge.settling.rms_speed_m_s": "rest.discharge_rms_speed_m_s",
    "record.load_every_steps": "rest.load_every_steps",
}

GONE = {
    "pattern.loop.exchange": "sand and pattern always exchange loads and displacements in memory",
    "pattern.loop.predicts": "shorter windows (pattern.loop.window_s) follow a surface that moves",
}
"""Keys that are no more, and what holds or serves without them."""

CALLED = {("hold", "stroke"): "displacement", ("hold", "amplitude"): "displacement"}
"""Other names of values, by key."""


def called(key: str, value: str) -> str:
    """What a value is called here; empty where no other name is known."""
    return CALLED.get((key, value.lower()), "")


def instead_of(parts: Sequence[str]) -> str | None:
    """What is valid instead of a key that has moved or gone; None of any other key's path."""
    path = "." + ".".join(parts)
    for old, new in MOVED.items():
        if path.endswith(f".{old}"):
            return f"the key {new}, where this one has moved"
    for old, why in GONE.items():
        if path.endswith(f".{old}"):
            return f"nothing in its place, for the key is no more: {why}"
    return None
