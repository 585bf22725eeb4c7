"""Decks: an input script in named blocks, rendered from templates and read back block by block."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sandmould import SHIPPED
from sandmould.digest import SHORT, digest
from sandmould.runs.files import write_text

if TYPE_CHECKING:
    import jinja2

TEMPLATES = SHIPPED / "templates"
_LONGEST_REMARK = 200
"""Characters; LIGGGHTS reads lines of 2048."""
_BLOCK = re.compile(r"^#--- block: (\w+) ---.*?\n(.*?)^#--- end: \1 ---$", re.M | re.S)
_COMMENT = re.compile(r"\{#.*?#\}|^[ \t]*#(?!---)[^{\n]*$|^[ \t]+|[ \t]+$|\n(?=\n)", re.M | re.S)
"""Of a template: its comments, those of its deck that print no value, indents and empty lines."""
_RUNS = re.compile(r'(?:^(?:run|if [^\n]* then "run) (?!0\b)[^\n]*\n)+', re.M)


def exact(number: float) -> str:
    """Shortest text that reads back as the same number."""
    value = float(number)
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def vector(components: Any) -> str:
    """Three numbers for an engine that is always in 3D; a missing one is 0."""
    padded = [*np.asarray(components, dtype=float), 0.0, 0.0][:3]
    return " ".join(exact(c + 0.0) for c in padded)


def remark(text: str) -> str:
    """A text from a file as part of a deck's comment, which it neither ends nor goes on with.

    Line breaks, a ``&`` at the end and triple quotes would do so in LAMMPS and LIGGGHTS.
    """
    printable = text  # most texts are, and a deck has hundreds
    if not text.isprintable():
        printable = "".join(c if c.isprintable() else " " for c in text)
    words = " ".join(printable.replace('"', "'").replace("&", "and").split())
    return words if len(words) <= _LONGEST_REMARK else f"{words[: _LONGEST_REMARK - 3]}..."


@functools.cache
def environment(dialect: str) -> jinja2.Environment:
    """Strict Jinja environment of one dialect: a misspelt name is an error, never empty text.

    Snakemake's own template engine has neither a loader nor this strictness.
    """
    import jinja2  # plans read decks' hashes and render none
    from jinja2.sandbox import ImmutableSandboxedEnvironment

    env = ImmutableSandboxedEnvironment(
        loader=jinja2.FileSystemLoader(TEMPLATES / dialect),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    env.filters.update(exact=exact, vector=vector)
    return env


def template_files(dialect: str) -> list[Path]:
    """All templates of one dialect."""
    return sorted((TEMPLATES / dialect).glob("*.j2"))


def dialect_hash(dialect: str) -> str:
    """Hash of what the templates of one dialect command: comments and layout are left out."""
    texts = (path.read_text(encoding="utf-8") for path in template_files(dialect))
    return digest(*(_COMMENT.sub("", text) for text in texts))[:SHORT]


@dataclass(frozen=True)
class DeckBlock:
    """One named block of a deck."""

    name: str
    text: str

    def around_run(self) -> tuple[str, str]:
        """Commands before and after the block's long run, which may be two commands in a row."""
        parts = _RUNS.split(self.text)
        if len(parts) > 2:
            raise ValueError(f"block {self.name} has {len(parts) - 1} long runs, at most one fits")
        return parts[0], "".join(parts[1:])


@dataclass(frozen=True)
class Deck:
    """A rendered input script."""

    text: str

    @property
    def blocks(self) -> dict[str, DeckBlock]:
        """Named blocks in order."""
        return {m.group(1): DeckBlock(m.group(1), m.group(2)) for m in _BLOCK.finditer(self.text)}

    @property
    def commands(self) -> str:
        """All but comments and empty lines."""
        bare = (line.split("#", 1)[0].rstrip() for line in self.text.splitlines())
        return "\n".join(line for line in bare if line)

    @classmethod
    def render(cls, dialect: str, context: Mapping[str, Any], template: str = "deck.in.j2") -> Deck:
        """Render the deck of a dialect, or a part of it by another template."""
        return cls(environment(dialect).get_template(template).render(context))

    @classmethod
    def read(cls, path: Path) -> Deck:
        """Read a deck from its file."""
        return cls(path.read_text(encoding="utf-8"))

    def write(self, folder: Path) -> None:
        """Write ``deck.in``: where it is, it is whole."""
        write_text(folder / "deck.in", self.text)
