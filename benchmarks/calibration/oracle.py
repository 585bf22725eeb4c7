"""Where the runs of the calibration benchmark come from: the map's emulator, or DEM itself."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import chi2

from benchmarks.frame import SCRATCH, Parts
from sandmould import ROOT
from sandmould.definition.run import Run
from sandmould.execution.simulate import render_run, simulate
from sandmould.kinds.registry import kind_of
from sandmould.kinds.sand.measure import write_measures
from sandmould.runs.hashing import scenario_hash
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.emulator import Emulator, TooFewRunsError, fit_emulator
from sandmould.statistics.evidence import usable_values
from sandmould.study.collect import gather
from sandmould.study.plan.expand import replicate_seed
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import write_plan, write_run

Floats = NDArray[np.float64]
Measures = dict[str, float]
Simulate = Callable[[Sequence[float]], float]
"""One run at a point: its measure, NaN where it gave none."""
STUDY = "repose_map"
KEYS = ("contact.grain_grain.friction", "contact.grain_grain.rolling_arm_fraction")
ANGLE = "heap_angle_deg"
SECOND = "outflow_fraction"
"""What the same run tells besides and breaks the ridge best (docs/results)."""
DEM_RUNS = SCRATCH / "calibration" / "runs"
MAP = ROOT / "docs" / "results" / STUDY / "summary.tsv"
"""The map that docs/results keeps."""
FIRST_REPLICATE = 1001
"""Of runs by DEM: none shares its filling with a run of the map."""


class NoMapError(ValueError):
    """The map is missing or cannot be used."""


@dataclass(frozen=True)
class Map:
    """The map of runs and the emulator through it, which stands for the truth."""

    points: Floats
    """(n, 2) float64: of each run."""
    truth: Emulator
    replicates: int
    """Most runs of a point."""
    freedom: int
    """Degrees of freedom of the noise, 0 where no point has two runs."""

    def mean(self, point: Sequence[float]) -> float:
        """True mean angle at a point, degrees."""
        return float(self.truth.at(np.array([point], dtype=np.float64))[0][0])

    @property
    def mean_se(self) -> float:
        """Standard error of the mean of three heaps, degrees."""
        return self.truth.noise_sd / math.sqrt(3)

    @property
    def tolerance(self) -> float:
        """The larger of half a degree and two standard errors of the mean of three heaps."""
        return max(0.5, 2 * self.mean_se)

    def noise(self) -> dict[str, float | None]:
        """Standard deviation of one heap, degrees, with its 95 % interval."""
        sd, low, high = self.truth.noise_sd, None, None
        if self.freedom:
            low, high = (
                sd * math.sqrt(self.freedom / float(chi2.ppf(p, self.freedom)))
                for p in (0.975, 0.025)
            )
        return {"sd_deg": sd, "low_deg": low, "high_deg": high, "freedom": self.freedom}


def read_map(path: Path, measure: str = ANGLE) -> Map:
    """Read a map.

    Raises
    ------
    NoMapError
        With one sentence of what is missing.
    """
    try:
        table = pd.read_csv(path, sep="\t")
    except FileNotFoundError:
        raise NoMapError(f"{path} is not there: sandmould run {STUDY} computes one") from None
    except (ValueError, OSError) as error:
        raise NoMapError(f"{path} cannot be read as a table: {error}") from None
    lacking = [name for name in (*KEYS, measure, "outcome_code") if name not in table]
    if lacking:
        raise NoMapError(f"{path} lacks the column {lacking[0]}, so it is no map of it")
    values = np.asarray(usable_values(table, measure), dtype=np.float64)
    points = table[list(KEYS)].to_numpy(dtype=np.float64)[np.isfinite(values)]
    try:
        truth = fit_emulator(measure, points, values[np.isfinite(values)])
    except TooFewRunsError as error:
        raise NoMapError(f"{path} is too small a map: {error}") from None
    _, counts = np.unique(points, axis=0, return_counts=True)
    return Map(points, truth, int(counts.max()), int((counts - 1).sum()))


def by_emulator(angle_map: Map, seed: int | Sequence[int]) -> Simulate:
    """Runs of the emulator: its mean, with the noise of one heap."""
    rng = np.random.default_rng(seed)
    return lambda point: angle_map.mean(point) + float(rng.normal(0.0, angle_map.truth.noise_sd))


def by_dem(seed: int, folder: Path = DEM_RUNS) -> Simulate:
    """Heaps of the engine that the map's study names, each of another filling."""
    run = rows_by_dem(seed, folder)
    return lambda point: float(run(point)[ANGLE])


def rows_by_dem(seed: int, folder: Path = DEM_RUNS) -> Callable[[Sequence[float]], Measures]:
    """Both measures of such runs, NaN where a run gave none; each is kept in a file.

    A run goes the workflow's way, plan, deck, engine, measures, in a folder that is then removed.
    """
    runs = Parts(folder)
    base = open_study(ROOT / "config" / "studies" / f"{STUDY}.yaml").study.scenario
    number = FIRST_REPLICATE + 1000 * seed

    def run(point: Sequence[float]) -> Measures:
        nonlocal number
        number += 1
        tree = base.model_dump(mode="json")
        for key, value in zip(KEYS, point, strict=True):
            *path, last = key.split(".")
            section = tree
            for name in path:
                section = section[name]
            section[last] = float(value)
        tree["seed"] = replicate_seed(base.seed, number)
        parameters = dict(zip(KEYS, map(float, point), strict=True))
        scenario = Scenario.model_validate(tree)
        planned = Run(STUDY, "one", parameters, number, scenario, {})
        key = scenario_hash(scenario) + kind_of(scenario).planning.computed_hash(scenario)
        measures: Measures = runs.get(key, lambda: _measures_of(planned))
        return measures

    return run


def _measures_of(run: Run) -> Measures:
    """Simulate and measure a run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run_folder = write_run(run, folder)
        write_plan([run], folder)
        render_run(run_folder)
        simulate(run_folder)
        write_measures(run.scenario, run_folder, run_folder / "measures.tsv")
        summary = gather(folder).summary
    return {m: float(usable_values(summary, m).iloc[0]) for m in (ANGLE, SECOND)}
