"""Which castings that solidify have the measures of ``measures.yaml``."""

from __future__ import annotations

from pathlib import Path

from sandmould.runs.measures import MeasureGroup, once, read_groups
from sandmould.scenario.casting.solidification import Solidification

MEASURES: tuple[MeasureGroup[Solidification], ...] = read_groups(
    Path(__file__).with_suffix(".yaml"),
    {
        "every casting": lambda _: once(),
        "every casting, by axis": lambda scenario: "xyz"[: scenario.dimensions],
        "with a probe, by its name": lambda scenario: [probe.name for probe in scenario.probes],
    },
)
