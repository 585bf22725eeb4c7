"""The rounds of a study on disk: which runs each added, and why they ended."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.study import Study
from sandmould.definition.sweep import Point
from sandmould.digest import digest
from sandmould.runs.files import write_text
from sandmould.runs.hashing import said

ROUNDS_FILE = "rounds.json"


@dataclass(frozen=True)
class Round:
    """Runs that were added, and what was known before them."""

    runs: tuple[tuple[Point, int], ...]
    """Points and replicates."""
    setting: dict[str, float]
    """Best setting by the runs before."""
    interval: dict[str, tuple[float, float]]
    spent_core_h: float
    """By all runs before."""


@dataclass(frozen=True)
class RoundLog:
    """All rounds so far."""

    basis: str
    """Hash of what the rounds rest on."""
    rounds: tuple[Round, ...] = ()
    ended: str = ""
    """Why there are no more, as a sentence; empty while they go on."""
    certified_hz: tuple[float, ...] = ()
    """Frequencies of the controls, the best in the middle; none before it is known."""

    coarsened: tuple[Point, ...] | None = None
    """Points for coarser grains, the best first; None before they are chosen."""

    @property
    def runs(self) -> list[tuple[Point, int]]:
        """Runs of all rounds."""
        return [run for round_ in self.rounds for run in round_.runs]


def basis_of(study: Study) -> str:
    """Hash of what a study's rounds rest on: its scene, its objective and which keys it sweeps."""
    rests_on = [said(study.scenario), said(study.objective), study.sweep.swept]
    return digest(json.dumps(rests_on, sort_keys=True))


def read_rounds(folder: Path, study: Study) -> RoundLog:
    """Read the rounds of a study; none where it has none or they are those of another one.

    Raises
    ------
    BadInputError
        When the file was changed into something that is no list of rounds.
    """
    path, basis = folder / ROUNDS_FILE, basis_of(study)
    if not study.decides_more or not path.is_file():
        return RoundLog(basis)
    try:
        log = log_of(path.read_bytes())
    except ValueError:
        valid = "a list of rounds as the study wrote it, or no such file: they then begin anew"
        raise BadInputError([Problem("rounds", "as it is", valid, str(path))]) from None
    return log if log.basis == basis else RoundLog(basis)


def log_of(text: bytes) -> RoundLog:
    """Rounds from a file's bytes.

    Raises
    ------
    ValueError
        When they are no list of rounds.
    """
    try:
        return TypeAdapter(RoundLog).validate_json(text)
    except ValueError:
        raise ValueError("no list of rounds") from None


def write_rounds(log: RoundLog, folder: Path) -> None:
    """Write the rounds; those of another study's past are kept beside under their own name."""
    path = folder / ROUNDS_FILE
    if path.is_file():
        earlier = json.loads(path.read_text(encoding="utf-8"))
        if earlier["basis"] != log.basis:
            os.replace(path, folder / f"rounds_{earlier['basis'][:6]}.json")
    write_text(path, json.dumps(asdict(log), indent=1) + "\n")
