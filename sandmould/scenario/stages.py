"""Kinds of stages of a run, and their names in snapshots and tables."""

from __future__ import annotations

from enum import Enum


class StageKind(Enum):
    """What happens in a stage; the value begins its name."""

    SETTLE = "settle"
    """A layer falls and comes to rest."""
    POUR = "pour"
    """A layer falls into the vibrating box, or a portion of it out of a spout."""
    BETWEEN = "between"
    """The box vibrates before the next layer falls."""
    PRESS = "press"
    """A wall moves as a piston."""
    HOLD = "hold"
    """The piston stands, and the sand comes to rest."""
    OPEN = "open"
    """The gate slides away."""
    DISCHARGE = "discharge"
    """Sand flows out through the gate until it rests, or for a stated time."""
    VIBRATE = "vibrate"
    """The box vibrates after the fill."""
    REST = "rest"
    """The box stands after vibration, and the sand comes to rest."""

    @property
    def fills(self) -> bool:
        """Whether the stage belongs to the fill."""
        return self in (StageKind.SETTLE, StageKind.POUR, StageKind.BETWEEN)

    def numbered(self, number: int) -> str:
        """Name of a stage of this kind, counted from 1; 0 of one that is the only one."""
        return f"{self.value}_{number}" if number else self.value


def stage_kind(name: str) -> StageKind:
    """Kind of the stage of a name.

    Raises
    ------
    ValueError
        When no stage is called so.
    """
    return StageKind(name.partition("_")[0])


def is_filling(name: str) -> bool:
    """Whether the stage of a name belongs to the fill."""
    return stage_kind(name).fills


def is_rest(name: str) -> bool:
    """Whether a stage of this name is a rest after vibration; any text will do."""
    return name.partition("_")[0] == StageKind.REST.value
