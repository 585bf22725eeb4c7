"""Keys that can stand at a place of a tree, by what the tree says there; keys that are no more.

A union of kinds has the keys of the kind that is stated, not those of all its kinds.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel

from sandmould.scenario.yaml_text import load_planned

MOVED = {
    "scenario.fill.settling.rms_speed_m_s": "rest.rms_speed_m_s",
    "scenario.record.load_every_steps": "rest.load_every_steps",
}
CALLED = {("hold", "stroke"): "displacement", ("hold", "amplitude"): "displacement"}
"""Other names of values, by key."""


def standing_keys(model: type[BaseModel], tree: Any, parts: list[str]) -> list[str]:
    """Keys of the section at a path in a tree, that of its kind where a union has several."""
    return sorted({name for m in _standing(model, tree, parts) for name in m.model_fields})


def standing_kinds(model: type[BaseModel], tree: Any, parts: list[str]) -> list[str]:
    """Kinds among which the section at a path has to state one."""
    fields = [
        m.model_fields["kind"] for m in _standing(model, tree, parts) if "kind" in m.model_fields
    ]
    return [str(kind) for field in fields for kind in get_args(field.annotation)]


def standing_lengths(model: type[BaseModel], tree: Any, parts: list[str]) -> list[int]:
    """Lengths that the list at a path can have; none where any length will do."""
    here: list[Any] = [model]
    for part in parts:
        here = [inner for outer in here for inner in _below(outer, part)]
    lists = [get_args(a) for a in here if get_origin(a) is tuple]
    return sorted({len(entries) for entries in lists if Ellipsis not in entries})


def _standing(model: type[BaseModel], tree: Any, parts: list[str]) -> list[type[BaseModel]]:
    here: list[Any] = [model]
    for part in parts:
        here = [inner for outer in here for inner in _below(outer, part)]
        tree = _value(tree, part)
        if isinstance(tree, dict) and "kind" in tree:
            here = [m for m in here if _takes(m, tree["kind"])] or here
    return [m for m in here if isinstance(m, type) and issubclass(m, BaseModel)]


def _below(outer: Any, part: str) -> Iterator[Any]:
    """What an annotation has at a key or position, unions taken apart."""
    if isinstance(outer, type) and issubclass(outer, BaseModel):
        if part in outer.model_fields:
            yield from _apart(outer.model_fields[part].annotation)
    elif get_origin(outer) is dict:
        yield from _apart(get_args(outer)[1])
    elif get_origin(outer) in (tuple, list) and part.isdecimal():
        yield from (inner for each in get_args(outer) for inner in _apart(each))


def _apart(annotation: Any) -> Iterator[Any]:
    """Branches of a union; what is annotated without its notes."""
    if get_origin(annotation) in (tuple, list, dict, Literal) or not get_args(annotation):
        yield annotation
        return
    for part in get_args(annotation):
        if isinstance(part, type) or get_args(part):
            yield from _apart(part)


def _value(tree: Any, part: str) -> Any:
    if isinstance(tree, dict):
        return tree.get(part)
    if isinstance(tree, list | tuple) and part.isdecimal() and int(part) < len(tree):
        return tree[int(part)]
    return None


def _takes(model: Any, kind: Any) -> bool:
    field = getattr(model, "model_fields", {}).get("kind")
    return field is not None and kind in get_args(field.annotation)


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
