"""The engines by name, and which of them computes a scene."""

from __future__ import annotations

from typing import Literal, get_args

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED

EngineName = Literal["lammps", "liggghts", "reference"]
"""The engines: each has a folder of ``sandmould/engines``, which its registry opens, and one of
``templates``."""
DeckReader = Literal["lammps", "liggghts"]
"""Engines that people write decks of their own for."""
ENGINE_NAMES: tuple[EngineName, ...] = get_args(EngineName)


class Engine(Section):
    """Which engine computes the scene, and with how many ranks."""

    name: EngineName = quantity("lammps", "Engine that computes the scene.", source=ARGUED)
    ranks: int = quantity(
        1, "MPI ranks of one run, or threads of the reference engine.", source=ARGUED, ge=1, le=4096
    )
