"""Decks whose time step changes once the bed is filled: two parts, each set up on its own.

LAMMPS and LIGGGHTS are told dashpots that depend on the time step before their first grain. So the
first part fills the box and keeps the bed in a restart file; the second reads it, with all numbers
found anew for its own time step. A session computes one part or the other.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from sandmould.dem import source_files
from sandmould.engines.bed_step import with_bed_step
from sandmould.engines.deck import Deck, DeckBlock
from sandmould.engines.deck_lines import Lines
from sandmould.engines.program import Program, build_program
from sandmould.scenario.scenario import Scenario

_KEEP_BED = "#--- block: keep_bed ---"
"""Where the second part begins."""
_COUNT_ON = "count_on"
"""Block of the second part alone that belongs to its setup."""
_NUMBER = re.compile(r"^variable (\w+) index (\S+)", re.M)


def sources_of_step(scenario: Scenario) -> list[list[Path]]:
    """Files of ours that find the step of a bed that another engine computes; none without one."""
    if not scenario.takes_step_of_bed:
        return []
    here = Path(__file__).parent
    names = ("bed_deck.py", "bed_limit.py", "solid_surfaces.py", "reference/model.py")
    return [source_files(), [here / name for name in names]]


def step_meaning(scenario: Scenario) -> str:
    """What the step of a filled bed is."""
    fraction = scenario.time_step.bed_fraction
    share = f"{fraction:.3g} of the exact limit of the filled bed" if fraction else "as given"
    return f"time step after the fill, {share}, rounded down"


def step_line(lines: Lines) -> str:
    """The time step of a deck, or of a part of it, as its variable."""
    scenario, source = lines.scenario, lines.source("time_step.fraction")
    critical = scenario.critical_step
    if scenario.has_step_of_bed:
        of_bed = f"eqs. (40)-(54) of all its contacts; {lines.source('time_step.bed_fraction')}"
        return lines.number("time_step", scenario.step_s, "s", step_meaning(scenario), of_bed)
    meaning = "time step of the fill" if scenario.takes_step_of_bed else "time step"
    share = f"{scenario.step_s / critical.step_s:.3g} of the critical {critical.step_s:.4g} s"
    return lines.number(
        "time_step", scenario.step_s, "s", f"{meaning}, {share} set by {critical.cause}",
        f"eqs. (40)-(54); {source}",
    )  # fmt: skip


def render_parts(
    dialect: str, program: Program, context_of: Callable[[Program], dict[str, Any]]
) -> Deck:
    """Render a deck, in two parts where it takes its time step from the filled bed.

    Before the bed is known the planned step stands in the second part too. ``context_of``: names
    and values for the templates, of a program.
    """
    scenario, filled = program.scenario, program.fill_stages
    if not scenario.takes_step_of_bed or filled == len(program.stages):
        return Deck.render(dialect, context_of(program))
    planned = scenario.time_step.model_copy(update={"step_s": None})
    fill = replace(program, scenario=scenario.model_copy(update={"time_step": planned}))
    first = Deck.render(
        dialect, context_of(fill) | {"stages": program.stages[:filled]}, "start.in.j2"
    )
    shaken = program
    if not scenario.has_step_of_bed:
        shaken = build_program(with_bed_step(scenario, math.inf))
    parts = {"fill_stages": program.stages[:filled], "stages": shaken.stages[filled:]}
    second = Deck.render(dialect, context_of(shaken) | parts, "bed.in.j2")
    text = second.text
    if shaken is not program:
        text = (
            f"# The bed is not filled yet: until then this part has the planned time step.\n{text}"
        )
    return Deck(first.text + _given_anew(text, first.text))


def _given_anew(text: str, earlier: str) -> str:
    """Let a part give the numbers that differ from an earlier part's, which it deletes first."""
    before = dict(_NUMBER.findall(earlier))

    def anew(number: re.Match[str]) -> str:
        name, value = number.groups()
        same = before.get(name, value) == value
        return number.group() if same else f"variable {name} delete\n{number.group()}"

    return _NUMBER.sub(anew, text)


def blocks_of(deck: Deck, scenario: Scenario) -> dict[str, DeckBlock]:
    """Blocks of the part of a deck that a session computes.

    Before the bed has given its step they are those of the fill, and stages after it that have the
    planned step too, for a session that goes on by itself.
    """
    first, second = (Deck(part).blocks for part in deck.text.partition(_KEEP_BED)[::2])
    if scenario.has_step_of_bed:
        return second or first
    return first | {name: second[name] for name in second if name not in {*first, _COUNT_ON}}
