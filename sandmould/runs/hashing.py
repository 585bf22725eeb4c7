"""What tells one scenario, and one computed run, from another."""

from __future__ import annotations

import functools
import json
import re
from pathlib import PurePosixPath
from typing import Any, Literal, get_args, get_origin

from sandmould.digest import digest
from sandmould.scenario.quantity import Section, first_default

_ALWAYS = object()
"""In place of a default: the value counts whatever it is."""
_FILE = re.compile(r"(.*\.)?(file|files|template)(\.\d+)*")
"""Keys that name files."""
_SHIPPED = re.compile(r"(?:sandmould/shipped/)?(config/(?:decks|meshes)/.+)")
"""A file that comes with us, as seen from a checkout or from an installed package."""
_SEEDLESS: dict[tuple[type[Section], str], dict[str, Any]] = {}
"""What was said by the last scenario whose hash was asked for, but for its seed."""


def scenario_hash(scenario: Section) -> str:
    """Hash of everything that a scenario says, whatever the order of its keys.

    A value at the key's first default says nothing: a key that comes or goes later changes no
    hash of a scenario that leaves it alone. A file counts by its name and its hash.
    """
    seed = {"seed"} & type(scenario).model_fields.keys()
    key = type(scenario), scenario.model_dump_json(exclude=seed)
    values = _SEEDLESS.get(key)  # replicates of a point follow each other
    if values is None:
        values = _seedless(scenario)
        _SEEDLESS.clear()
        _SEEDLESS[key] = values
    own = {name: getattr(scenario, name) for name in seed}
    stated = {name: n for name, n in own.items() if n != _defaults(type(scenario))[name]}
    return digest(json.dumps(values | stated, sort_keys=True))


def said(scenario: Section) -> dict[str, Any]:
    """The values of a scenario that differ from the first defaults of their keys, as JSON has them.

    The name of a variant, such as ``kind: tube``, is always among them.
    """
    return _said(scenario, scenario.model_dump(mode="json"))


def by_name(values: dict[str, Any]) -> dict[str, Any]:
    """Values by key path, as JSON has them, with each file by its name in place of its path."""
    return {key: _said(value, value, key) for key, value in values.items()}


def _said(value: Any, dumped: Any, at: str = "") -> Any:
    if isinstance(value, Section):
        defaults = _defaults(type(value))
        return {
            key: _said(getattr(value, key), dumped[key], key)
            for key, default in defaults.items()
            if key in dumped and (default is _ALWAYS or getattr(value, key) != default)
        }
    if isinstance(value, dict):
        named = _name if at == "sha256" else str
        return {named(key): _said(value[key], dumped[key], key) for key in dumped}
    if isinstance(value, (list, tuple)):
        return [_said(item, part, at) for item, part in zip(value, dumped, strict=True)]
    return _name(dumped) if isinstance(dumped, str) and _FILE.fullmatch(at) else dumped


def _name(path: str) -> str:
    """Name of a file; of one that comes with us its place there, the same in all installations."""
    shipped = _SHIPPED.fullmatch(path)
    return shipped[1] if shipped else PurePosixPath(path).name


@functools.cache
def _defaults(section: type[Section]) -> dict[str, Any]:
    """First default of each key; ``_ALWAYS`` where a key has none or names a variant."""
    return {
        key: _ALWAYS
        if field.is_required()
        or (get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1)
        else first_default(section, key)
        for key, field in section.model_fields.items()
    }


def solution_hash(scenario: Section, solver: str) -> str:
    """Hash of a scenario without its seed, and of the solver that computes it."""
    return digest(json.dumps(_seedless(scenario), sort_keys=True), solver)


def _seedless(scenario: Section) -> dict[str, Any]:
    """What a scenario says of what is computed, but for its seed."""
    left_out = {"seed", *scenario.uncomputed}
    return {key: value for key, value in said(scenario).items() if key not in left_out}
