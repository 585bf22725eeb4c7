"""Read scenarios and materials from YAML, keeping where every value came from."""

from __future__ import annotations

import contextlib
import copy
import difflib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from sandmould.bad_input import BadInputError, Problem
from sandmould.limits import YAML_BYTES
from sandmould.plain_file import read_plain
from sandmould.scenario.quantity import units_at
from sandmould.scenario.standing_keys import (
    called,
    holds_anyway,
    instead_of,
    standing_keys,
    standing_kinds,
    standing_lengths,
)
from sandmould.scenario.units import in_kelvin, number_of
from sandmould.scenario.yaml_text import fault_of, load_planned, load_users

Tree = dict[str, Any]
ModelT = TypeVar("ModelT", bound=BaseModel)
MOST_KEYS = 8
"""Keys of a section that a sentence can name."""


def read_planned(path: Path, name: str) -> Tree:
    """Read a file that the plan of a study wrote, as :func:`read_yaml` does."""
    return _read(path, name, load_planned)


def read_yaml(path: Path, name: str, text: str | None = None) -> Tree:
    """Read one YAML file that must hold a mapping.

    Raises
    ------
    BadInputError
        When the file is missing, is no YAML, holds no mapping or is beyond a limit.
    """
    with contextlib.suppress(OSError):  # which reading tells
        size = path.stat().st_size if text is None else len(text.encode())
        _named(name, YAML_BYTES.problems("file", size))
    return _read(path, name, load_users, text)


def _named(name: str, problems: Iterable[Problem]) -> None:
    """Refuse a file for its problems, if it has any."""
    if found := [replace(problem, file=name) for problem in problems]:
        raise BadInputError(found)


def _read(path: Path, name: str, load: Callable[[str], Any], text: str | None = None) -> Tree:
    try:
        tree = load(read_plain(path) if text is None else text)
    except BadInputError as error:
        _named(name, error.problems)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise BadInputError([Problem("file", reason, "a readable YAML file", name)]) from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        fault = fault_of(error)
        raise BadInputError([Problem("file", fault, "YAML text", name, fault)]) from error
    if not isinstance(tree, dict):
        stated = "nothing" if tree is None else tree
        raise BadInputError([Problem("file", stated, "a mapping of keys to values", name)])
    return tree


@dataclass
class Origin:
    """Where each value of a tree came from, by key path."""

    file: dict[str, str] = field(default_factory=dict)
    source: dict[str, str] = field(default_factory=dict)

    def below(self, root: str) -> Origin:
        """That of one section's values; what stands for all stays."""

        def kept(table: Mapping[str, str]) -> dict[str, str]:
            return {key: by for key, by in table.items() if f"{key}.".startswith((".", f"{root}."))}

        return Origin(kept(self.file), kept(self.source))

    def file_of(self, key: str) -> str:
        """File that gave a key, or the nearest key above it."""
        return _nearest(self.file, key) or ""

    def source_of(self, key: str) -> str | None:
        """Source of a key's value, or None where the types' default stands.

        That of a list of numbers is the one of its first entry.
        """
        first = self.source.get(f"{key}.0") or self.source.get(f"{key}.0.0")
        return _nearest(self.source, key) or first


def _nearest(table: Mapping[str, str], key: str) -> str | None:
    parts = key.split(".")
    for n in range(len(parts), 0, -1):
        origin = table.get(".".join(parts[:n]))
        if origin is not None:
            return origin
    return table.get("")


def _is_sourced(value: Any) -> bool:
    return isinstance(value, dict) and {"value", "source"} <= set(value) <= {
        "value",
        "unit",
        "source",
    }


def _starts_anew(value: Tree, below: Tree) -> bool:
    """Whether a section excludes the one below it: another kind, or one of them is held free."""
    if "kind" in value and "kind" in below:
        return bool(value["kind"] != below["kind"])
    free = value.get("free"), below.get("free")
    return True in free and free[0] is not free[1]


def merge(base: Tree, extra: Tree, origin: Origin, file: str, above: str = "") -> Tree:
    """Lay one tree over another: mappings merge, lists, values and what excludes replace.

    ``base``, ``extra``: a leaf may be written ``{value: ..., unit: ..., source: ...}``. ``origin``:
    updated with the file and source of every leaf of ``extra``. ``above``: key path of ``base``.
    """
    merged = dict(base)
    for name, value in extra.items():
        key = f"{above}.{name}" if above else str(name)
        below = merged.get(name)
        lays_over = isinstance(value, dict) and not _is_sourced(value)
        if not (lays_over and isinstance(below, dict)) or _starts_anew(value, below):
            for table in (origin.file, origin.source):
                for old in [k for k in table if k == key or k.startswith(key + ".")]:
                    del table[old]
            below = {}
        if lays_over:
            origin.file[key] = file
            merged[name] = merge(below, value, origin, file, key)
        else:
            merged[name] = _unwrap(value, origin, file, key)
    return merged


def _unwrap(value: Any, origin: Origin, file: str, key: str) -> Any:
    origin.file[key] = file
    if _is_sourced(value):
        origin.source[key] = str(value["source"])
        return in_kelvin(value["value"], str(value.get("unit", "")))
    if isinstance(value, dict):
        return {n: _unwrap(v, origin, file, f"{key}.{n}") for n, v in value.items()}
    if isinstance(value, list):
        return [_unwrap(v, origin, file, f"{key}.{i}") for i, v in enumerate(value)]
    origin.source[key] = file
    return value


def validated(model: type[ModelT], tree: Tree, origin: Origin, above: str = "") -> ModelT:
    """Turn a tree into a typed model, or say what is wrong with each value.

    Raises
    ------
    BadInputError
        With file, key, value and what is valid of every misfit.
    """
    try:
        # JSON's strict mode takes lists for tuples, but neither "50" nor true for a number.
        return model.model_validate_json(json.dumps(tree, default=str), strict=True)
    except ValidationError as error:
        if (left := _without_removed(tree, error.errors(), above)) is not None:
            return validated(model, left, origin, above)
        findings = [(item, _problem(model, tree, item, origin, above)) for item in error.errors()]
        problems: dict[str, Problem] = {}
        for item, problem in findings:
            if not problem.valid or _is_beside_the_point(item, problem.key, findings):
                continue
            before = problems.get(problem.key)
            # Each branch of a union that fits nowhere has its own finding.
            if before is None or before.valid == problem.valid:
                problems[problem.key] = problem
            else:
                valid = f"{before.valid} or {problem.valid}"
                problems[problem.key] = replace(problem, valid=valid)
        raise BadInputError(list(problems.values())) from None


def _without_removed(tree: Tree, items: Iterable[Any], above: str) -> Tree | None:
    """The tree without keys that are no more and state what holds now; None where it has none."""
    left = None
    for item in items:
        parts = _key_parts(tree, item["loc"], False)
        if item["type"] == "extra_forbidden" and holds_anyway([above, *parts], item["input"]):
            left = copy.deepcopy(tree) if left is None else left
            section: Any = left
            for part in parts[:-1]:
                section = section[int(part) if isinstance(section, list) else part]
            del section[parts[-1]]
    return left


def _is_beside_the_point(item: Any, key: str, findings: list[tuple[Any, Problem]]) -> bool:
    """Whether a finding only follows from others."""
    if item["type"] == "too_short":
        # Entries that are wrong themselves are missing from pydantic's count.
        return bool(len(item["input"]) >= item["ctx"]["min_length"])
    # A union's other branch got further: into the value, or to a model's own rule (no url).
    return item["type"] in ("tuple_type", "model_type", "string_type", "literal_error") and any(
        p.key.startswith(f"{key}.") or (p.key == key and "url" not in other)
        for other, p in findings
    )


def _key_parts(tree: Any, location: tuple[int | str, ...], is_missing: bool) -> list[str]:
    """Key path of a finding: pydantic's location without the names of union branches."""
    parts = []
    for n, part in enumerate(location):
        if isinstance(tree, dict) and part in tree:
            tree = tree[str(part)]
        elif isinstance(tree, list | tuple) and isinstance(part, int) and part < len(tree):
            tree = tree[part]
        elif not (is_missing and n == len(location) - 1):
            continue
        parts.append(str(part))
    return parts


def _problem(model: type[BaseModel], tree: Tree, item: Any, origin: Origin, above: str) -> Problem:
    context, is_missing = item.get("ctx", {}), item["type"] == "missing"
    lacks_entry = is_missing and isinstance(item["loc"][-1], int)
    parts = _key_parts(tree, item["loc"], is_missing and not lacks_entry)
    key = ".".join(([above] if above else []) + parts) or "file"
    value = None if is_missing and not lacks_entry else item.get("input")
    tag = [str(context["tag"])] if item["type"] == "union_tag_invalid" else []
    instead = instead_of([above, *parts, *tag])
    valid = _valid(model, tree, context, item, parts, instead)
    return Problem(key, value, valid, origin.file_of(key))


def _valid(
    model: type[BaseModel], tree: Tree, context: Any, item: Any, parts: list[str], instead: str
) -> str:
    kind = item["type"]
    if kind == "too_long" or (kind == "missing" and isinstance(item["loc"][-1], int)):
        lengths = standing_lengths(model, tree, parts)
        if lengths:  # nothing where another branch of a union takes as many
            several = f"a list of {' or '.join(map(str, lengths))} entries"
            return "" if len(item["input"]) in lengths else several
    if kind in ("extra_forbidden", "union_tag_invalid") and instead:
        return instead
    if kind == "extra_forbidden":
        keys = standing_keys(model, tree, parts[:-1])
        near = difflib.get_close_matches(parts[-1], keys, n=1, cutoff=0.5)
        hint = f" (did you mean {near[0]}?)" if near else ""
        return f"one of the keys {', '.join(sorted(keys)) or '(none)'}{hint}"
    kinds = standing_kinds(model, tree, parts) if kind == "union_tag_not_found" else []
    keys = standing_keys(model, tree, parts) if kind == "model_type" else []
    of_keys = f": {', '.join(keys)}" if 0 < len(keys) <= MOST_KEYS else ""
    limit = next((context[k] for k in ("gt", "ge", "lt", "le") if k in context), None)
    limit = f"{limit:g}" if isinstance(limit, float) else limit
    expected = str(context.get("expected"))
    words = {
        "missing": "a value: this key must be given",
        "greater_than": f"a number greater than {limit}",
        "greater_than_equal": f"a number of at least {limit}",
        "less_than": f"a number less than {limit}",
        "less_than_equal": f"a number of at most {limit}",
        "finite_number": "a finite number",
        "float_type": "a number",
        "float_parsing": "a number",
        "int_type": "a whole number",
        "int_parsing": "a whole number",
        "int_from_float": "a whole number",
        "bool_type": "true or false",
        "bool_parsing": "true or false",
        "string_type": "text",
        "tuple_type": "a list",
        "list_type": "a list",
        "dict_type": "a mapping",
        "model_type": f"a mapping of keys to values{of_keys}",
        "model_attributes_type": "a mapping of keys to values",
        "too_short": f"a list of at least {context.get('min_length')} entries",
        "too_long": f"a list of at most {context.get('max_length')} entries",
        "literal_error": f"one of {expected}" if " or " in expected else expected,
        "union_tag_invalid": f"a kind among {context.get('expected_tags')}",
        "union_tag_not_found": f"a mapping with a kind: {', '.join(kinds)}",
        "string_pattern_mismatch": f"text of the pattern {context.get('pattern')}",
    }
    valid = words.get(kind, str(item["msg"]))
    given = item.get("input")
    if isinstance(given, str):
        if kind in ("float_type", "int_type"):
            units = [unit for unit in units_at(model, ".".join(parts)) if unit != "1"]
            valid += f" in {' or '.join(units)}" if units else ""
            valid += f": {told}" if (told := number_of(given, units)) else ""
        elif kind == "model_type" and "measure" in keys:
            valid += f", such as {{measure: {given}}}"
        elif kind == "literal_error" and (new := called(parts[-1], given)):
            valid += f"; {given} is called {new}"
    return valid
