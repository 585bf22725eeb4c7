"""A study that code gives as a dictionary, as the file that it is written to."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from sandmould.bad_input import BadInputError, Problem
from sandmould.scenario.yaml_text import load_users

WRITTEN_LINE = "# Written by sandmould.run, which replaces it; delete this line to keep the file."
_VALID = "a number, text, true or false, None, or a list or a dictionary of such values"


def study_text(study: Mapping[str, Any]) -> str:
    """The text of a study's file.

    ``study``: arrays and numbers of numpy are taken for what they hold.

    Raises
    ------
    BadInputError
        With one sentence for each value that no file can hold.
    """
    problems: list[Problem] = []
    tree = _plain(study, "", problems)
    if problems:
        raise BadInputError(problems)
    return f"{WRITTEN_LINE}\n{yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)}"


def write_study_file(path: Path, text: str) -> None:
    """Write a study's file, unless it is one that was written by hand.

    Raises
    ------
    BadInputError
        Where a file that was written by hand holds something else.
    """
    if path.is_file():
        before = path.read_text(encoding="utf-8", errors="replace")
        if _same(before, text, path.stem):
            return
        if not before.startswith(WRITTEN_LINE):
            valid = (
                f"another name: {path.name} holds another study, and it was not written by "
                "sandmould.run, so it is not replaced"
            )
            raise BadInputError([Problem("name", path.stem, valid)])
    path.write_text(text, encoding="utf-8")


def _same(before: str, text: str, title: str) -> bool:
    """Whether two texts hold the same study, one of them perhaps without its title."""
    try:
        return bool({"title": title} | load_users(before) == load_users(text))
    except (yaml.YAMLError, ValueError, TypeError, RecursionError, BadInputError):
        return False


def _plain(value: Any, key: str, problems: list[Problem]) -> Any:
    """A value of Python alone, copied, so that none is an alias of another."""
    if hasattr(value, "tolist"):  # arrays and numbers of numpy, columns of pandas
        value = value.tolist()
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, Mapping):
        for name in value:
            if not isinstance(name, str):
                problems.append(Problem(key or "study", name, "text as the name of a key"))
        return {name: _plain(each, _below(key, name), problems) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each, _below(key, n), problems) for n, each in enumerate(value)]
    problems.append(Problem(key, value, _VALID))
    return None


def _below(key: str, name: object) -> str:
    return f"{key}.{name}" if key else str(name)
