"""What the keys of a study's file mean: the text of ``sandmould keys`` and the page of all keys.

All is read from the JSON schemas of the sections.
"""

from __future__ import annotations

import difflib
import json
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from pydantic import BaseModel

from sandmould.bad_input import BadInputError, Problem
from sandmould.kinds.registry import KINDS
from sandmould.scenario.quantity import NAME, keys_at, models_at, models_in

_WIDTH = 100
_INDENT = " " * 6
_BOUNDS = {
    "exclusiveMinimum": "> {:g}",
    "minimum": "≥ {:g}",
    "exclusiveMaximum": "< {:g}",
    "maximum": "≤ {:g}",
    "minItems": "at least {} of them",
    "maxItems": "at most {} of them",
    "minProperties": "at least {} of them",
}


@dataclass(frozen=True)
class Key:
    """A key of a section, in words."""

    name: str
    below: tuple[type[BaseModel], ...]
    """Sections that it can hold, one or in a list."""
    schema: dict[str, Any]
    """As JSON schema has it, with its meaning, unit and source."""
    must_be_given: bool

    def about(self, name: str) -> str:
        """Its ``description``, ``unit`` or ``source``; ``const`` is the one value it can have."""
        return str(self.schema.get(name, ""))

    @cached_property
    def parts(self) -> list[dict[str, Any]]:
        """Its schema and those of all that it can be or hold."""
        return list(_parts(self.schema))

    @property
    def choices(self) -> list[Any]:
        """Words and numbers that it can be."""
        return [c for p in self.parts for c in p.get("enum", [p["const"]] if "const" in p else [])]

    @property
    def default(self) -> str:
        """What holds where it is not given."""
        if self.must_be_given:
            return f"must be {only}" if (only := self.about("const")) else "must be given"
        default = self.schema.get("default", {})
        if default is None:
            return "absent unless given"
        in_itself = self.below or "default" not in self.schema
        return "" if in_itself and isinstance(default, dict) else f"default {json.dumps(default)}"


def _parts(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield schema
    inner = [schema.get("items"), *(p for n in ("anyOf", "prefixItems") for p in schema.get(n, ()))]
    for part in inner:
        if isinstance(part, dict):
            yield from _parts(part)


@cache
def keys_of(section: type[BaseModel]) -> tuple[Key, ...]:
    """The keys of a section in their order."""
    schema, fields = section.model_json_schema(), section.model_fields
    schema = schema["$defs"][section.__name__] if "$ref" in schema else schema
    return tuple(
        Key(name, tuple(models_in(fields[name].annotation)), about, fields[name].is_required())
        for name, about in schema["properties"].items()
    )


def sections() -> Iterator[tuple[str, str, type[BaseModel]]]:
    """Each section of all kinds of study once: the kind, the first path to it, itself."""
    shown: set[type[BaseModel]] = set()

    def below(section: type[BaseModel], path: str) -> Iterator[tuple[str, type[BaseModel]]]:
        if section not in shown:
            shown.add(section)
            yield path, section
            for key in keys_of(section):
                for inner in key.below:
                    yield from below(inner, f"{path}.{key.name}".lstrip("."))

    for kind in KINDS.values():
        yield from ((kind.name, path, section) for path, section in below(kind.study, ""))


def cells(key: Key) -> tuple[str, ...]:
    """The row of a key: name, unit, default, valid values, meaning, source."""
    return (
        f"`{key.name}`",
        _unit_cell(key),
        _default_cell(key),
        _valid_cell(key),
        _meaning_cell(key),
        key.about("source"),
    )


def _unit_cell(key: Key) -> str:
    """Unit of a number; nothing for words and for yes and no."""
    unit = key.about("unit")
    numbers = any(part.get("type") in ("integer", "number") for part in key.parts)
    return unit if unit != "1" or numbers else ""


def _default_cell(key: Key) -> str:
    if key.below and not key.must_be_given:
        return "absent" if key.default.startswith("absent") else ""
    value = key.default.removeprefix("default ")
    return value if value == key.default else f"`{value}`"


def _valid_cell(key: Key) -> str:
    """Choices, and bounds of numbers or of their count."""
    told = [f"`{choice}`" for choice in key.choices]
    for part in key.parts:
        if "prefixItems" not in part:
            told += [text.format(part[name]) for name, text in _BOUNDS.items() if name in part]
        if part.get("pattern") == NAME:
            told.append("small letters, digits and `_`")
    return ", ".join(told)


def _meaning_cell(key: Key) -> str:
    """What a key means; each choice that is explained begins a line."""
    text = key.about("description")
    for choice in (*key.choices, "true", "false", "null"):
        text = text.replace(f" {choice}: ", f"<br>`{choice}`: ")
        if text.startswith(f"{choice}: "):
            text = f"`{choice}`{text.removeprefix(choice)}"
    return text


def kind_of(section: type[BaseModel]) -> str:
    """The value of ``kind`` that chooses a section among others; empty where there is none."""
    return next((key.about("const") for key in keys_of(section) if key.name == "kind"), "")


def keys_text(path: str = "") -> str:
    """Describe the keys below a path, or the one key that it names.

    ``path``: such as ``scenario.vibration``; places in lists may stand in it or not. Empty for
    those of a study.

    Raises
    ------
    BadInputError
        Where no kind of study has such a key; it gives the nearest ones.
    """
    parts = [part for part in path.split(".") if part and not part.isdecimal()]
    found: dict[type[BaseModel], list[str]] = {}
    for name, kind in KINDS.items():
        for section in models_at(kind.study, parts):
            found.setdefault(section, []).append(name)
    if found:
        return "\n".join(_of_sections(found, ".".join(parts))).strip()
    *above, last = parts
    keys = {key.about("description"): key for kind in KINDS.values()
            for section in models_at(kind.study, above) for key in keys_of(section)
            if key.name == last}  # fmt: skip
    if not keys:
        raise BadInputError([Problem("PATH", path, _nearest(parts))])
    return "\n".join(line for key in keys.values() for line in _of_key(key))


def key_paths(start: str) -> list[str]:
    """Key paths that begin so, one level deep, for the shell to complete."""
    above, _, last = start.rpartition(".")
    keys = _names_at(above.split("."))
    return [f"{above}.{key}".lstrip(".") for key in keys if key.startswith(last)]


def _names_at(parts: list[str]) -> list[str]:
    """Keys that studies of any kind have at a path, list positions skipped."""
    parts = [part for part in parts if part]
    return sorted({key for kind in KINDS.values() for key in keys_at(kind.study, parts)})


def _of_sections(found: dict[type[BaseModel], list[str]], path: str) -> Iterator[str]:
    shown: set[str] = set()
    for section, kinds in found.items():
        only = kind_of(section)
        of = f"kind: {only}" if only else f"studies of kind {' or '.join(kinds)}"
        where = path or "a study"
        yield f"\nKeys of {where} ({of}):\n" if len(found) > 1 else f"Keys of {where}:\n"
        for key in keys_of(section):
            lines = _of_key(key)
            if path or lines[0] not in shown:  # kinds of study share most of their keys
                yield from lines
            shown.add(lines[0])
    below = [key.name for section in found for key in keys_of(section) if key.below]
    if below:
        first = ".".join(filter(None, (path, below[0])))
        yield f"\nKeys with ... have keys below them: sandmould keys {first}"


def _of_key(key: Key) -> list[str]:
    unit, choices = key.about("unit"), key.schema.get("enum", ())
    facts = [f"in {unit}"] if unit not in ("", "1") else []
    facts += [f"one of {', '.join(map(str, choices))}"] if choices else []
    facts += [key.default] if key.default else []
    first = f"  {key.name}{' ...' if key.below else ''}"
    meaning = textwrap.wrap(
        key.about("description"), _WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT
    )
    return [f"{first}  ({'; '.join(facts)})" if facts else first, *meaning]


def _nearest(parts: list[str]) -> str:
    """The keys that could have been meant at the first part that is wrong."""
    for depth, part in enumerate(parts):
        keys = _names_at(parts[:depth])
        if part not in keys:
            near = difflib.get_close_matches(part, keys, n=3, cutoff=0.4) or keys
            above = ".".join(parts[:depth])
            return f"a key of {above or 'a study'}, such as {', '.join(near[:8])}"
    return f"a path of keys, such as {'.'.join(parts[:-1])}"
