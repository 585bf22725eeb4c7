"""Runs of a benchmark that are kept as they end, so that one that was killed goes on from there."""

from __future__ import annotations

import json
from pathlib import Path

from sandmould.digest import digest
from sandmould.runs.hashing import scenario_hash
from sandmould.scenario.scenario import Scenario
from sandmould.study.kinds.kind import kind_of

Measures = dict[str, float]


def key_of(scenario: Scenario) -> str:
    """Name of a run: what its scenario says and what its engine is told to compute."""
    return digest(scenario_hash(scenario), kind_of(scenario).computed_hash(scenario))


class KeptRuns:
    """Measures of runs by their key, a line of JSON each."""

    def __init__(self, path: Path) -> None:
        """Read what a file keeps; a last line that was cut off is left out."""
        self._path = path
        self._known: dict[str, Measures] = {}
        for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
            try:
                kept = json.loads(line)
            except json.JSONDecodeError:
                continue
            self._known[kept["key"]] = kept["measures"]

    def get(self, key: str) -> Measures | None:
        """Measures of a run that was made before."""
        return self._known.get(key)

    def add(self, key: str, measures: Measures) -> None:
        """Keep the measures of a run."""
        self._known[key] = measures
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a", encoding="utf-8") as file:
            # a line of its own, though the last one may have been cut off
            file.write("\n" + json.dumps({"key": key, "measures": measures}) + "\n")
