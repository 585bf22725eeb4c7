"""The speed of this machine, measured once by a short trial and kept in the user's cache."""

from __future__ import annotations

import contextlib
import math
import os
import platform
from abc import ABC, abstractmethod
from importlib.metadata import version
from pathlib import Path
from typing import Generic, TypeVar

from sandmould.digest import SHORT, digest
from sandmould.runs.provenance import processor
from sandmould.scenario.quantity import Section
from sandmould.user_cache import user_cache

SceneT = TypeVar("SceneT", bound=Section)


class StoredSpeed(ABC, Generic[SceneT]):
    """How fast a core of this machine is: measured once for all scenarios that run at one speed.

    A kind says what they have in common, and how the speed is measured.
    """

    basis = "at the speed measured on this machine"
    """What a price rests on that was reckoned with it."""

    @abstractmethod
    def computed_by(self, scenario: SceneT) -> str:
        """Name what is the same for all that run at one speed: engine, version, dimension."""

    @abstractmethod
    def trial(self, scenario: SceneT, results: Path) -> float | None:
        """Measure what is stored: work a second of one core; None where that failed."""

    def rate(self, scenario: SceneT, stored: float) -> float:
        """Work a second of one core by what is stored."""
        return stored

    def stored(self, scenario: SceneT) -> float | None:
        """Work a second of one core as measured before; None where it was not. Starts nothing."""
        try:
            found = float(self.file(scenario).read_text(encoding="utf-8"))
        except (OSError, ValueError):  # it was not measured, or the file is damaged
            return None
        return self.rate(scenario, found) if 0.0 < found < math.inf else None

    def measured(self, scenario: SceneT, results: Path) -> float | None:
        """The same, measured now and stored where it was not before; None where it cannot be.

        Raises
        ------
        BadInputError
            Where a program of the user's stops with an error.
        """
        rate = self.stored(scenario)
        if rate is None and (found := self.trial(scenario, results)) is not None:
            file = self.file(scenario)
            partial = file.with_suffix(f".{os.getpid()}")  # another start may write its own
            with contextlib.suppress(OSError):  # it is measured anew where nothing can be kept
                file.parent.mkdir(parents=True, exist_ok=True)
                partial.write_text(str(found), encoding="utf-8")
                partial.replace(file)
            rate = self.rate(scenario, found)
        return rate

    def file(self, scenario: SceneT) -> Path:
        """Where the speed of a scenario is kept, by all that it depends on."""
        machine = f"{platform.node()} {processor()} numba {version('numba')}"
        key = digest(f"{machine} {self.computed_by(scenario)}")[:SHORT]
        return user_cache() / "speeds" / f"{key}.txt"
