"""Which flows of metal have the measures of ``measures.yaml``."""

from __future__ import annotations

from pathlib import Path

from sandmould.casting.mps.scene import probes_of
from sandmould.runs.measures import MeasureGroup, once, read_groups
from sandmould.scenario.casting.flow import MetalFlow

MEASURES: tuple[MeasureGroup[MetalFlow], ...] = read_groups(
    Path(__file__).with_suffix(".yaml"),
    {
        "every flow; from measured_from_s on, where it says so": lambda _: once(),
        "at a probe, by its name; a flow without own probes has the paper's": lambda scenario: [
            probe.name for probe in probes_of(scenario)
        ],
    },
)
