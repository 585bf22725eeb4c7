"""One run of solidification: from its scenario to cooling curves, fields and cost.

A metal that melts at one temperature freezes behind a front, and an element is below its solidus
when the front leaves it. Its middle froze half an element before: when half of its latent heat was
gone (Voller and Cross, International Journal of Heat and Mass Transfer 24 (1981) 545-556). Where
liquidus and solidus differ, an element cools through its solidus as its middle does. There the
gradient of temperature is read as well. Where a temperature is passed at t(x) and falls at the rate
R there, its gradient is R times that of t.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm import scene, source_hash
from sandmould.casting.arpm import source_files as source_files
from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.estimates import least_sand_share, plate_modulus_m
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.marching import STEP_SHARE
from sandmould.casting.arpm.solidification import (
    Cooling,
    CoolingProgress,
    SolidificationResult,
    UnstableError,
    solidify,
)
from sandmould.runs.checkpoint_file import CheckpointFile
from sandmould.runs.hashing import solution_hash
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import Computed, Cost, peak_memory_bytes
from sandmould.runs.progress import Progress
from sandmould.scenario.casting.solidification import Solidification

PRODUCTS = ("series.tsv", "fields.npz")
CHECKPOINT = "checkpoint.bin"
REACH = 1.6
"""Mean sizes of two elements within which the front goes from one to the other."""


@dataclass
class ElementCost(Cost):
    """The cost row of a run on elements; compiling is left out of ``cpu_s``."""

    elements: int = 0
    element_steps: int = 0

    def columns(self) -> dict[str, Any]:
        """Columns of the cost row in ``products.json`` and their values."""
        rate = self.element_steps / self.engine_wall_s if self.engine_wall_s > 0 else 0.0
        names = ("engine", "version", "ranks", "elements", "element_steps", "time_step_s",
                 "wall_s", "engine_wall_s", "cpu_s", "peak_memory_bytes")  # fmt: skip
        return {name: getattr(self, name) for name in names} | {"element_steps_per_s": rate}


def computed_hash(scenario: Solidification) -> str:
    """Hash of scenario and solver."""
    return solution_hash(scenario, source_hash())


def engine_of(scenario: Solidification) -> str:
    """What computes it, as tables call it."""
    return "differences" if scenario.exchange == "difference" else "arpm"


def no_cost(scenario: Solidification) -> ElementCost:
    """Cost of a run that has not begun."""
    return ElementCost(engine_of(scenario), 1, math.nan, STEP_SHARE, source_hash())


def compute(scenario: Solidification, folder: Path, run: str) -> Computed:
    """Solidify a casting from its newest checkpoint, or from its beginning.

    ``folder``: the run's; products are written to its ``work``. ``run``: its name, for the line of
    progress.
    """
    work = folder / "work"
    work.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    cost, planned_s = no_cost(scenario), scene.expected_s(scenario)
    progress = Progress(run, work, scene.expected_element_steps(scenario), "element-steps")
    raster, filling = scene.drawn_raster(scenario), scene.filling_of(scenario)
    elements = placed(raster, scenario.layers)
    cost.elements = len(elements.size_m)
    cooled = CoolingProgress(0.0, 0.0, 0.0, 0)
    checkpoint = CheckpointFile(work / CHECKPOINT, computed_hash(scenario))
    newest = checkpoint.read()

    def show_progress(now: CoolingProgress) -> None:
        nonlocal cooled
        cooled = now
        progress.show("cooling", now.time_s, now.element_steps, now.element_steps_per_s)

    try:
        marching = scene.method_of(scenario).marching(elements, filling, raster)
        marching.advance(filling.heat(elements), 1e-9)  # compiled before it is timed
        cost.time_step_s = marching.step_s
        probes_m = {probe.name: np.array(probe.at_m) for probe in scenario.probes}
        result = solidify(
            elements, filling, marching, probes_m, scenario.record_s, scenario.until_s,
            show_progress, Cooling.of(newest) if newest else None,
            lambda now: checkpoint.write_when_due(now.arrays),
        )  # fmt: skip
    except (UnstableError, ValueError) as stop:
        code = Outcome.UNSTABLE if isinstance(stop, UnstableError) else Outcome.BAD_INPUT
        outcome = RunOutcome(code, str(stop), cooled.time_s, planned_s)
        cost.wall_s = time.monotonic() - begun
        return Computed(outcome, cost, is_root=True)
    _write(scenario, elements, filling, result, work)
    end_s = float(result.time_s[-1])
    progress.show("cooling", end_s, result.heat.element_steps,
               result.heat.element_steps / max(result.wall_s, 1e-9), last=True)  # fmt: skip
    cost.element_steps, cost.cpu_s = result.heat.element_steps, result.cpu_s
    cost.engine_wall_s, cost.wall_s = result.wall_s, time.monotonic() - begun
    cost.peak_memory_bytes = peak_memory_bytes()
    detail = ""
    if math.isnan(result.solidification_time_s):
        advice = "raise until_s"
        if least_sand_share(scenario, scene.cooled_of(scenario)) >= 1.0:
            advice = "the box has too little sand ever to freeze it"
        detail = f"some of the casting is still liquid at {end_s:g} s: {advice}"
    return Computed(RunOutcome(Outcome.FINISHED, detail, end_s, planned_s), cost, is_root=True)


def _write(
    scenario: Solidification,
    elements: Elements,
    filling: Filling,
    result: SolidificationResult,
    work: Path,
) -> None:
    """Write the curves and the fields at the end."""
    melts, volume = filling.melts(elements), elements.volume_m3
    frozen_s = middle_frozen_s(elements, filling, result.heat.frozen_s)
    whole = volume[melts].sum()
    solid = [float(volume[melts & (frozen_s <= t)].sum() / whole) for t in result.time_s]
    clock, share, heat = scene.series_columns(scenario)
    probes = {f"{name}_k": curve for name, curve in result.probe_k.items()}
    table = pd.DataFrame({clock: result.time_s, **probes, share: solid, heat: result.enthalpy_j})
    table.to_csv(work / "series.tsv", sep="\t", index=False, float_format="%.10g")
    read_j_m3 = filling.table.rows[elements.material, 5]
    # what has melted again flows; what was poured so cold never did
    noted = np.where(result.heat.enthalpy_j_m3 < read_j_m3, result.heat.noted, np.nan)
    flows_s = np.where(result.heat.enthalpy_j_m3 < read_j_m3, np.nan_to_num(noted[1]), np.nan)
    flows_s = np.where(np.isfinite(read_j_m3), flows_s, frozen_s)
    steep_k_m = gradient_k_m(elements, noted)
    np.savez_compressed(
        work / "fields.npz", position_m=elements.position_m, size_m=elements.size_m,
        volume_m3=volume, melts=melts, frozen_s=frozen_s, temperature_k=result.heat.temperature_k,
        riser=scene.risers_of(scenario, elements) & melts,
        modulus_m=plate_modulus_m(scenario, frozen_s),
        flows_s=flows_s, cooling_k_s=noted[2], gradient_k_m=steep_k_m,
        niyama_sqrt_ks_m=steep_k_m / np.sqrt(noted[2]),
    )  # fmt: skip


def complete(scenario: Solidification, work: Path) -> None:
    """Make an empty table of curves where a broken run wrote none."""
    path = work / "series.tsv"
    if not path.exists():
        path.write_text("\t".join(scene.series_columns(scenario)) + "\n", encoding="utf-8")


def middle_frozen_s(elements: Elements, filling: Filling, frozen_s: Floats) -> Floats:
    """Interpolate freezing times to the elements' middles, (n,) float64, s.

    The same for alloys, and for an element that freezes later than all those round it.
    ``frozen_s``, (n,) float64, s: when each element's mean enthalpy fell below its solidus; NaN
    before.
    """
    at_once = np.array([it.melts and it.solidus_k == it.liquidus_k for it in filling.materials])
    frozen = np.flatnonzero(np.isfinite(frozen_s) & at_once[elements.material])
    found = frozen_s.copy()
    if len(frozen):
        size_m, own_s = elements.size_m[frozen], frozen_s[frozen]
        later_s_m = _later_s_m(elements.position_m[frozen], size_m, own_s)
        found[frozen] = np.maximum(own_s - 0.5 * size_m * later_s_m, 0.0)
    return found


def gradient_k_m(elements: Elements, noted: Floats) -> Floats:
    """Temperature gradient at each element when it passes where gradients are read.

    Gives (n,) float64, K/m; NaN where nothing was read. ``noted``, (3, n) float64: as of ``Heat``.
    """
    _, read_s, cooling_k_s = noted
    there = np.flatnonzero(np.isfinite(read_s))
    found = np.full(len(read_s), np.nan)
    if len(there):
        place_m, own_s = elements.position_m[there], read_s[there]
        away_m, near, touches = _near(place_m, elements.size_m[there])
        apart = (place_m[near] - place_m[:, None]) * touches[:, :, None]
        # least squares of straight lines, those of near elements first
        weight = 1.0 / np.where(touches, away_m, np.inf) ** 2
        squares = np.einsum("nk,nki,nkj->nij", weight, apart, apart)
        rises = np.einsum("nk,nki,nk->ni", weight, apart, own_s[near] - own_s[:, None])
        # a plate one element thick has no slope across it
        slope_s_m = np.einsum("nij,nj->ni", np.linalg.pinv(squares, 1e-9, hermitian=True), rises)
        found[there] = cooling_k_s[there] * np.linalg.norm(slope_s_m, axis=1)
    return found


def _later_s_m(place_m: Floats, size_m: Floats, frozen_s: Floats) -> Floats:
    """Seconds a metre that the front takes from each element to the next, 0 where it ends."""
    away_m, near, touches = _near(place_m, size_m)
    slope = (frozen_s[near] - frozen_s[:, None]) / np.where(touches, away_m, np.inf)
    return np.asarray(np.maximum(slope.max(axis=1), 0.0))


def _near(place_m: Floats, size_m: Floats) -> tuple[Floats, Ints, Flags]:
    """Distances of the elements round each, their numbers, and which of them it touches."""
    count = min(3 ** place_m.shape[1], len(place_m))
    found = cKDTree(place_m).query(place_m, k=count)
    away_m, near = (np.asarray(values).reshape(-1, count) for values in found)
    touches = (away_m > 0.0) & (away_m <= REACH * 0.5 * (size_m[:, None] + size_m[near]))
    return away_m, near, touches
