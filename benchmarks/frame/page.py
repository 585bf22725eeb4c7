"""Pages of the documentation: Jinja templates beside the theme that fills them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

FRAME = Path(__file__).parent


def _environment(folder: Path) -> Environment:
    """Templates of a folder, with the forms of numbers that all pages use.

    ``form`` writes a number by a format of Python, ``thousands`` a whole one, ``spread`` a median
    with its range.
    """
    made = Environment(
        loader=FileSystemLoader(folder),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {"form": format, "thousands": thousands, "spread": with_range}
    made.globals["zip"] = zip
    return made


def render(template: Path, values: Mapping[str, Any]) -> str:
    """Fill a template.

    Raises
    ------
    jinja2.UndefinedError
        Where it names what it is not given.
    """
    return _environment(template.parent).get_template(template.name).render(**values)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Write a table in Markdown.

    Parameters
    ----------
    head : sequence of str
    rows : iterable of sequence of str
        Cells, as many a row as in the head.
    """
    macros = vars(_environment(FRAME).get_template("table.md.j2").module)
    return str(macros["table"](head, list(rows)))


def with_range(spread: Mapping[str, float], form: str = ".1f", unit: float = 1.0) -> str:
    """Write a median with its least and most.

    Parameters
    ----------
    spread : mapping
        The three by name.
    form : str
        Format of each.
    unit : float
        What each is divided by.
    """
    median, least, most = (format(spread[key] / unit, form) for key in ("median", "least", "most"))
    return f"{median} ({least} to {most})"


def thousands(value: float) -> str:
    """Write a number as a whole one with its thousands apart."""
    return f"{round(value):,}".replace(",", " ")
