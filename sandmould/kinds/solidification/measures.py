"""Measures of a casting that solidifies."""

from __future__ import annotations

from sandmould.runs.measures import Measure, MeasureGroup, once
from sandmould.scenario.casting.solidification import Solidification

MEASURES: tuple[MeasureGroup[Solidification], ...] = (
    MeasureGroup(
        "every casting",
        lambda scenario: once(),
        (
            Measure("solidified_fraction", "Share of the casting that is solid."),
            Measure("enthalpy_drift_fraction", "Change of all heat over that at the start."),
            Measure("solidification_time_s", "When the last of the casting is solid."),
            Measure("hot_spots", "Places that freeze later than all round them."),
        ),
    ),
    MeasureGroup(
        "every casting, by axis",
        lambda scenario: "xyz"[: scenario.dimensions],
        (Measure("last_point_<axis>_m", "Place of what freezes last, along <axis>."),),
    ),
    MeasureGroup(
        "with a probe, by its name",
        lambda scenario: [probe.name for probe in scenario.probes],
        (Measure("<probe>_k", "Temperature at the probe <probe>."),),
    ),
)
