"""How often a posterior's 95 % region holds a truth that was planted."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binomtest, chi2

from benchmarks.calibration.methods import CalibrationMethod, problem_of
from benchmarks.calibration.oracle import ANGLE, Floats, Map, by_emulator
from benchmarks.calibration.race import run_race
from sandmould.statistics.calibration.posterior import (
    CREDIBLE,
    OffTheMapError,
    Posterior,
    posterior,
)
from sandmould.statistics.config import Target
from sandmould.statistics.emulator import Emulator, fit_emulator

MEASURED_SD_DEG = 0.5
"""Of the planted measurement, as config/studies/calibrate_sand.yaml has it."""
DEM_RUNS = 3
"""Runs whose mean is the measurement where the truth is planted by DEM."""
PEER_CAP = 80
"""Runs of a posterior of GrainLearning: eight generations, as in its manual's example."""


def planted(angle_map: Map, count: int, seed: int = 0) -> Floats:
    """Truths, evenly over the map, (count, 2) float64."""
    rng = np.random.default_rng([seed, count])
    truths: Floats = rng.uniform(angle_map.truth.low, angle_map.truth.high, (count, 2))
    return truths


def posterior_on(
    emulators: Mapping[str, Emulator], targets: Mapping[str, Target]
) -> Posterior | None:
    """Calibrate; None where a value lies off the map."""
    try:
        return posterior(emulators, targets)
    except OffTheMapError:
        return None


def holds(density: Posterior | None, truth: Sequence[float]) -> bool:
    """Whether the region of highest probability holds a truth; none does off the map."""
    if density is None:
        return False
    i, j = (
        int(np.abs(axis - at).argmin())
        for axis, at in zip((density.first, density.second), truth, strict=True)
    )
    return bool(density.region()[i, j])


def ellipse_holds(samples: Floats, weights: Floats, truth: Sequence[float]) -> bool:
    """Whether the 95 % ellipse of weighted samples holds a truth; a flat one holds none."""
    mean = weights @ samples
    apart = samples - mean
    covariance = (weights[:, None] * apart).T @ apart
    if not np.isfinite(covariance).all() or np.linalg.matrix_rank(covariance) < 2:
        return False
    away = np.asarray(truth) - mean
    return bool(away @ np.linalg.solve(covariance, away) <= chi2.ppf(CREDIBLE, 2))


def counted(method: str, region: str, held: Sequence[bool]) -> dict[str, Any]:
    """Share of truths that were held, with its exact 95 % interval."""
    share = binomtest(sum(held), len(held)).proportion_ci(0.95)
    return {
        "method": method,
        "region": region,
        "claimed": CREDIBLE,
        "held": sum(held),
        "truths": len(held),
        "low": float(share.low),
        "high": float(share.high),
    }


def our_coverage(angle_map: Map, truths: Floats) -> dict[str, Any]:
    """Plant truths on the emulator and calibrate each on a map simulated again with noise."""
    held = []
    mean = angle_map.truth.at(angle_map.points)[0]
    for number, truth in enumerate(truths):
        rng = np.random.default_rng([1, number])
        again = fit_emulator(
            ANGLE, angle_map.points, mean + rng.normal(0.0, angle_map.truth.noise_sd, len(mean))
        )
        measured = rng.normal(angle_map.mean(truth), MEASURED_SD_DEG)
        target = Target(value=measured, sd=MEASURED_SD_DEG)
        held.append(holds(posterior_on({ANGLE: again}, {ANGLE: target}), truth))
    return counted("sandmould", "region of highest probability on the map", held)


def peer_coverage(angle_map: Map, method: CalibrationMethod, truths: Floats) -> dict[str, Any]:
    """Plant truths on the emulator and take the ellipse of the peer's last weighted samples.

    The method ends by itself or after ``PEER_CAP`` runs. It gets no error of the measurement:
    it chooses its own.
    """
    held = []
    for number, truth in enumerate(truths):
        rng = np.random.default_rng([2, number])
        problem = problem_of(
            angle_map.truth.low.tolist(),
            angle_map.truth.high.tolist(),
            rng.normal(angle_map.mean(truth), MEASURED_SD_DEG),
            MEASURED_SD_DEG,
            angle_map.tolerance,
            seed=number,
            go_on=False,
        )
        runs = by_emulator(angle_map, [3, number])
        race = run_race(method, problem, runs, lambda point: math.inf, PEER_CAP)
        samples, weights = (np.array(race.last.get(k, [])) for k in ("samples", "weights"))
        held.append(bool(len(samples)) and ellipse_holds(samples, weights, truth))
    region = "ellipse of mean and covariance of the last generation's weighted samples"
    return counted(method.name, region, held)


def dem_coverage(
    maps: Mapping[str, Map],
    truths: Floats,
    runs: Callable[[int], Callable[[Sequence[float]], dict[str, float]]],
) -> list[dict[str, Any]]:
    """Plant truths by DEM and calibrate each on the maps: by the first measure, and by all.

    Parameters
    ----------
    maps : mapping of measure to Map
    truths : (n, 2) float64
    runs : callable
        Gives runs by the number of the truth; the mean of some is measured.
    """
    emulators = {measure: angle_map.truth for measure, angle_map in maps.items()}
    rows = []
    for number, truth in enumerate(truths):
        simulate = runs(number)
        computed = pd.DataFrame([simulate(truth) for _ in range(DEM_RUNS)])
        values = {m: float(computed[m].mean(skipna=False)) for m in maps}
        targets = {
            m: Target(value=value, sd=emulators[m].noise_sd / math.sqrt(DEM_RUNS))
            for m, value in values.items()
            if math.isfinite(value)
        }
        posteriors = {}
        for name, wanted in {"first": list(maps)[:1], "all": list(maps)}.items():
            there = {m: targets[m] for m in wanted if m in targets}
            density = posterior_on(emulators, there) if len(there) == len(wanted) else None
            posteriors[name] = {
                "held": holds(density, truth),
                "bits": density.bits if density else None,
                "mode": list(density.mode) if density else None,
                "sd": list(density.sd) if density else None,
            }
        rows.append({
            "truth": truth.tolist(),
            "measured": {m: v if math.isfinite(v) else None for m, v in values.items()},
            "emulated": {m: angle_map.mean(truth) for m, angle_map in maps.items()},
            "by": posteriors,
        })  # fmt: skip
        print(f"planted {truth}: {rows[-1]}", flush=True)
    return rows
