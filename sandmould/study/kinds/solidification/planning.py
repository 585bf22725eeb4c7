"""Studies of solidification: a casting in its mould, by particles of several sizes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.export import elements_to_vtk
from analysis.freezing import freezing
from sandmould.casting.arpm import computation, scene
from sandmould.scenario.casting_shapes import with_file_hash
from sandmould.scenario.solidification import Solidification
from sandmould.study.definition.run import Run
from sandmould.study.kinds import casting as own_solver
from sandmould.study.kinds.kind import SpeedClass

MODEL = Solidification
WORK = "element-steps"
PRODUCTS = computation.PRODUCTS
BASE_MEMORY_MB = 600
ELEMENTS_PER_MB = 500
RATE = 2e7
RATE_OF_DIFFERENCES = 1e8
"""Element-steps a second of one core: 1.9e7 and 1.3e8 on the machine where plates_small was first
run; fixed, so that a study has the same batches everywhere."""


def resolved(scenario: Solidification) -> Solidification:
    """The scenario with the hashes of its files, so that a changed mesh makes another run."""
    shapes = tuple(with_file_hash(shape) for shape in scenario.shapes)
    return scenario.model_copy(update={"shapes": shapes})


def threads(scenario: Solidification) -> int:
    """Of one process."""
    return scenario.threads


def memory_mb(scenario: Solidification) -> int:
    """Libraries, and some 2 kB an element for the pairs of a kernel."""
    return BASE_MEMORY_MB + len(scene.elements_of(scenario).size_m) // ELEMENTS_PER_MB


def planned_work(scenario: Solidification) -> float:
    """Element-steps, by Chvorinov's rule."""
    return scene.expected_element_steps(scenario)


def predicted_s(scenario: Solidification) -> float:
    """Wall time at fixed speeds."""
    return planned_work(scenario) / (_speed(scenario) * scenario.threads)


_given = own_solver.Given(computation, scene.problems, predicted_s)


def __getattr__(name: str) -> Any:
    """Entries that all kinds with our own solver have alike."""
    return getattr(_given, name)


def planned_s(scenario: Solidification) -> float:
    """Until all is solid, by Chvorinov's rule."""
    return scene.expected_s(scenario)


def speed_class(scenario: Solidification) -> SpeedClass:
    """Elements or finite differences."""
    return computation.engine_of(scenario), scenario.dimensions


def rate(scenario: Solidification, results: Path) -> float:
    """The fixed speed."""
    return _speed(scenario)


def _speed(scenario: Solidification) -> float:
    return RATE_OF_DIFFERENCES if scenario.exchange == "difference" else RATE


def plan_cells(scenario: Solidification) -> Mapping[str, str]:
    """Elements, and the time at which all should be solid."""
    return {
        "elements": f"{len(scene.elements_of(scenario).size_m):,}",
        "solid at about": f"{scene.expected_s(scenario):.0f} s",
    }


def measure(run: Run, folder: Path) -> None:
    """Write the measures against time, those of the whole run in every row, and the picture."""
    from analysis.freezing_plots import draw_freezing

    series = pd.read_csv(folder / "series.tsv", sep="\t")
    _, _, heat_column = scene.series_columns(run.scenario)
    clock = {"time_s": series["time_s"], "vibration_time_s": -1.0, "stage": "cooling"}
    table = pd.DataFrame({**clock, **series.drop(columns=["time_s", heat_column])})
    fields, draw = own_solver.read_fields(folder), None
    if fields:
        melts, heat = fields["melts"], series[heat_column]
        found = freezing(
            fields["position_m"][melts], fields["frozen_s"][melts], run.scenario.hot_spot_reach_m
        )
        table["enthalpy_drift_fraction"] = heat / heat.iloc[0] - 1.0
        table["solidification_time_s"] = found.solidification_time_s
        for axis, place_m in zip("xyz", found.last_point_m, strict=False):
            table[f"last_point_{axis}_m"] = place_m
        table["hot_spots"] = len(found.hot_spots_m)
        elements_to_vtk(fields, folder / "fields.vtu")
        draw = partial(draw_freezing, fields, found)
    own_solver.write_measures(folder, table)
    own_solver.write_picture(folder, (6, 5), draw)
