"""What is known of a measure before any run: its name, unit and meaning, and which scenes have it.

Each kind of study lists its measures once; the plan checks names against that list, the command
``sandmould measures`` and a page of the documentation print it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, TypeVar

from sandmould.runs.formatting import unit_of
from sandmould.scenario.yaml_text import load_planned

SceneT = TypeVar("SceneT")
_OF_WHAT = re.compile(r"<\w+>")
"""Stands in a name for that of what is measured, such as ``<tube>``."""


@dataclass(frozen=True)
class Measure:
    """A column of ``measures.tsv``."""

    name: str
    meaning: str
    """One sentence."""
    is_number: bool = True
    """Words cannot be compared."""

    @property
    def unit(self) -> str:
        """As its name's ending states it; 1 for a pure number, nothing for words."""
        return (unit_of(self.name) or "1") if self.is_number else ""

    def of(self, what: str) -> Measure:
        """The measure of one thing, its name laid in."""
        return replace(
            self, name=_OF_WHAT.sub(what, self.name), meaning=_OF_WHAT.sub(what, self.meaning)
        )


@dataclass(frozen=True)
class MeasureGroup(Generic[SceneT]):
    """Measures that the same scenes have."""

    when: str
    """Which scenes, in words."""
    things: Callable[[SceneT], Iterable[str]]
    """Names of what is measured in a scene; none where the scene lacks it."""
    measures: tuple[Measure, ...]


def read_groups(
    path: Path, things: Mapping[str, Callable[[SceneT], Iterable[str]]]
) -> tuple[MeasureGroup[SceneT], ...]:
    """Groups of measures as a file of a kind of study describes them.

    It has names and meanings by group, ``[words, meaning]`` of a measure that is no number;
    ``things``: what each group measures in a scene.
    """
    return tuple(
        MeasureGroup(when, things[when], tuple(_described(*each) for each in measures.items()))
        for when, measures in load_planned(path.read_text(encoding="utf-8")).items()
    )


def _described(name: str, about: str | list[str]) -> Measure:
    return Measure(name, about) if isinstance(about, str) else Measure(name, about[1], False)


def once(is_there: bool = True) -> tuple[str, ...]:
    """What a group of measures without names of its own gives: one thing, or none."""
    return ("",) if is_there else ()


def measures_of(groups: Sequence[MeasureGroup[SceneT]], scene: SceneT) -> list[Measure]:
    """Measures that a scene will have, in the order of its list."""
    return [
        measure.of(thing)
        for group in groups
        for thing in group.things(scene)
        for measure in group.measures
    ]
