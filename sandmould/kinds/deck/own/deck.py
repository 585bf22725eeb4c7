"""The user's template: what keeps it from being rendered, its deck, and what that must print."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from sandmould import SHIPPED
from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.digest import digest, file_digest
from sandmould.engines.registry import engine_module
from sandmould.engines.session import Ranks
from sandmould.kinds.deck.own.template import MOST_CHARACTERS, names_in, rendered
from sandmould.scenario.own_deck import CLOCK, RESERVED, OwnDeck

DECKS = SHIPPED / "config" / "decks"
"""Decks that come with us."""
OUTPUT = "output"
"""Folder that a deck runs in; all that it writes there is kept."""
RESTART_FILES = ("restart.a", "restart.b")
"""Written in turn beside the folder that a deck runs in."""
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


def with_file_hashes(scenario: OwnDeck) -> OwnDeck:
    """The same run with the hashes of the files beside its template that can be read."""
    paths = {name: scenario.paths[name] for name in scenario.files}
    hashes = {name: file_digest(path) for name, path in paths.items() if path.is_file()}
    return scenario.model_copy(update={"sha256": hashes})


def with_deck_hash(scenario: OwnDeck) -> OwnDeck:
    """The same run with the hash of what its template renders, if it can be rendered.

    Two texts count: that of the beginning, and that of going on from a restart file.
    """
    with contextlib.suppress(OSError, ValueError):
        starts = ("", RESTART_FILES[0]) if "restart" in names_used(scenario) else ("",)
        decks = (render(scenario, "run", "study", start) for start in starts)
        sha256 = digest("\n".join(map(_commands, decks)))
        hashes = {**scenario.sha256, scenario.template: sha256}
        return scenario.model_copy(update={"sha256": hashes})
    return scenario


def _commands(deck: str) -> str:
    """A deck without lines that hold a comment or nothing, unless they may be part of a command."""
    if '"""' in deck:
        return deck
    kept, goes_on = [], False
    for line in deck.splitlines():
        text, follows = line.strip(), goes_on
        goes_on = text.endswith("&")
        if follows or goes_on or (text and not text.startswith("#")):
            kept.append(line)
    return "\n".join(kept)


def problems(scenario: OwnDeck) -> list[Problem]:
    """List what keeps a template from being rendered with its values."""
    faults = [
        Problem("template" if n == scenario.template else "files", n, "a file that is there")
        for n, path in scenario.paths.items()
        if not path.is_file()
    ]
    names = [Path(n).name for n in scenario.paths]
    if len(set(names)) < len(names):
        faults.append(Problem("files", list(scenario.files), "files of different names"))
    for name in set(RESERVED) & set(scenario.values):
        faults.append(
            Problem(f"values.{name}", scenario.values[name], f"another name: {name} is given")
        )
    engine = scenario.engine
    if engine.ranks > 1 and engine_module(engine.name).RANKS is Ranks.ONE:
        faults.append(Problem("engine.ranks", engine.ranks, f"1 on engine {engine.name}"))
    return faults or [*_template_problems(scenario)]


def _template_problems(scenario: OwnDeck) -> Iterator[Problem]:
    try:
        used = names_used(scenario)
        render(scenario, "run", "study", "restart")
        deck = render(scenario, "run", "study")
    except ValueError as error:
        given = ", ".join(sorted({*scenario.values, *RESERVED}))
        yield Problem(
            "template", scenario.template, f"a template that renders ({error}); it is given {given}"
        )
        return
    for name in scenario.values:
        if name not in used:
            valid = f"a name that the template uses: {', '.join(sorted(used - set(RESERVED)))}"
            yield Problem(f"values.{name}", scenario.values[name], valid)
    yield from _column_problems(scenario, deck)


def names_used(scenario: OwnDeck) -> frozenset[str]:
    """Names that a template takes from outside.

    Raises
    ------
    TemplateError
    """
    return names_in(template_text(scenario))


def render(scenario: OwnDeck, run: str, study: str, restart: str = "") -> str:
    """Render the deck of a run.

    ``restart``: restart file that the deck is to go on from; empty at the beginning.

    Raises
    ------
    TemplateError
    """
    given = {
        "seed": scenario.seed,
        "run": run,
        "study": study,
        "restart": restart,
        "restart_files": " ".join(f"../{name}" for name in RESTART_FILES),
    }
    return rendered(template_text(scenario), scenario.values | given)


def template_text(scenario: OwnDeck) -> str:
    """Text of the template.

    Raises
    ------
    ValueError
        When it is no text, or longer than any template.
    """
    path = scenario.paths[scenario.template]
    if path.stat().st_size > 4 * MOST_CHARACTERS:
        raise ValueError(f"it is larger than {4 * MOST_CHARACTERS:,} bytes")
    return path.read_text(encoding="utf-8")


def check_unchanged(scenario: OwnDeck, is_rendered: bool = False) -> None:
    """See that files are those of the plan, and the template unless its deck is there.

    Raises
    ------
    BadInputError
    """
    now = scenario.sha256 | with_file_hashes(scenario).sha256
    if not is_rendered:
        now = with_deck_hash(with_file_hashes(scenario)).sha256
    changed = [n for n, planned in scenario.sha256.items() if now.get(n) != planned]
    if changed:
        valid = "the file as it was planned: plan the study again to run it as it is now"
        raise BadInputError(
            [Problem("file", display_path(scenario.paths[n]), valid) for n in changed]
        )


def _column_problems(scenario: OwnDeck, deck: str) -> Iterator[Problem]:
    """Tell columns that a rendered deck, by its text alone, will not print."""
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
    for line in _command_words(deck):
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


def _command_words(deck: str) -> Iterator[list[str]]:
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
