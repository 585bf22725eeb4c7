"""The questions of ``sandmould new``: asked in turn, those left out that an option answers."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any, get_args

import typer

from sandmould.bad_input import BadInputError, Problem
from sandmould.reference.new_answers import (
    HELD,
    HOLES,
    WHY_HELD,
    NewStudy,
    applies,
    engines,
    fault,
    finer_scale,
    number_in,
    plain,
    sands,
)

_MEANINGS = {"hold": HELD, "cavity": HOLES}
"""What each choice of a question means, printed before it."""


def answers(given: Mapping[str, Any], ask: bool) -> NewStudy:
    """Ask what no option answers.

    Parameters
    ----------
    given : mapping
        Answers by question; ``None`` where no option was given.
    ask : bool
        Whether to ask at all; defaults otherwise.

    Raises
    ------
    BadInputError
        When an option cannot be used, or belongs to another answer.
    """
    options = {name: value for name, value in given.items() if value is not None}
    if ask:
        typer.echo(WHY_HELD)
    known: dict[str, Any] = {}
    for name in NewStudy.model_fields:
        of = {key: known.get(key, options.get(key, _default(key))) for key in ("hold", "cavity")}
        if not applies(name, **of):
            if name in options:
                hold, cavity = of["hold"], of["cavity"]
                other = f"--cavity {cavity}" if applies(name, hold, "") else f"--hold {hold}"
                sentence = f"leave {_option(name)} out with {other}"
                problem = Problem(_option(name), options[name], "absent", sentence=sentence)
                raise BadInputError([problem])
        elif name in options:
            value, valid = _tried(name, str(options[name]), known)
            if valid:
                raise BadInputError([Problem(_option(name), options[name], valid)])
            known[name] = value
        elif ask:
            known[name] = _asked(name, known)
        elif valid := fault(name, plain(known)):
            default = _proposed(name, plain(known))
            raise BadInputError([Problem(f"{_option(name)} (its default)", default, valid)])
    return plain(known)


def _asked(name: str, known: Mapping[str, Any]) -> Any:
    for choice, meaning in _MEANINGS.get(name, {}).items():
        typer.echo(f"  {choice:12}  {meaning}")
    field, before = NewStudy.model_fields[name], plain(known)
    of_house = {"material": sands, "engine": engines}.get(name)
    among = of_house() if of_house else _choices(name)
    unit = "" if _unit(name) == "1" else f", {_unit(name)}"
    listed = f" ({', '.join(among)})" if among else ""
    if name == "size_scale" and (finer := finer_scale(before)):
        typer.echo(f"The hole is five of the largest grains wide, or more, up to {finer:g}.")

    def checked(text: str) -> Any:
        value, valid = _tried(name, text, known)
        if valid:
            raise typer.BadParameter(f"valid is {valid}")
        return value

    proposed = _proposed(name, before)
    return typer.prompt(
        f"{field.description}{unit}{listed}",
        default="" if proposed is None else f"{proposed}",
        show_default=proposed is not None,
        value_proc=checked,
    )


def _proposed(name: str, before: NewStudy) -> Any:
    """What is taken unless something else is answered."""
    follow = {"hole_height_mm": before.middle_mm, "sand_height_mm": before.level_mm}
    return f"{follow[name]:.6g}" if name in follow else _default(name)


def _tried(name: str, text: str, known: Mapping[str, Any]) -> tuple[Any, str]:
    """An answer with its type, and what is valid where it cannot be used."""
    if text == "" and _default(name) is None:
        return None, ""
    value: Any = text
    if not _choices(name) and str not in _types(name):
        with contextlib.suppress(ValueError):
            value = number_in(text, _unit(name))
            if int in _types(name) and value == int(value):
                value = int(value)
    try:
        found = plain({**known, name: value})
    except BadInputError as error:
        valid = error.problems[0].valid
        example = _unit(name) in ("mm", "mm/s") and valid.startswith("a number")
        return value, valid + (" or with its unit" if example else "")
    return value, fault(name, found)


def _types(name: str) -> tuple[Any, ...]:
    annotation = NewStudy.model_fields[name].annotation
    return (annotation, *get_args(annotation))


def _choices(name: str) -> list[str]:
    return [part for part in _types(name) if isinstance(part, str)]


def _unit(name: str) -> str:
    extra: Any = NewStudy.model_fields[name].json_schema_extra
    return str(extra["unit"])


def _default(name: str) -> Any:
    return NewStudy.model_fields[name].default


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"
