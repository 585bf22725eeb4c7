"""How a run ended: one code and one sentence, always written."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from enum import IntEnum
from pathlib import Path

from sandmould.plain_file import read_json
from sandmould.runs.files import write_text


class Outcome(IntEnum):
    """Ways a run can end; codes of 400 and above can be continued from a checkpoint."""

    FINISHED = 0
    BAD_INPUT = 300
    ENGINE_MISSING = 301
    LOST_GRAINS = 310
    OVERLAP_TOO_LARGE = 311
    UNSTABLE = 312
    NO_FLOW = 313
    NOT_SETTLED = 314
    COUPLING_DIVERGED = 315
    ESCAPED_METAL = 316
    NO_FREE_SURFACE = 317
    NO_EQUILIBRIUM = 318
    ENGINE_FAILED = 320
    OUT_OF_WALL_TIME = 400
    DISK_REFUSED = 401

    @property
    def label(self) -> str:
        """Name as tables show it, such as ``lost grains``."""
        return self.name.lower().replace("_", " ")

    @property
    def restartable(self) -> bool:
        """Whether the same command continues the run."""
        return self >= 400

    @property
    def meaning(self) -> str:
        """One sentence."""
        return _MEANING[self]


_MEANING = {
    Outcome.FINISHED: "The run reached its end.",
    Outcome.BAD_INPUT: "The scenario cannot be run as written.",
    Outcome.ENGINE_MISSING: "The engine is not installed or too old.",
    Outcome.LOST_GRAINS: "Grains left the box or passed through a wall.",
    Outcome.OVERLAP_TOO_LARGE: "Grains overlapped more than the guard allows.",
    Outcome.UNSTABLE: "Energy grew beyond what fall and vibration can give, or was not a number.",
    Outcome.NO_FLOW: "The sand stopped flowing before it was meant to.",
    Outcome.NOT_SETTLED: "A layer did not come to rest within the longest time its rule allows.",
    Outcome.COUPLING_DIVERGED: "The coupling of sand and pattern ran away.",
    Outcome.ESCAPED_METAL: "Metal left the mould.",
    Outcome.NO_FREE_SURFACE: "Metal without a free surface did not fit its place in the mould.",
    Outcome.NO_EQUILIBRIUM: "The pattern found no equilibrium under the load of the sand.",
    Outcome.ENGINE_FAILED: "The engine stopped with an error of its own.",
    Outcome.OUT_OF_WALL_TIME: "The wall-time limit came first; the same command continues.",
    Outcome.DISK_REFUSED: "The disk took no more; with room on it the same command continues.",
}


@dataclass(frozen=True)
class RunOutcome:
    """The outcome of one run with what the engine or the guard said."""

    outcome: Outcome
    detail: str
    simulated_s: float
    planned_s: float

    @property
    def text(self) -> str:
        """As its file holds it, in JSON."""
        values = {
            "code": int(self.outcome),
            "outcome": self.outcome.label,
            "meaning": self.outcome.meaning,
            "restartable": self.outcome.restartable,
            **{k: v for k, v in asdict(self).items() if k != "outcome"},
        }
        return json.dumps(values, indent=1) + "\n"

    def write(self, path: Path) -> None:
        """Write as JSON."""
        write_text(path, self.text)

    @classmethod
    def read(cls, path: Path) -> RunOutcome:
        """Read from JSON."""
        values = read_json(path)
        return cls(
            Outcome(values["code"]), values["detail"], values["simulated_s"], values["planned_s"]
        )
