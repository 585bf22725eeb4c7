"""Columns of the log that a deck of the user's own must print: told before or after one run."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from sandmould.bad_input import Problem
from sandmould.scenario.own_deck import CLOCK, OwnDeck

_HIDES = ("include", "jump", "python", "shell", "partition")
"""Commands behind which a deck may print what its text does not show."""
_OF_USER = re.compile(r"^[vcf]_\w+$")
"""A column that LAMMPS heads as the deck names it."""
_HEADINGS = {
    "ke": "KinEng",
    "pe": "PotEng",
    "etotal": "TotEng",
    "vol": "Volume",
    "cpu": "CPU",
}
"""Of keywords that LAMMPS does not head by their own name with a capital."""


def column_problems(scenario: OwnDeck, deck: str) -> Iterator[Problem]:
    """Tell columns that a rendered deck, by its text alone, will not print.

    ``deck``: as the engine reads it at the beginning.
    """
    printed = _printed(deck)
    if printed is None:
        return
    if "time" not in printed:
        valid = "a deck that prints the time: thermo_style custom step time ..."
        yield Problem("template", scenario.template, valid)
    for name, column in scenario.columns.items():
        # LIGGGHTS heads columns by other names, and so do all engines those of their own.
        if scenario.engine.name != "lammps":
            continue
        if _OF_USER.match(column) and column not in printed:
            valid = f"a column that the deck prints: {', '.join(printed)}"
            yield Problem(f"measures.{name}", column, valid)
        elif column in printed and not _OF_USER.match(column):
            heading = _HEADINGS.get(column, column.capitalize())
            yield Problem(f"measures.{name}", column, f"its heading, {heading}")


def _printed(deck: str) -> list[str] | None:
    """Words of all ``thermo_style custom`` of a deck; None where its text does not show them."""
    words: list[str] = []
    for line in _commands(deck):
        command, *rest = line
        if _hides(line) or (command == "thermo_modify" and {"line", "colname"} & set(rest)):
            return None
        if command == "thermo_style":
            if rest[:1] != ["custom"] or any("$" in word or "*" in word for word in rest):
                return None
            words += [word for word in rest[1:] if word not in words]
    return words or None


def _hides(line: list[str]) -> bool:
    """Whether a command reads what the text does not show; an ``if`` by one of its own, or prints.

    A jump within the file hides nothing.
    """
    command, *rest = line
    if command == "if":
        words = [word.strip("\"'") for word in rest]
        prints = any(word.startswith("thermo") for word in words)
        return prints or any(_hides(words[k:]) for k in range(len(words)))
    return command in _HIDES and (command, *rest[:1]) != ("jump", "SELF")


def _commands(deck: str) -> Iterator[list[str]]:
    """Words of each command of a deck, lines that go on joined and comments left out."""
    for line in re.sub(r"&[ \t]*\n", " ", deck).splitlines():
        if words := line.partition("#")[0].split():
            yield words


def missing_columns(scenario: OwnDeck, columns: Sequence[str]) -> str:
    """Say which columns a log lacks, or nothing."""
    wanted = {"the time": CLOCK, **{f"measures.{n}": c for n, c in scenario.columns.items()}}
    lacks = [f"{column} ({what})" for what, column in wanted.items() if column not in columns]
    if not lacks:
        return ""
    has = ", ".join(columns) or "no table"
    return f"the deck's log lacks the column {', '.join(lacks)}: it has {has}."
