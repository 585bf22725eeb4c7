"""The templates of sentences, of ``templates/wording``."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from jinja2.sandbox import ImmutableSandboxedEnvironment

from sandmould import SHIPPED
from sandmould.runs.formatting import listed, name_of, number, value_text

TEMPLATES = SHIPPED / "templates" / "wording"


@cache
def _environment() -> Environment:
    environment = ImmutableSandboxedEnvironment(
        loader=FileSystemLoader(TEMPLATES), undefined=StrictUndefined
    )
    environment.filters |= {"listed": listed, "name": name_of, "number": number}
    environment.globals["value_text"] = value_text
    return environment


def worded(template: str, **values: Any) -> str:
    """Text of a template on one line; a missing value is an error."""
    text = _environment().get_template(template).render(values)
    return " ".join(text.split())


def sentences(template: str, **values: Any) -> tuple[str, ...]:
    """Texts of a template that writes one a line, without those that are empty."""
    lines = _environment().get_template(template).render(values).splitlines()
    return tuple(text for line in lines if (text := " ".join(line.split())))
