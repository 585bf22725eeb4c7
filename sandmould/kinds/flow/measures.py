"""Measures of a flow of metal."""

from __future__ import annotations

from sandmould.casting.mps.scene import probes_of
from sandmould.runs.measures import Measure, MeasureGroup, once
from sandmould.scenario.casting.flow import MetalFlow

MEASURES: tuple[MeasureGroup[MetalFlow], ...] = (
    MeasureGroup(
        "every flow; from measured_from_s on, where it says so",
        lambda scenario: once(),
        (
            Measure("mean_speed_m_s", "Mean speed of all particles, over a record."),
            Measure("largest_speed_m_s", "Speed of the fastest particle in a record."),
            Measure("kinetic_energy_j_kg", "Mean kinetic energy, over a record."),
            Measure("step_iterations", "Iterations of the Poisson equation a step."),
            Measure("peak_speed_m_s", "Speed of the fastest particle, from measured_from_s on."),
            Measure("average_speed_m_s", "Mean speed in time, from measured_from_s on."),
            Measure("end_highest_pa", "Highest pressure of a particle when the run ends."),
            Measure("end_bottom_pa", "Mean pressure of the lowest row of metal when it ends."),
            Measure("end_bottom_sd_pa", "Standard deviation of that pressure along the row."),
            Measure("hops", "Whether metal at rest is thrown up: 1 or 0."),
            Measure("classification", "Excellent, good or failed.", is_number=False),
        ),
    ),
    MeasureGroup(
        "at a probe, by its name; a flow without own probes has the paper's",
        lambda scenario: [probe.name for probe in probes_of(scenario)],
        (
            Measure("<probe>_pa", "Pressure at the probe <probe>, mean over a record."),
            Measure("<probe>_mean_pa", "Mean in time of the pressure at <probe>."),
            Measure("<probe>_sd_pa", "Standard deviation in time of that pressure."),
            Measure("<probe>_window_sd_pa", "The same of means over 10 ms."),
            Measure("<probe>_error_pa", "That mean less the hydrostatic pressure at <probe>."),
        ),
    ),
)
