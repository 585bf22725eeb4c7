"""Calibrated sands: from the runs of a map to posteriors and material files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from sandmould.runs.columns import CPU_S
from sandmould.runs.files import write_text
from sandmould.runs.templates import worded
from sandmould.scenario.quantity import fields_at
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.calibration.posterior import (
    IsoLine,
    OffTheMapError,
    Posterior,
    Worth,
    iso_line,
    posterior,
    worths,
)
from sandmould.statistics.config import Calibration, TargetSand
from sandmould.statistics.emulator import Emulator, TooFewRunsError, fit_emulator
from sandmould.statistics.evidence import usable_values

CANDIDATES = (
    "heap_angle_deg", "residue_angle_deg", "outflow_time_s", "outflow_fraction",
    "side_load_fraction", "run_out_m",
)  # fmt: skip
"""Columns that may tell one sand from another, where a study has them."""


@dataclass(frozen=True)
class CalibratedSand:
    """What is known of one sand."""

    sand: TargetSand
    posterior: Posterior | None
    """None where ``problem`` says why."""
    by_first: Posterior | None
    """From the first target alone."""
    lines: Mapping[str, IsoLine]
    """Line of each target."""
    problem: str = ""


@dataclass(frozen=True)
class Calibrated:
    """A map and the sands found on it."""

    keys: tuple[str, str]
    emulators: Mapping[str, Emulator]
    sands: tuple[CalibratedSand, ...]
    worths: tuple[Worth, ...]
    """Of every other measure beside the first target."""
    left_out: tuple[str, ...]
    """Why a measure has no emulator."""


def calibrate(
    calibration: Calibration,
    summary: pd.DataFrame,
    keys: tuple[str, str],
    others: Mapping[str, pd.DataFrame] | None = None,
) -> Calibrated:
    """Calibrate all sands of a study.

    ``others``: summaries of the studies that ``calibration.also`` names.
    """
    emulators: dict[str, Emulator] = {}
    tables: dict[str, pd.DataFrame] = {}
    left_out = []
    for measure, table, column in _measures(calibration, summary, others or {}):
        points = table[list(keys)].to_numpy(dtype=np.float64)
        values = np.asarray(usable_values(table, column), dtype=np.float64)
        try:
            emulators[measure] = fit_emulator(measure, points, values)
        except TooFewRunsError as error:
            left_out.append(str(error))
            continue
        tables[measure] = table
    sands = tuple(_calibrate_sand(sand, emulators, keys) for sand in calibration.sands)
    first = next((next(iter(s.sand.targets)) for s in sands if s.posterior is not None), "")
    # What the runs that give the first measure tell besides costs nothing more.
    cpu_s = {
        measure: 0.0 if table is tables[first] else float(table[CPU_S].mean())
        for measure, table in tables.items()
        if first
    }
    worth_of_measures = tuple(worths(emulators, first, cpu_s)) if first else ()
    return Calibrated(keys, emulators, sands, worth_of_measures, tuple(left_out))


def _measures(
    calibration: Calibration, summary: pd.DataFrame, others: Mapping[str, pd.DataFrame]
) -> Iterator[tuple[str, pd.DataFrame, str]]:
    """Each measure that may be emulated: its name, its table and its column there."""
    targeted = {measure for sand in calibration.sands for measure in sand.targets}
    tables = {"": summary} | {f"{name}__": table for name, table in others.items()}
    for prefix, table in tables.items():
        for column in map(str, table.columns):
            if column in CANDIDATES or prefix + column in targeted:
                yield prefix + column, table, column


def _calibrate_sand(
    sand: TargetSand, emulators: Mapping[str, Emulator], keys: tuple[str, str]
) -> CalibratedSand:
    missing = [measure for measure in sand.targets if measure not in emulators]
    if missing:
        given = list(emulators) or ["nothing"]
        why = worded("off_the_map.j2", measure=missing[0], value=None, given=given)
        return CalibratedSand(sand, None, None, {}, why)
    lines = {m: iso_line(emulators[m], target) for m, target in sand.targets.items()}
    first = next(iter(sand.targets))
    assumed = [sand.assumed.get(key) for key in keys]
    try:
        by_first = posterior(emulators, {first: sand.targets[first]})
        return CalibratedSand(sand, posterior(emulators, sand.targets, assumed), by_first, lines)
    except OffTheMapError as error:
        return CalibratedSand(sand, None, None, lines, str(error))


def material_text(
    calibrated: CalibratedSand, keys: tuple[str, str], scenario: Scenario, study: str
) -> str:
    """A calibrated sand, which has a posterior, as a material file: with two values found.

    ``scenario``: of any run: all but the swept keys is the same.
    """
    assert calibrated.posterior is not None
    parts = {"sand", "contact", "background_damping"}
    tree: dict[str, Any] = scenario.model_dump(mode="json", include=parts, exclude_none=True)
    targets = [*calibrated.sand.targets.items(), *calibrated.sand.assumed.items()]
    for key, value, sd in zip(
        keys, calibrated.posterior.mode, calibrated.posterior.sd, strict=True
    ):
        *path, last = key.split(".")
        section = tree
        for name in path:
            section = section[name]
        extra = fields_at(Scenario, key)[0].json_schema_extra
        section[last] = {
            "value": float(f"{value:.5g}"),
            "unit": str(extra["unit"]) if isinstance(extra, dict) else "1",
            "source": worded("material.j2", study=study, targets=targets, sd=sd),
        }
    correlation = calibrated.posterior.correlation
    head = worded("material_head.j2", study=study, correlation=correlation)
    text = yaml.safe_dump(tree, sort_keys=False, allow_unicode=True, width=100)
    return f"{head}\n{text}"


def write_materials(result: Calibrated, scenario: Scenario, study: str, folder: Path) -> list[Path]:
    """Write the material of every sand that was found, each moved into place last."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for calibrated in result.sands:
        if calibrated.posterior is None:
            continue
        path = folder / f"{calibrated.sand.name}.yaml"
        write_text(path, material_text(calibrated, result.keys, scenario, study))
        written.append(path)
    return written
