"""Noise of one heap, runs needed, and coverage: on the emulator of a map, or by DEM."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.calibration.coverage import (
    MEASURED_SD_DEG,
    dem_coverage,
    our_coverage,
    peer_coverage,
    planted,
)
from benchmarks.calibration.methods import CalibrationMethod, problem_of
from benchmarks.calibration.oracle import (
    ANGLE,
    DEM_RUNS,
    SECOND,
    Map,
    NoMapError,
    by_dem,
    by_emulator,
    read_map,
    rows_by_dem,
)
from benchmarks.calibration.race import CAP, HELD_AFTER, run_race, summarised
from sandmould import ROOT
from sandmould.execution.simulate import provenance
from sandmould.scenario.scenario import Scenario


@dataclass(frozen=True)
class CalibrationExtent:
    """How much is measured."""

    oracle: str = "emulator"
    seeds: int = 20
    truths: int = 200
    """Planted on the emulator, or by DEM."""
    targets: tuple[float, ...] = (25.0, 30.0)
    cap: int = CAP
    held_after: int = HELD_AFTER


# A run by DEM takes 20 s, on a busy core a minute: two generations of the peers have to do.
WHOLE = {
    "emulator": CalibrationExtent(),
    "dem": CalibrationExtent("dem", seeds=1, truths=5, cap=40, held_after=16),
}
QUICK = {
    "emulator": CalibrationExtent(seeds=2, truths=10),
    "dem": CalibrationExtent("dem", seeds=1, truths=5, cap=40, held_after=16),
}


def race_all(
    angle_map: Map, methods: Sequence[CalibrationMethod], extent: CalibrationExtent
) -> list[dict[str, Any]]:
    """Let every method find every target from every start; a start and its noise are shared."""
    low, high = angle_map.truth.low.tolist(), angle_map.truth.high.tolist()
    mean, _ = angle_map.truth.at(angle_map.points)
    rows = []
    for target in extent.targets:
        if not mean.min() <= target <= mean.max():
            raise NoMapError(
                f"the map has no angle of {target:g} degrees: it goes from {mean.min():.1f} to "
                f"{mean.max():.1f}"
            )

        def miss_of(point: Sequence[float], target: float = target) -> float:
            return abs(angle_map.mean(point) - target)

        for method in methods:
            races = []
            for seed in range(1, extent.seeds + 1):
                problem = problem_of(low, high, target, MEASURED_SD_DEG, angle_map.tolerance, seed)
                noise = 1000 * round(target) + seed
                runs = by_dem(noise) if extent.oracle == "dem" else by_emulator(angle_map, noise)
                races.append(
                    run_race(method, problem, runs, miss_of, extent.cap, extent.held_after)
                )
            summaries = summarised(method.name, target, races)
            rows += summaries
            for row in summaries:
                needed = " ".join("-" if n is None else str(n) for n in row["runs_needed"])
                print(f"{target:g} degrees, {method.name}, {row['guess']}: {needed}", flush=True)
    return rows


def measure(
    file: Path, methods: Sequence[CalibrationMethod], extent: CalibrationExtent
) -> dict[str, Any]:
    """Measure everything, one after the other.

    Raises
    ------
    NoMapError
        When the map of runs is missing or does not reach a target.
    """
    begun, load = time.perf_counter(), os.getloadavg()[0]
    goes_on = extent.oracle == "dem" and any(DEM_RUNS.glob("*.json"))
    angle_map = read_map(file)
    races = race_all(angle_map, methods, extent) if extent.seeds else []
    truths = planted(angle_map, extent.truths)
    coverage: dict[str, Any] = {}
    if extent.oracle == "dem":
        maps = {ANGLE: angle_map, SECOND: read_map(file, SECOND)}
        coverage["dem_truths"] = dem_coverage(maps, truths, rows_by_dem)
    else:
        # coexist states no posterior.
        coverage["coverage"] = [our_coverage(angle_map, truths)] + [
            peer_coverage(angle_map, method, truths)
            for method in methods
            if method.name == "GrainLearning"
        ]
    origin = provenance(Scenario())
    return {
        "machine": origin["machine"],
        "load_average": load,
        "commit": origin["commit"],
        "versions": origin["versions"],
        "peers": {method.name: method.versions for method in methods if method.versions},
        "map": {
            "file": str(file.relative_to(ROOT)) if file.is_relative_to(ROOT) else file.name,
            "runs": angle_map.truth.runs,
            "replicates": angle_map.replicates,
            "low": angle_map.truth.low.tolist(),
            "high": angle_map.truth.high.tolist(),
        },
        "noise": angle_map.noise(),
        "tolerance_deg": angle_map.tolerance,
        "mean_se_deg": angle_map.mean_se,
        "cap": extent.cap,
        "held_after": extent.held_after,
        "races": races,
        **coverage,
        "measured_s": round(time.perf_counter() - begun),
        "goes_on": goes_on,
    }
