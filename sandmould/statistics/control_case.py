"""A case of a control, which every plan needs: without the libraries that compute verdicts."""

from __future__ import annotations

from dataclasses import dataclass, field

from sandmould.runs.columns import CONTROL

SPRINGS = "springs"
"""Control whose cases are whole curves, each over frequency in one hold."""


@dataclass(frozen=True)
class ControlCase:
    """One case of a control: what is changed, and to what."""

    control: str
    value: str
    """In words."""
    factor: float | None
    """What the property is multiplied by; None where a control does not multiply."""
    hold: str = field(default="", kw_only=True)
    """Amplitude that is held in a curve of the control springs; empty of all others."""

    @property
    def part(self) -> str:
        """What it is called in ``runs.tsv``."""
        return f"{CONTROL}{self.control} {self.value}"

    @property
    def name(self) -> str:
        """As sentences name it."""
        what = self.control.replace("_", " ")
        return f"{self.value} held" if self.control == "hold" else f"{what} {self.value}"
