"""Tables that thousands of runs left, read as one."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.plain_file import UNREADABLE
from sandmould.runs.manifest import MANIFEST_FILE, read_manifest

PLACE = "place of the file"
"""Column of a joined table: the place of a row's file among those that were read."""


def problem_text(name: str, error: Exception) -> str:
    """Say that a file cannot be read, and why."""
    reason = " ".join(str(error).split())[:200]
    return f"{name} cannot be read ({type(error).__name__}: {reason})."


@dataclass(frozen=True)
class RunTables:
    """Tables of many runs, one after the other."""

    rows: pd.DataFrame
    """All rows in the order of the files, with their ``PLACE``."""
    columns: dict[int, tuple[str, ...]]
    """Columns of each file that was read, by its place."""
    problems: dict[int, str]
    """Why a file that is there cannot be read, by its place."""

    def bounds(self, files: int) -> NDArray[np.int64]:
        """Rows of file i go from the i-th to the next of these, (files + 1,) int64."""
        return np.searchsorted(self.rows[PLACE].to_numpy(), np.arange(files + 1))


def read_tables(
    paths: Sequence[Path], check: Callable[[pd.DataFrame], pd.DataFrame] = lambda table: table
) -> RunTables:
    """Read a table of every run; files that are missing have no rows.

    Files with one head are parsed together, since a reader for each costs far more than its rows.
    A file that may need a reader of its own, such as one that was cut short, gets it.

    ``check``: gives a table as it is kept; raises what a file cannot be read for.
    """
    alike: dict[str, list[tuple[int, str]]] = {}
    alone: list[int] = []
    for place, path in enumerate(paths):
        try:
            head, _, body = path.read_bytes().decode().partition("\n")
        except FileNotFoundError:
            continue
        except (OSError, ValueError):
            alone.append(place)
            continue
        if _is_plain(head, body):
            alike.setdefault(head, []).append((place, body))
        else:
            alone.append(place)
    parts: list[tuple[int, pd.DataFrame]] = []
    for head, files in alike.items():
        try:
            parts.append((files[0][0], check(_parse_alike(head, files))))
        except UNREADABLE:
            alone += [place for place, _ in files]
    problems = {}
    for place in alone:
        try:
            table = check(pd.read_csv(paths[place], sep="\t"))
            parts.append((place, table.assign(**{PLACE: place})))
        except UNREADABLE as error:
            problems[place] = problem_text(paths[place].name, error)
    return _joined(parts, problems)


def _is_plain(head: str, body: str) -> bool:
    """Whether a line is a row and a tab parts two cells, as many in each row as in the head."""
    if not head.strip() or '"' in head or '"' in body or "\r" in body or "\r" in head:
        return False
    tabs = head.count("\t")
    return all(line.count("\t") == tabs and line for line in body.removesuffix("\n").split("\n"))


def _parse_alike(head: str, files: Sequence[tuple[int, str]]) -> pd.DataFrame:
    """Parse the rows of files with one head together."""
    bodies = [body if body.endswith("\n") else f"{body}\n" for _, body in files]
    text = f"{head}\n{''.join(bodies)}"
    table = pd.read_csv(io.StringIO(text), sep="\t", low_memory=False)
    places = np.repeat([place for place, _ in files], [body.count("\n") for body in bodies])
    return table.assign(**{PLACE: places})


def _joined(parts: list[tuple[int, pd.DataFrame]], problems: dict[int, str]) -> RunTables:
    """All parts as one table, rows in the order of the files."""
    parts.sort(key=lambda part: part[0])
    columns: dict[int, tuple[str, ...]] = {}
    for first, table in parts:
        own = tuple(str(c) for c in table.columns if c != PLACE)
        columns |= dict.fromkeys([first, *table[PLACE].unique().tolist()], own)
    rows = pd.DataFrame({PLACE: np.zeros(0, dtype=np.int64)})
    if parts:
        rows = pd.concat([table for _, table in parts], ignore_index=True)
    order = np.argsort(rows[PLACE].to_numpy(), kind="stable")
    return RunTables(rows.take(order).reset_index(drop=True), columns, problems)


def read_costs(folders: Sequence[Path]) -> RunTables:
    """Read the cost row of every run; folders without one have none."""
    rows, columns, problems = [], dict[int, tuple[str, ...]](), dict[int, str]()
    for place, folder in enumerate(folders):
        try:
            cost = read_manifest(folder).get("cost")
        except FileNotFoundError:
            continue
        except UNREADABLE as error:
            problems[place] = problem_text(MANIFEST_FILE, error)
            continue
        if cost:
            rows.append({**cost, PLACE: place})
            columns[place] = tuple(cost)
    return RunTables(pd.DataFrame(rows, columns=None if rows else [PLACE]), columns, problems)
