"""A case of a control as the tables of a study know it."""

from __future__ import annotations

from dataclasses import dataclass

from sandmould.runs.columns import CONTROL


@dataclass(frozen=True)
class ControlCase:
    """One case of a control: what is changed, and to what."""

    control: str
    value: str
    """In words."""
    factor: float | None
    """What the property is multiplied by; None where a control does not multiply."""

    @property
    def part(self) -> str:
        """What it is called in ``runs.tsv``."""
        return f"{CONTROL}{self.control} {self.value}"

    @property
    def name(self) -> str:
        """As sentences name it."""
        what = self.control.replace("_", " ")
        return f"{self.value} held" if self.control == "hold" else f"{what} {self.value}"
