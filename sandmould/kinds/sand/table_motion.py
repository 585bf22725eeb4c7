"""What the settings of a study ask of the vibrating table, for the plan.

The fill of a tube goes with the velocity of the table, here over that of a fall through the bed,
and with the frequency over c/(4 H), so what stays constant when the frequency changes decides
(docs/frequency_law.md). The map says nothing beyond the range of the records that it was fitted to.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import yaml

from sandmould import SHIPPED
from sandmould.runs.formatting import number
from sandmould.runs.templates import sentences
from sandmould.scenario.box import Tube
from sandmould.scenario.drive import BoxDrive, laid_down_drive
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2

MAP = SHIPPED / "config" / "fill_map.yaml"
"""Written by ``python -m benchmarks.frequency_law``."""
LISTED_SETTINGS = 12
_HEADS = ("frequency", "amplitude*", "velocity", "acceleration")


def table_lines(scenarios: Iterable[Scenario]) -> list[str]:
    """Frequency, amplitude, velocity and acceleration of each vibration, as lines of a table."""
    every = list(scenarios)
    stages = [stage for scenario in every for stage in scenario.vibrations]
    rows = list(dict.fromkeys(_row(laid_down_drive(stage)) for stage in stages))
    if not rows:
        return []
    shown = [_HEADS, *rows[:LISTED_SETTINGS]]
    widths = [max(len(row[i]) for row in shown) for i in range(len(_HEADS))]
    lines = ["Table motion:"]
    lines += [
        "  " + "  ".join(c.rjust(w) for c, w in zip(row, widths, strict=True)) for row in shown
    ]
    if len(rows) > LISTED_SETTINGS:
        lines.append(f"  and {len(rows) - LISTED_SETTINGS} more")
    below = sentences(
        "plan_table.j2",
        empty=any(stage.unbalance is not None for stage in stages),
        weak=any(throws_no_sand(scenario) for scenario in every),
        best_hz=best_by_records(every),
        error=float(_map()["error"]),
    )
    return [*lines, *(f"  {line}" for line in below)]


def throws_no_sand(scenario: Scenario) -> bool:
    """Whether a box that is shaken up and down never leaves its sand: below gravity.

    A table with an unbalance counts without sand, which slows it further.
    """
    lift_g = [
        laid_down_drive(stage).acceleration_g * abs(stage.unit_direction(scenario.dimension)[-1])
        for stage in scenario.vibrations
    ]
    gravity_g = scenario.gravity_m_s2 / STANDARD_GRAVITY_M_S2
    return bool(lift_g) and all(0.0 < g < gravity_g - 1e-9 for g in lift_g)  # round-off


def _row(drive: BoxDrive) -> tuple[str, str, str, str]:
    return (
        f"{number(drive.frequency_hz)} Hz",
        f"{number(1e3 * drive.displacement_m)} mm",
        f"{number(1e3 * drive.velocity_m_s)} mm/s",
        f"{number(drive.acceleration_g)} g",
    )


def best_by_records(scenarios: Sequence[Scenario]) -> float:
    """Find at which of the settings the tube should fill best.

    NaN unless all of them shake one tube of the records' kind upright, within their range, at
    frequencies that differ.
    """
    fills = {_frequency_hz(scenario): _foretold(scenario) for scenario in scenarios}
    if len(fills) < max(2, len(scenarios)) or not np.isfinite([*fills.values()]).all():
        return np.nan
    return max(fills, key=lambda hz: fills[hz])


def _frequency_hz(scenario: Scenario) -> float:
    return laid_down_drive(scenario.vibrations[0]).frequency_hz if scenario.vibrations else 0.0


def _foretold(scenario: Scenario) -> float:
    """Fill of the tube of the records at a setting; NaN where they do not tell it."""
    tubes = [obstacle for obstacle in scenario.obstacles if isinstance(obstacle, Tube)]
    hardness = bed_hardness(scenario)
    is_alone = len(scenario.obstacles) == len(tubes) == 1 and scenario.pattern is None
    if not is_alone or len(scenario.vibrations) != 1 or hardness is None:
        return np.nan
    (stage,) = scenario.vibrations
    asked = {
        "tube_width_m": tubes[0].diameter_m,
        "bed_depth_m": hardness.depth_m,
        "wave_speed_m_s": hardness.wave_speed_m_s,
        "size_scale": scenario.sand.size_scale,
        "duration_s": stage.duration_s,
    }
    told = _map()["range"].items()
    in_range = all(low <= asked[name] <= high for name, (low, high) in told)
    if stage.unit_direction(scenario.dimension)[-1] < 1.0 or not in_range:
        return np.nan
    drive = laid_down_drive(stage)
    fall_m_s = math.sqrt(scenario.gravity_m_s2 * hardness.depth_m)
    return _at(drive.velocity_m_s / fall_m_s, drive.frequency_hz / hardness.column_hz)


def _at(over_fall: float, in_modes: float) -> float:
    """Fill between the points of the map, along the logarithms; NaN beyond them."""
    modes, speeds = np.log(_map()["in_modes"]), np.log(_map()["over_fall"])
    at_mode = np.log(in_modes)
    at_speeds = [np.interp(at_mode, modes, row, np.nan, np.nan) for row in _map()["fill"]]
    return float(np.interp(np.log(over_fall), speeds, at_speeds, np.nan, np.nan))


@functools.cache
def _map() -> dict[str, Any]:
    loaded: dict[str, Any] = yaml.safe_load(MAP.read_text(encoding="utf-8"))
    return loaded
