"""One run of a study, as its plan leaves it to its jobs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from sandmould.digest import digest

Part = str
"""``sweep``, ``cross_check``, a case of the certificate's controls, or ``FILL``."""
RUN_NAME = "[a-z0-9_]+_r[0-9]+_[0-9a-f]{6}"
"""Pattern of the name of any run."""
FILL = "fill"
"""Part of a run that is no result: a fill that runs of the study share."""
FILLS = "fills"
"""Folder of those, beside that of the runs."""
LAST_MEASURED = "measures.tsv"
"""File of a run's folder that is written after all else that is measured."""
PICTURE = "final.png"
"""What an export of a run draws."""
CURVES = "cooling_curves.csv"
EXPORTED = (PICTURE, "exports.zip", "fields.vtu", CURVES)
"""Files of a run's folder that are made when asked for, see ``Execution.export``."""


@dataclass(frozen=True)
class Run:
    """One run of a study, with all that its jobs need."""

    study: str
    run: str
    """Short label, replicate and six digits of the hash of the resolved scenario."""
    parameters: dict[str, Any]
    """Value of each swept key, by key path."""
    replicate: int
    """Number of the replicate, from 1; a block, see ``replicate_seed``."""
    scenario: Any
    """Of the type of the study's kind, see ``sandmould.kinds``."""
    sources: dict[str, str]
    """Where each leaf of the scenario came from, by key path."""
    part: Part = "sweep"
    """What it belongs to."""
    fill: str = ""
    """Name of the fill that it goes on from; empty of one that fills by itself."""

    @property
    def place(self) -> str:
        """Where it lies in the folder of its study."""
        return f"{FILLS if self.part == FILL else 'runs'}/{self.run}"

    @cached_property
    def alike(self) -> str:
        """Hash that it shares with runs which differ from it in their seed alone."""
        own = self.part, bool(self.fill), type(self.scenario).__name__
        return digest(f"{own}{self.scenario.model_dump_json(exclude={'seed'})}")

    @property
    def seed(self) -> int:
        """The scenario's seed."""
        return int(self.scenario.seed)
