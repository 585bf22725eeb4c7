"""Keys that stand elsewhere since or are no more, and other names of values: what is valid now."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sandmould.scenario.yaml_text import load_planned

MOVED = {
    "scenario.fill.settling.rms_speed_m_s": "rest.rms_speed_m_s",
    "scenario.record.load_every_steps": "rest.load_every_steps",
}
CALLED = {("hold", "stroke"): "displacement", ("hold", "amplitude"): "displacement"}
"""Other names of values, by key."""


@functools.cache
def removed_keys() -> dict[str, tuple[Any, str]]:
    """Keys that are no more, by path without places in lists, and kinds by section and name.

    The value that holds now, with which a key counts as not stated, and what to write instead.
    """
    text = Path(__file__).with_name("removed_keys.yaml").read_text(encoding="utf-8")
    return {key: (told.get("holds"), told["instead"]) for key, told in load_planned(text).items()}


def called(key: str, value: str) -> str:
    """What a value is called here; empty where no other name is known."""
    return CALLED.get((key, value.lower()), "")


def instead_of(parts: Sequence[str]) -> str:
    """What is valid instead of a key that has moved or is no more; empty for any other path."""
    path = _path(parts)
    if path in MOVED:
        return f"the key {MOVED[path]}, where this one has moved"
    return removed_keys().get(path, ("", ""))[1]


def holds_anyway(parts: Sequence[str], value: Any) -> bool:
    """Whether a key that is no more states what holds without it."""
    removed = removed_keys().get(_path(parts))
    return removed is not None and _says(value, removed[0])


def _path(parts: Sequence[str]) -> str:
    return ".".join(part for part in parts if part and not part.isdecimal())


def _says(value: Any, known: Any) -> bool:
    """Whether a value is the known one, or a part of a known section."""
    if isinstance(value, dict) and isinstance(known, dict):
        return all(key in known and _says(each, known[key]) for key, each in value.items())
    return bool(value == known)
