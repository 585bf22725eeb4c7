"""What the settings of a study ask of the vibrating table, for the plan."""

from __future__ import annotations

from collections.abc import Iterable

from sandmould.kinds.sand.fill_map import best_by_records, map_error
from sandmould.runs.formatting import number
from sandmould.runs.templates import sentences
from sandmould.scenario.drive import BoxDrive, laid_down_drive
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2

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
        error=map_error(),
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
