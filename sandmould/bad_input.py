"""What is wrong with a file of the user's, in one sentence a finding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandmould import SHIPPED

BAD_INPUT_EXIT = 78
"""Exit status of a workflow that has said what is wrong with its input (EX_CONFIG, sysexits.h)."""


@dataclass(frozen=True)
class Problem:
    """One value that cannot be used."""

    key: str
    """Key path, such as ``sand.density_kg_m3``."""
    value: Any
    valid: str
    """What would be valid, such as 'a number greater than 0'."""
    file: str = ""
    sentence: str = ""
    """In place of key, value and what is valid, where these say less."""

    def __str__(self) -> str:
        where = f"{self.file}: " if self.file else ""
        if self.sentence:
            return f"{where}{self.sentence}."
        value_text = repr(self.value)
        if len(value_text) > 120:
            value_text = value_text[:117] + "..."
        # An unknown key is the user's text and may hold line breaks.
        key = self.key if self.key.isprintable() else repr(self.key)
        return f"{where}{key} = {value_text} cannot be used: valid is {self.valid}."


class BadInputError(Exception):
    """A study or scenario that must not start; its text has one line a problem."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(p) for p in self.problems))


def display_path(path: Path) -> str:
    """A file's name in messages: seen from here, else from the repository, else as given."""
    for folder in (Path.cwd(), SHIPPED):
        if path.is_absolute() and path.is_relative_to(folder):
            return str(path.relative_to(folder))
    return str(path)
