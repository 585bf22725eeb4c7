"""The speed of this machine, measured once by a short trial and stored beside all results."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable
from pathlib import Path

from sandmould.kinds.kind import MachineSpeed, ScenarioT
from sandmould.runs.files import write_text

STORED = "calibration.json"


def stored_speed(
    computed_by: Callable[[ScenarioT], str], trial: Callable[[ScenarioT], float | None]
) -> MachineSpeed[ScenarioT]:
    """Measure a speed once on a machine for all scenarios that are computed alike.

    Parameters
    ----------
    computed_by : callable
        Takes a scenario; a text that is the same for all that run at one speed: engine, version,
        dimension.
    trial : callable
        Takes a scenario; work a second of one core, or None where nothing could be measured: the
        study's own runs will say why.
    """

    def name_of(scenario: ScenarioT) -> str:
        return f"{platform.node()} {computed_by(scenario)}"

    def stored(scenario: ScenarioT, results: Path) -> float | None:
        rates = _rates(results)
        return rates.get(name_of(scenario)) if rates else None

    def measured(scenario: ScenarioT, results: Path) -> float | None:
        rate, name = stored(scenario, results), name_of(scenario)
        if rate is None and (rate := trial(scenario)) is not None:
            results.mkdir(parents=True, exist_ok=True)
            # another start may have measured meanwhile
            write_text(results / STORED, json.dumps({**_rates(results), name: rate}, indent=1))
        return rate

    return MachineSpeed(stored, measured)


def _rates(results: Path) -> dict[str, float]:
    """All that was measured; nothing where the file is damaged."""
    try:
        tree = json.loads((results / STORED).read_text(encoding="utf-8"))
        return {machine: float(rate) for machine, rate in tree.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}
