"""The templates of sentences, of ``templates/wording``."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from sandmould import SHIPPED
from sandmould.runs.formatting import (
    display_number,
    display_range,
    listed,
    name_of,
    number,
    opened,
    range_text,
    rounded,
    seconds,
    value_text,
    with_margin,
)

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = SHIPPED / "templates" / "wording"


class Note(NamedTuple):
    """What a plan or a report tells beside its figures."""

    about: str
    text: str


@cache
def _environment() -> Environment:
    from jinja2 import FileSystemLoader, StrictUndefined  # a plan is checked without words
    from jinja2.sandbox import ImmutableSandboxedEnvironment

    from sandmould.kept_templates import kept_templates

    environment = ImmutableSandboxedEnvironment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        bytecode_cache=kept_templates(),
    )
    filters = (listed, number, opened, rounded, seconds)
    environment.filters |= {it.__name__: it for it in filters} | {"name": name_of}
    called = (display_number, display_range, range_text, value_text, with_margin)
    environment.globals |= {it.__name__: it for it in called}
    return environment


def worded(template: str, **values: Any) -> str:
    """Text of a template on one line; a missing value is an error."""
    return _on_one_line(_environment().get_template(template).render(values))


def sentences(template: str, **values: Any) -> tuple[str, ...]:
    """Texts of a template that writes one a line, without those that are empty."""
    lines = _environment().get_template(template).render(values).splitlines()
    return tuple(text for line in lines if (text := _on_one_line(line)))


def notes(template: str, **values: Any) -> tuple[Note, ...]:
    """What a template tells, a note a line: what it is about, a colon, and the text."""
    parts = (line.partition(": ") for line in sentences(template, **values))
    return tuple(Note(about, text) for about, _, text in parts)


def _on_one_line(text: str) -> str:
    """Text without breaks and double blanks; those inside of numbers stay, which do not break."""
    return re.sub("[ \n]+", " ", text).strip()
