"""Typed sections whose every field states its unit, its source and what it means."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, get_args

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

NAME = r"^[a-z][a-z0-9_]*$"
"""Pattern of names that become files, columns or labels."""
NO_DEFAULT = PydanticUndefined
"""In place of a default that there is none of."""
FIRST = "first_default"
PLANNED = "plan"
"""Source of a value that the plan of a study writes, and no user."""


class Section(BaseModel):
    """A part of a scenario: unknown keys are refused, values never change once read."""

    model_config = ConfigDict(
        defer_build=True,  # few of all models are used by one process
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        validate_default=True,
    )
    uncomputed: ClassVar[frozenset[str]] = frozenset()
    """Keys that change nothing that is computed, so that they do not tell one run from another."""


def quantity(
    default: Any,
    description: str,
    *,
    unit: str = "1",
    source: str,
    first: Any = NO_DEFAULT,
    **limits: Any,
) -> Any:
    """Declare a field with its unit and the source of its default.

    Parameters
    ----------
    default : any
        Default value; ``...`` when the user must give one.
    unit : str
        SI unit as written in decks and the schema; ``1`` for a pure number.
    first : any
        The default that the key had first, where it has another one now: results of scenes that
        leave the key alone are then those of another value, and their identity changes.
    **limits
        Constraints of ``pydantic.Field``, such as ``gt=0``.
    """
    about: dict[str, Any] = {"unit": unit, "source": source}
    return Field(
        default,
        description=description,
        json_schema_extra=about if first is NO_DEFAULT else about | {FIRST: first},
        **limits,
    )


def first_default(section: type[BaseModel], key: str) -> Any:
    """The default that a key had first: a value equal to it is left out of a scenario's hash."""
    field = section.model_fields[key]
    about = field.json_schema_extra
    if isinstance(about, dict) and FIRST in about:
        return about[FIRST]
    return _with_first_defaults(field.get_default(call_default_factory=True))


def _with_first_defaults(default: Any) -> Any:
    """A default with the first defaults of the keys that it leaves alone, at every depth."""
    if isinstance(default, tuple):
        return tuple(map(_with_first_defaults, default))
    if not isinstance(default, Section):
        return default
    section = type(default)
    unset = section.model_fields.keys() - default.model_fields_set
    # a section may set keys by itself as it is read
    left = [k for k in unset if getattr(default, k) == section.model_fields[k].get_default()]
    return default.model_copy(update={key: first_default(section, key) for key in left})


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Models that an annotation names, those inside lists and unions included."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from models_in(part)


def models_at(model: type[BaseModel], parts: list[str]) -> list[type[BaseModel]]:
    """Models that can stand at a path, list positions skipped."""
    here = [model]
    for part in (p for p in parts if not p.isdecimal()):
        here = [
            inner
            for outer in here
            if part in outer.model_fields
            for inner in models_in(outer.model_fields[part].annotation)
        ]
    return here


def keys_at(model: type[BaseModel], parts: list[str]) -> list[str]:
    """Keys that a model has at a path, list positions skipped."""
    return sorted({name for m in models_at(model, parts) for name in m.model_fields})


def fields_at(model: type[BaseModel], key: str) -> list[FieldInfo]:
    """Declarations that a key path can mean: several where kinds of obstacles share a key."""
    *parents, last = [p for p in key.split(".") if not p.isdecimal()] or [""]
    return [m.model_fields[last] for m in models_at(model, parents) if last in m.model_fields]


def units_at(model: type[BaseModel], key: str) -> list[str]:
    """Units that a key path can have."""
    extras = [f.json_schema_extra for f in fields_at(model, key)]
    return sorted({str(e["unit"]) for e in extras if isinstance(e, dict) and "unit" in e})
