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

    meaning: str
    """One sentence."""

    def __new__(cls, code: int, meaning: str = "") -> Outcome:
        """Give a code its sentence."""
        outcome = int.__new__(cls, code)
        outcome._value_, outcome.meaning = code, meaning
        return outcome

    FINISHED = 0, "The run reached its end."
    BAD_INPUT = 300, "The scenario cannot be run as written."
    ENGINE_MISSING = 301, "The engine is not installed or too old."
    LOST_GRAINS = 310, "Grains left the box or passed through a wall."
    OVERLAP_TOO_LARGE = 311, "Grains overlapped more than the guard allows."
    UNSTABLE = 312, "Energy grew beyond what fall and vibration can give, or was not a number."
    NO_FLOW = 313, "The sand stopped flowing before it was meant to."
    NOT_SETTLED = 314, "A layer did not come to rest within the longest time its rule allows."
    COUPLING_DIVERGED = 315, "The coupling of sand and pattern ran away."
    ESCAPED_METAL = 316, "Metal left the mould."
    NO_FREE_SURFACE = 317, "Metal without a free surface did not fit its place in the mould."
    NO_EQUILIBRIUM = 318, "The pattern found no equilibrium under the load of the sand."
    ENGINE_FAILED = 320, "The engine stopped with an error of its own."
    OUT_OF_WALL_TIME = 400, "The wall-time limit came first; the same command continues."
    DISK_REFUSED = 401, "The disk took no more; with room on it the same command continues."

    @property
    def label(self) -> str:
        """Name as tables show it, such as ``lost grains``."""
        return self.name.lower().replace("_", " ")

    @property
    def restartable(self) -> bool:
        """Whether the same command continues the run."""
        return self >= 400


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
