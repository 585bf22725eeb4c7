"""The questions of ``sandmould new``: asked in turn, those left out that an option answers."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, get_args

import typer

from sandmould.scenario.bad_input import BadInputError, Problem
from sandmould.scenario.reading import Origin, validated
from sandmould.study.new_study import HELD, WHY_HELD, NewStudy, applies


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
    known = {name: value for name, value in given.items() if value is not None}
    _checked(known)
    if ask:
        typer.echo(WHY_HELD)
        for held, drive in HELD.items():
            typer.echo(f"  {held:12}  {drive}")
    for name in NewStudy.model_fields:
        hold, cavity = (known.get(key, _default(key)) for key in ("hold", "cavity"))
        if not applies(name, hold, cavity):
            if name in known:
                other = f"--cavity {cavity}" if applies(name, hold, "") else f"--hold {hold}"
                sentence = f"leave {_option(name)} out with {other}"
                problem = Problem(_option(name), known[name], "absent", sentence=sentence)
                raise BadInputError([problem])
        elif ask and name not in known:
            known[name] = _asked(name)
    found = _checked(known)
    if found.lowest_hz >= found.highest_hz:
        raise BadInputError([Problem("--lowest-hz", found.lowest_hz, "less than --highest-hz")])
    return found


def _asked(name: str) -> Any:
    field = NewStudy.model_fields[name]
    extra: Any = field.json_schema_extra
    unit = "" if extra["unit"] == "1" else f", in {extra['unit']}"
    among = f" ({', '.join(_choices(name))})" if _choices(name) else ""
    return typer.prompt(
        f"{field.description}{unit}{among}",
        default="" if field.default is None else field.default,
        show_default=field.default is not None,
        value_proc=lambda text: _value(name, text),
    )


def _value(name: str, text: str) -> Any:
    """An answer with its type; what cannot be used is asked again."""
    if text == "":
        return None
    value: Any = text
    if not _choices(name) and str not in _types(name):
        with contextlib.suppress(ValueError):
            value = int(text) if int in _types(name) else float(text)
    try:
        _checked({name: value})
    except BadInputError as error:
        raise typer.BadParameter(f"valid is {error.problems[0].valid}") from None
    return value


def _checked(known: Mapping[str, Any]) -> NewStudy:
    try:
        return validated(NewStudy, dict(known), Origin())
    except BadInputError as error:
        raise BadInputError([replace(p, key=_option(p.key)) for p in error.problems]) from None


def _types(name: str) -> tuple[Any, ...]:
    annotation = NewStudy.model_fields[name].annotation
    return (annotation, *get_args(annotation))


def _choices(name: str) -> list[str]:
    return [part for part in _types(name) if isinstance(part, str)]


def _default(name: str) -> Any:
    return NewStudy.model_fields[name].default


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"
