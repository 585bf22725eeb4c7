"""A run that the user's own template commands: what it is given, and what is read from it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould import ROOT
from sandmould.scenario.engine import DeckReader
from sandmould.scenario.quantity import NAME, PLANNED, Section, quantity
from sandmould.scenario.sand import ARGUED

RESERVED = ("seed", "run", "study", "restart", "restart_files")
"""Names that a template is given beside the user's own values."""
CLOCK = "Time"
"""Column of the log that a deck must print: ``thermo_style custom step time ...``."""


class DeckEngine(Section):
    """Which program reads the deck, and with how many ranks."""

    name: DeckReader = quantity("lammps", "Engine that reads the deck.", source=ARGUED)
    ranks: int = quantity(1, "MPI ranks of one run; 1 on liggghts.", source=ARGUED, ge=1, le=4096)


class Taken(Section):
    """What a measure is taken from, and how."""

    of: str = quantity(..., "Column of the engine's log, or of the dump.", source="user")
    take: Literal["last", "mean", "rate"] = quantity(
        "last",
        "The last value, the mean over time, or the change over the window by its length in s.",
        source="user",
    )
    over_last_s: float | None = quantity(
        None, "Window that a mean or rate is taken over.", unit="s", source="user", gt=0
    )
    from_s: float | None = quantity(
        None, "Time from which on it is taken, in place of over_last_s.", unit="s", source="user",
        ge=0,
    )  # fmt: skip
    dump: str = quantity(
        "", "Dump of text that the deck writes beside itself.", source="user",
        pattern=r"^(\w[\w.-]*)?$",
    )  # fmt: skip
    grains: Literal["mean", "max", "min", "sum"] = quantity(
        "mean", "What of the dumped grains counts at one moment.", source="user"
    )

    @model_validator(mode="after")
    def _one_window(self) -> Taken:
        windows = [self.over_last_s, self.from_s].count(None)
        if windows == 0 or (self.take == "last" and windows < 2):
            rule = "take: mean or take: rate with one of over_last_s and from_s"
            raise PydanticCustomError("window", rule)
        return self

    @property
    def text(self) -> str:
        """In words."""
        what = f"{self.grains} {self.of} of the grains in {self.dump}" if self.dump else self.of
        window = f" from {self.from_s:g} s on" if self.from_s is not None else ""
        if self.over_last_s is not None:
            window = f" over the last {self.over_last_s:g} s"
        return what if self.take == "last" else f"the {self.take} of {what}{window}"


class OwnDeck(Section):
    """One run of a template of the user's, complete."""

    # the hash of the rendered deck says what the values do
    uncomputed = frozenset({"values", "measures", "expected_core_s", "memory_mb"})
    engine: DeckEngine = Field(
        DeckEngine(), description="Engine that runs the deck, and its cores."
    )
    template: str = quantity(
        ...,
        "Jinja template of the deck. Its path is relative to the file that names it, in a "
        "resolved run to the repository.",
        source="user",
        min_length=1,
    )
    files: tuple[Annotated[str, Field(min_length=1)], ...] = quantity(
        (), "Further files that the deck reads; they lie beside it when it runs.", source="user"
    )
    sha256: dict[str, str] = quantity(
        {},
        "Hash of the rendered deck and of each file; the plan of a study writes it.",
        source=PLANNED,
    )
    values: dict[Annotated[str, Field(pattern=NAME)], Any] = Field(
        {}, description="Names that the template is given; any of them can be swept."
    )
    measures: dict[Annotated[str, Field(pattern=NAME)], str | Taken] = Field(
        {},
        description="Measures by name, which ends in the unit, and the column of the engine's log "
        "that each is read from, such as fill_fraction: v_fill (LIGGGHTS heads it fill); or what "
        "is taken of it.",
    )
    steps: int | None = quantity(
        None, "Time steps that the deck runs; progress and time left need it.", source="user", ge=1
    )
    expected_core_s: float = quantity(
        600.0,
        "Guess of the processor time of a run, for the plan and for a cluster's limits.",
        unit="s",
        source=ARGUED,
        gt=0,
        le=1e9,
    )
    memory_mb: int = quantity(
        2000, "Memory that a cluster is asked for.", unit="MB", source=ARGUED, ge=100, le=10**7
    )
    seed: int = quantity(1, "Seed that the template is given.", source="user", ge=0, le=2**31 - 1)

    @property
    def taken(self) -> dict[str, Taken]:
        """What each measure is taken from, by its name."""
        each = self.measures.items()
        return {name: Taken(of=of) if isinstance(of, str) else of for name, of in each}

    @property
    def columns(self) -> dict[str, str]:
        """Column of the log by the name of each measure that is read from it."""
        return {name: taken.of for name, taken in self.taken.items() if not taken.dump}

    @property
    def paths(self) -> dict[str, Path]:
        """Where template and files lie, by their names in the scenario."""
        return {n: Path(os.path.normpath(ROOT / n)) for n in (self.template, *self.files)}
