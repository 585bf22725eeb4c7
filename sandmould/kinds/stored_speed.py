"""The speed of this machine, measured once by a short trial and stored beside all results."""

from __future__ import annotations

import json
import platform
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Generic, TypeVar

from sandmould.plain_file import read_json
from sandmould.runs.files import write_text
from sandmould.scenario.quantity import Section

STORED = "calibration.json"
SceneT = TypeVar("SceneT", bound=Section)


class StoredSpeed(ABC, Generic[SceneT]):
    """How fast a core of this machine is: measured once for all scenarios that run at one speed.

    A kind says what they have in common, and how the speed is measured.
    """

    basis = "at the speed measured on this machine"
    """What a price rests on that was reckoned with it."""
    file = STORED
    """In the folder of all results."""

    @abstractmethod
    def computed_by(self, scenario: SceneT) -> str:
        """Name what is the same for all that run at one speed: engine, version, dimension."""

    @abstractmethod
    def trial(self, scenario: SceneT, results: Path) -> float | None:
        """Measure what is stored: work a second of one core; None where that failed."""

    def rate(self, scenario: SceneT, stored: float) -> float:
        """Work a second of one core by what is stored."""
        return stored

    def stored(self, scenario: SceneT, results: Path) -> float | None:
        """Work a second of one core as measured before; None where it was not. Starts nothing.

        Parameters
        ----------
        scenario : scenario of the kind
        results : Path
            Folder of all results.
        """
        every = self._stored(results)
        found = every.get(self._name_of(scenario)) if every else None
        return None if found is None else self.rate(scenario, found)

    def measured(self, scenario: SceneT, results: Path) -> float | None:
        """The same, measured now and stored where it was not before; parameters as of ``stored``.

        Returns
        -------
        float or None
            None where nothing could be measured: the study's own runs will say why.

        Raises
        ------
        BadInputError
            Where a program of the user's stops with an error.
        """
        rate = self.stored(scenario, results)
        if rate is None and (found := self.trial(scenario, results)) is not None:
            results.mkdir(parents=True, exist_ok=True)
            # another start may have measured meanwhile
            every = {**self._stored(results), self._name_of(scenario): found}
            write_text(results / self.file, json.dumps(every, indent=1))
            rate = self.rate(scenario, found)
        return rate

    def _name_of(self, scenario: SceneT) -> str:
        return f"{platform.node()} {self.computed_by(scenario)}"

    def _stored(self, results: Path) -> dict[str, float]:
        """All that was measured; nothing where the file is damaged."""
        try:
            tree = read_json(results / self.file)
            return {machine: float(number) for machine, number in tree.items()}
        except (OSError, ValueError, TypeError, AttributeError):
            return {}
