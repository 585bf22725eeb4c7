"""Typed sections whose every field states its unit, its source and what it means."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Section(BaseModel):
    """A part of a scenario: unknown keys are refused, values never change once read."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, validate_default=True
    )


def quantity(default: Any, description: str, *, unit: str = "1", source: str, **limits: Any) -> Any:
    """Declare a field with its unit and the source of its default.

    Parameters
    ----------
    default : any
        Default value; ``...`` when the user must give one.
    description : str
        What the value means, in one sentence.
    unit : str
        SI unit as written in decks and the schema; ``1`` for a pure number.
    source : str
        Where the default comes from.
    **limits
        Constraints of ``pydantic.Field``, such as ``gt=0``.
    """
    return Field(
        default,
        description=description,
        json_schema_extra={"unit": unit, "source": source},
        **limits,
    )
