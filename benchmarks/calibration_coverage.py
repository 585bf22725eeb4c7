"""How often a posterior's 95 % region holds a truth that was planted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest, chi2

from benchmarks.calibration_methods import Method, problem_of
from benchmarks.calibration_oracle import ANGLE, Floats, Map, Simulate, by_emulator
from benchmarks.calibration_race import run_race
from sandmould.study.calibration.asked import Target
from sandmould.study.calibration.emulator import Emulator, fit_emulator
from sandmould.study.calibration.posterior import CREDIBLE, OffTheMapError, posterior

MEASURED_SD_DEG = 0.5
"""Of the planted measurement, as config/studies/calibrate_sand.yaml has it."""
DEM_HEAPS = 3
"""Heaps whose mean angle is the measurement where the truth is planted by DEM."""
PEER_CAP = 80
"""Runs of a posterior of GrainLearning: eight generations, as in its manual's example."""


def planted(known: Map, count: int, seed: int = 0) -> Floats:
    """Truths, evenly over the map, (count, 2) float64."""
    rng = np.random.default_rng([seed, count])
    truths: Floats = rng.uniform(known.truth.low, known.truth.high, (count, 2))
    return truths


def holds(emulator: Emulator, measured: float, sd: float, truth: Sequence[float]) -> bool:
    """Whether the region of highest probability holds a truth; none does off the map."""
    try:
        found = posterior({ANGLE: emulator}, {ANGLE: Target(value=measured, sd=sd)})
    except OffTheMapError:
        return False
    i, j = (
        int(np.abs(axis - at).argmin())
        for axis, at in zip((found.first, found.second), truth, strict=True)
    )
    return bool(found.region()[i, j])


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


def our_coverage(known: Map, truths: Floats) -> dict[str, Any]:
    """Plant truths on the emulator and calibrate each on a map simulated again with noise."""
    held = []
    mean = known.truth.at(known.points)[0]
    for number, truth in enumerate(truths):
        rng = np.random.default_rng([1, number])
        again = fit_emulator(
            ANGLE, known.points, mean + rng.normal(0.0, known.truth.noise_sd, len(mean))
        )
        measured = rng.normal(known.mean(truth), MEASURED_SD_DEG)
        held.append(holds(again, measured, MEASURED_SD_DEG, truth))
    return counted("sandmould", "region of highest probability on the map", held)


def peer_coverage(known: Map, method: Method, truths: Floats) -> dict[str, Any]:
    """Plant truths on the emulator and take the ellipse of the peer's last weighted samples.

    The method ends by itself or after ``PEER_CAP`` runs. It is told no error of the measurement:
    it chooses its own.
    """
    held = []
    for number, truth in enumerate(truths):
        rng = np.random.default_rng([2, number])
        problem = problem_of(
            known.truth.low.tolist(),
            known.truth.high.tolist(),
            rng.normal(known.mean(truth), MEASURED_SD_DEG),
            MEASURED_SD_DEG,
            known.tolerance,
            seed=number,
            go_on=False,
        )
        runs = by_emulator(known, [3, number])
        race = run_race(method, problem, runs, lambda point: math.inf, PEER_CAP)
        samples, weights = (np.array(race.last.get(k, [])) for k in ("samples", "weights"))
        held.append(bool(len(samples)) and ellipse_holds(samples, weights, truth))
    region = "ellipse of mean and covariance of the last generation's weighted samples"
    return counted(method.name, region, held)


def dem_coverage(
    known: Map, truths: Floats, heaps: Callable[[int], Simulate]
) -> list[dict[str, Any]]:
    """Plant truths by DEM: the mean of some heaps is measured, the map of the study calibrates."""
    rows = []
    sd = known.truth.noise_sd / math.sqrt(DEM_HEAPS)
    for number, truth in enumerate(truths):
        simulate = heaps(number)
        angles = [simulate(truth) for _ in range(DEM_HEAPS)]
        measured = float(np.mean(angles))
        rows.append({
            "truth": truth.tolist(),
            "measured_deg": measured,
            "emulated_deg": known.mean(truth),
            "held": math.isfinite(measured) and holds(known.truth, measured, sd, truth),
        })  # fmt: skip
    return rows
