"""What the keys of a study's file mean: the text of ``sandmould keys``."""

from __future__ import annotations

import difflib
import json
import textwrap
from collections.abc import Iterator, Sequence
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from sandmould.bad_input import BadInputError, Problem
from sandmould.kinds.registry import KINDS
from sandmould.scenario.quantity import NAME, fields_at, keys_at, models_at, models_in

_WIDTH = 100


def keys_text(path: str = "") -> str:
    """Describe the keys below a path, or the one key that it names.

    Parameters
    ----------
    path : str
        Such as ``scenario.vibration``; places in lists may stand in it or not. Empty for those of
        a study.

    Raises
    ------
    BadInputError
        Where no kind of study has such a key; it gives the nearest ones.
    """
    parts = [part for part in path.split(".") if part and not part.isdecimal()]
    sections = _sections(parts)
    if sections:
        return "\n".join(_of_sections(sections, ".".join(parts))).strip()
    fields = {f.description: f for kind in KINDS.values() for f in fields_at(kind.study, path)}
    if not fields:
        raise BadInputError([Problem("PATH", path, _nearest(parts))])
    return "\n".join(line for field in fields.values() for line in _of_key(parts[-1], field))


def key_paths(start: str) -> list[str]:
    """Key paths that begin so, one level deep, for the shell to complete.

    Parameters
    ----------
    start : str
    """
    above, _, last = start.rpartition(".")
    parts = [part for part in above.split(".") if part and not part.isdecimal()]
    keys = {key for kind in KINDS.values() for key in keys_at(kind.study, parts)}
    return [f"{above}.{key}".lstrip(".") for key in sorted(keys) if key.startswith(last)]


def _sections(parts: list[str]) -> list[tuple[str, type[BaseModel]]]:
    """Sections that can stand at a path, with the kinds of study that have them."""
    found: dict[type[BaseModel], list[str]] = {}
    for name, kind in KINDS.items():
        for model in models_at(kind.study, parts):
            found.setdefault(model, []).append(name)
    return [(" or ".join(kinds), model) for model, kinds in found.items()]


def _of_sections(sections: list[tuple[str, type[BaseModel]]], path: str) -> Iterator[str]:
    shown: set[str] = set()
    for kinds, model in sections:
        of = f"kind: {_kind_of(model)}" if _kind_of(model) else f"studies of kind {kinds}"
        where = path or "a study"
        yield f"\nKeys of {where} ({of}):\n" if len(sections) > 1 else f"Keys of {where}:\n"
        for name, field in model.model_fields.items():
            lines = _of_key(name, field)
            if path or lines[0] not in shown:  # kinds of study share most of their keys
                yield from lines
            shown.add(lines[0])
    below = [name for _, model in sections for name, field in model.model_fields.items()
             if any(True for _ in models_in(field.annotation))]  # fmt: skip
    if below:
        first = ".".join(filter(None, (path, below[0])))
        yield f"\nKeys with ... have keys below them: sandmould keys {first}"


def keys_lines() -> Iterator[str]:
    """A page of all keys: a heading a section, a row a key."""
    shown: set[type[BaseModel]] = set()
    for kind in KINDS.values():
        yield from ("", f"## Studies of kind {kind.name}")
        yield from _section_lines(kind.study, "", shown)


def _section_lines(model: type[BaseModel], path: str, shown: set[type[BaseModel]]) -> Iterator[str]:
    """A section and then those below it, each at the first path that leads to it."""
    shown.add(model)
    of = f" (`kind: {_kind_of(model)}`)" if path and _kind_of(model) else ""
    yield from ("", f"### {f'`{path}`' if path else 'The file'}{of}", "")
    yield from ("| key | unit | default | valid | meaning | source |", "|" + " --- |" * 6)
    below = []
    for name, field in model.model_fields.items():
        extra: Any = field.json_schema_extra or {}
        cells = (
            f"`{name}`", _unit_cell(field), _default_cell(field), _valid_cell(field),
            _meaning_cell(field), extra.get("source", ""),
        )  # fmt: skip
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
        below += [(f"{path}.{name}".lstrip("."), inner) for inner in models_in(field.annotation)]
    for inner_path, inner in below:
        if inner not in shown:
            yield from _section_lines(inner, inner_path, shown)


def _unit_cell(field: FieldInfo) -> str:
    """Unit of a number; nothing for words and for yes and no."""
    extra: Any = field.json_schema_extra or {}
    unit = str(extra.get("unit", ""))
    types = (field.annotation, *get_args(field.annotation))
    return "" if unit == "1" and not {int, float} & set(_leaf_types(types)) else unit


def _leaf_types(types: Sequence[Any]) -> Iterator[Any]:
    for each in types:
        yield type(each) if isinstance(each, int) and not isinstance(each, bool) else each
        yield from _leaf_types(get_args(each))


def _default_cell(field: FieldInfo) -> str:
    if any(True for _ in models_in(field.annotation)) and not field.is_required():
        return "" if field.default is not None else "absent"
    text = _default_text(field)
    return f"`{text.removeprefix('default ')}`" if text.startswith("default ") else text


def _meaning_cell(field: FieldInfo) -> str:
    """What a key means; each choice that is explained begins a line."""
    text = field.description or ""
    for choice in (*_choices_in(field.annotation), "true", "false", "null"):
        text = text.replace(f" {choice}: ", f"<br>`{choice}`: ")
        if text.startswith(f"{choice}: "):
            text = f"`{choice}`{text.removeprefix(choice)}"
    return text


_BOUNDS = {"gt": "> ", "ge": "≥ ", "lt": "< ", "le": "≤ "}


def _valid_cell(field: FieldInfo) -> str:
    """Choices of words, and bounds of numbers or of their count."""
    told = [f"`{value}`" for value in _choices_in(field.annotation)]
    for rule in field.metadata:
        told += [f"{sign}{getattr(rule, name):g}" for name, sign in _BOUNDS.items()
                 if isinstance(getattr(rule, name, None), int | float)]  # fmt: skip
        lengths = (("min_length", "at least"), ("max_length", "at most"))
        told += [f"{w} {getattr(rule, name)} of them" for name, w in lengths if hasattr(rule, name)]
        if getattr(rule, "pattern", None) == NAME:
            told.append("small letters, digits and `_`")
    return ", ".join(told)


def _choices_in(annotation: Any) -> Iterator[Any]:
    if get_origin(annotation) is Literal:
        yield from get_args(annotation)
        return
    for part in get_args(annotation):
        yield from _choices_in(part)


def _kind_of(model: type[BaseModel]) -> str:
    """The value of ``kind`` that chooses a section among others; empty where there is none."""
    field = model.model_fields.get("kind")
    only = get_args(field.annotation) if field and get_origin(field.annotation) is Literal else ()
    return str(only[0]) if len(only) == 1 else ""


def _of_key(name: str, field: FieldInfo) -> list[str]:
    extra: Any = field.json_schema_extra or {}
    unit = extra.get("unit", "1")
    about = [] if unit == "1" else [f"in {unit}"]
    choices = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
    if len(choices) > 1:
        about.append(f"one of {', '.join(map(str, choices))}")
    about.append(_default_text(field))
    below = " ..." if any(True for _ in models_in(field.annotation)) else ""
    facts = "; ".join(filter(None, about))
    first = f"  {name}{below}" + (f"  ({facts})" if facts else "")
    meaning = textwrap.wrap(
        field.description or "", _WIDTH, initial_indent="      ", subsequent_indent="      "
    )
    return [first, *meaning]


def _default_text(field: FieldInfo) -> str:
    if field.is_required():
        only = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
        return f"must be {only[0]}" if len(only) == 1 else "must be given"
    if field.default is PydanticUndefined or isinstance(field.default, BaseModel):
        return ""
    if field.default is None:
        return "absent unless given"
    return f"default {json.dumps(field.default, default=str)}"


def _nearest(parts: list[str]) -> str:
    """The keys that could have been meant at the first part that is wrong."""
    for depth, part in enumerate(parts):
        keys = sorted(
            {key for kind in KINDS.values() for key in keys_at(kind.study, parts[:depth])}
        )
        if part not in keys:
            near = difflib.get_close_matches(part, keys, n=3, cutoff=0.4) or keys
            above = ".".join(parts[:depth])
            return f"a key of {above or 'a study'}, such as {', '.join(near[:8])}"
    return f"a path of keys, such as {'.'.join(parts[:-1])}"
