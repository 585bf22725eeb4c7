"""Tables and numbers of the pages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Write a table in Markdown.

    Parameters
    ----------
    head : sequence of str
    rows : iterable of sequence of str
        Cells, as many a row as in the head.
    """
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def with_range(spread: dict[str, float], form: str = ".1f", unit: float = 1.0) -> str:
    """Write a median with its least and most.

    Parameters
    ----------
    spread : dict
        The three by name, as ``benchmarks.engines_timing`` gives them.
    form : str
        Format of each.
    unit : float
        What each is divided by.
    """
    median, least, most = (format(spread[key] / unit, form) for key in ("median", "least", "most"))
    return f"{median} ({least} to {most})"


def number(value: int) -> str:
    """Write a whole number with its thousands apart."""
    return f"{value:,}".replace(",", " ")
