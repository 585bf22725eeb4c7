"""Lines of a deck that a person should read before running it.

A help for the eye, no protection: a deck can do the same in words that are not listed here.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from sandmould.kinds.deck.own.deck import RESTART_FILES, names_used, render, template_text
from sandmould.scenario.own_deck import OwnDeck

LARGEST_BYTES = 1_000_000
"""Of a file beside the template; larger ones hold data, and are named instead."""
MOST_LINES = 30
_COMMANDS = {
    "shell": "runs a command of the system",
    "python": "runs Python",
    "plugin": "loads a compiled library",
    "include": "reads further commands from a file",
    "jump": "goes on reading in a file",
    "kim": "loads a model from a library",
    "geturl": "fetches a file from the network",
    "mdi": "talks to another program",
    "message": "talks to another program",
}
_STYLES = {
    "python": "runs Python",
    "python/invoke": "runs Python",
    "python/move": "runs Python",
    "movie": "starts a program that makes a film",
    "imd": "opens a port of the network",
    "plumed": "runs a script of PLUMED",
    "getenv": "reads the environment",
    "client/md": "talks to another program",
}
_PACKED = re.compile(r"\.(gz|bz2|zst|xz|lzma|lz4)$")
_OUTSIDE = re.compile(r"^[/~].|(^|[=/])\.\.(/|$)")
_WORD = re.compile(r'"""(.*?)"""|"([^"]*)"|\'([^\']*)\'|(\S+)', re.DOTALL)
_STATEMENT = re.compile(r"\{%.*?%\}|\{#.*?#\}", re.DOTALL)
_GIVEN = "{{...}}"
"""Stands for what Jinja puts in."""
_VALUE = re.compile(r"\{\{.*?\}\}", re.DOTALL)


@dataclass(frozen=True)
class Finding:
    """A line to look at."""

    file: str
    line: int
    """Counted from 1."""
    command: str
    why: str

    def __str__(self) -> str:
        shown = "".join(c if c.isprintable() else " " for c in self.command)
        shown = shown if len(shown) <= 80 else f"{shown[:77]}..."
        return f"{self.file}, line {self.line}: {shown} ({self.why})"


def to_read(scenarios: Iterable[OwnDeck]) -> list[str]:
    """List the lines to look at in templates, further files, and decks as they are rendered.

    ``scenarios``: one of each point of a study; all can be rendered.

    Gives the first ``MOST_LINES``, and how many there are beyond.
    """
    found: dict[str, None] = {}
    seen: set[str] = set()
    for scenario in scenarios:
        for name, path in scenario.paths.items():
            if name not in seen:
                seen.add(name)
                found |= dict.fromkeys(_of_file(path, scenario.template == name))
        known = _known(template_text(scenario))
        goes_on = "restart" in names_used(scenario)
        for restart in ("", f"../{RESTART_FILES[0]}") if goes_on else ("",):
            text = render(scenario, "run", "study", restart)
            rest = [
                f for f in findings("the rendered deck", text) if not known.fullmatch(f.command)
            ]
            found |= dict.fromkeys(map(str, rest))
    lines = list(found)
    more = [f"... and {len(lines) - MOST_LINES} more lines"] if len(lines) > MOST_LINES else []
    return lines[:MOST_LINES] + more


def _known(template: str) -> re.Pattern[str]:
    """What the lines of a template that are listed can become; not those that can become any."""
    listed = {f.command for f in findings("", template, is_template=True)}
    fixed = [c for c in listed if _GIVEN not in c.split()[0]]
    ways = ["[^\n]*".join(map(re.escape, c.split(_GIVEN))) for c in fixed]
    return re.compile("|".join(ways) or r"(?!)")


def _of_file(path: Path, is_template: bool) -> Iterator[str]:
    size = path.stat().st_size
    if size > LARGEST_BYTES and not is_template:
        yield f"{path.name}: {size:,} bytes, too long to be looked through"
        return
    text = path.read_text(encoding="utf-8", errors="replace")
    yield from map(str, findings(path.name, text, is_template))


def findings(file: str, text: str, is_template: bool = False) -> Iterator[Finding]:
    """Find commands that reach beyond the run's folder, or may.

    ``is_template``: whether Jinja's statements stand in it.
    """
    if is_template:
        text = _STATEMENT.sub(lambda m: "\n" * m[0].count("\n"), text)
        text = _VALUE.sub(lambda m: _GIVEN + "\n" * m[0].count("\n"), text)
    for number, command in _commands(text):
        words = [next(w for w in m.groups() if w is not None) for m in _WORD.finditer(command)]
        if reasons := list(dict.fromkeys(_reasons(words))):
            yield Finding(file, number, " ".join(command.split()), "; ".join(reasons))


def _commands(text: str) -> Iterator[tuple[int, str]]:
    """Commands with the numbers of their first lines: as engines join lines, without comments."""
    begun, joined = 1, ""
    for number, line in enumerate(text.split("\n"), start=1):
        joined += line
        bare = joined.rstrip()
        if bare.endswith("&"):
            joined = bare[:-1] + " "
            continue
        if joined.count('"""') % 2:
            joined += "\n"
            continue
        if command := _without_comment(joined).strip():
            yield begun, command
        begun, joined = number + 1, ""
    if joined.strip():
        yield begun, joined


def _without_comment(line: str) -> str:
    quote = ""
    for place, letter in enumerate(line):
        if letter in "\"'" and quote in ("", letter):
            quote = "" if quote else letter
        elif letter == "#" and not quote:
            return line[:place]
    return line


def _reasons(words: list[str]) -> Iterator[str]:
    first = words[0]
    if "$" in first or _GIVEN in first:
        yield "its first word is a value"
    if first in _COMMANDS:
        yield _COMMANDS[first]
    holds_commands = first in ("if", "partition")
    for before, word in itertools.pairwise(words):
        # a word in quotes may be a command: that of an if, or of a run that stops now and then
        inner = next(iter(word.split()), "")
        if inner in _COMMANDS and (" " in word or holds_commands):
            yield _COMMANDS[inner]
        elif word in _STYLES:
            yield _STYLES[word]
        is_condition = before in ("if", "elif")
        if ("$" in inner or _GIVEN in inner) and holds_commands and not is_condition:
            yield "a command in it begins with a value"
    for word in " ".join(words).split():
        if _OUTSIDE.search(word) and word not in [f"../{name}" for name in RESTART_FILES]:
            yield "names a file outside of the run's folder"
        if "://" in word:
            yield "names an address of the network"
        if _PACKED.search(word):
            yield "starts a program that packs or unpacks a file"
