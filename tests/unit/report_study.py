"""A small study on disk with planted results, as engines and analysis leave it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from sandmould.definition.run import Run
from sandmould.engines.snapshot import Snapshot
from sandmould.runs.manifest import save_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.scenario.box import Box, Tube
from sandmould.scenario.fill import Fill, Layer
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import VibrationStage
from tests.planned import write_plan
from tests.snapshots import write_snapshots

KEY = "vibration.0.frequency_hz"
DURATION_S = 2.0
FILLING_S = 0.4
PLANTED = {25.0: 0.30, 50.0: 0.55, 100.0: 0.40}
"""Tube fill at the end, by frequency."""
FAILED = "f100_r3"


def scenario(frequency_hz: float, dimension: int = 2, tube: bool = True) -> Scenario:
    """A box with a blind tube, shaken at one frequency."""
    blind = Tube(
        kind="tube", diameter_m=0.024, length_m=0.05, left_end_x_m=0.07, axis_height_m=0.035
    )
    return Scenario(
        dimension=dimension,
        box=Box(width_m=0.12, height_m=0.11, depth_m=0.04),
        obstacles=(blind,) if tube else (),
        fill=Fill(layers=(Layer(height_m=0.027, repeat=3),)),
        vibration=(
            VibrationStage(frequency_hz=frequency_hz, acceleration_g=1.5, duration_s=DURATION_S),
        ),
    )


def lattice(grains: int, dimension: int, seed: int) -> tuple[np.ndarray, float]:
    """Positions in a bed of about 0.09 m outside the tube, from the bottom up, and a radius."""
    depth = 1.0 if dimension == 2 else 0.04
    step = ((0.12 * 0.085 - 0.05 * 0.03) * depth / grains) ** (1 / dimension)
    axes = [np.arange(step / 2, 0.12, step), np.arange(step / 2, 0.2, step)]
    if dimension == 3:
        axes.insert(1, np.arange(step / 2, 0.04, step))
    position = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)
    in_tube = (position[:, 0] > 0.068) & (np.abs(position[:, -1] - 0.035) < 0.016)
    position = position[~in_tube]
    position = position[np.argsort(position[:, -1], kind="stable")][:grains]
    jitter = np.random.default_rng(seed).normal(0, 0.03 * step, position.shape)
    return position + jitter, 0.47 * step


def snapshots(run: Run, fill: float, grains: int, count: int) -> list[Snapshot]:
    """Layers fall in, then the topmost grains go into the tube in proportion to the fill."""
    dimension = run.scenario.dimension
    bed, radius = lattice(grains, dimension, run.seed)
    layer = 1 + np.minimum(2, np.arange(grains) * 3 // grains)
    rng = np.random.default_rng(run.seed)
    filling = count // 4
    times = np.linspace(-FILLING_S, -0.1, filling).tolist()
    times += np.linspace(0, DURATION_S, count - filling).tolist()
    found = []
    for number, shaken_s in enumerate(times):
        here = layer <= 1 + number if number < filling else layer > 0
        position = bed.copy()
        if shaken_s > 0:
            share = 1 - np.exp(-2 * shaken_s)
            moved = int(0.08 * grains * fill * share)
            chosen = np.arange(grains - moved, grains)
            position[chosen, 0] = 0.07 + 0.05 * fill * rng.random(moved)
            position[chosen, -1] = 0.025 + 0.02 * rng.random(moved)
            position[: grains - moved, -1] *= 1 - 0.03 * share
        n = int(here.sum())
        found.append(
            Snapshot(
                time_s=FILLING_S + shaken_s,
                vibration_time_s=shaken_s if shaken_s >= 0 else np.nan,
                stage="settle" if shaken_s < 0 else "vibrate",
                id=np.arange(1, grains + 1)[here],
                layer=layer[here],
                position_m=position[here],
                velocity_m_s=np.zeros((n, dimension)),
                spin_rad_s=np.zeros((n, 3)),
                radius_m=np.full(n, radius),
            )
        )
    return found


def write_study(
    folder: Path,
    planted: Mapping[float, float] = PLANTED,
    replicates: int = 3,
    failed: Sequence[str] = (FAILED,),
    spread: float = 0.01,
    grains: int = 200,
    count: int = 12,
    dimension: int = 2,
    tube: bool = True,
) -> Path:
    """Write a study folder with planted tube fills; what fails stops before its vibration ends."""
    runs = []
    for frequency in planted:
        for replicate in range(1, replicates + 1):
            at = scenario(frequency, dimension, tube)
            at = at.model_copy(update={"seed": 1000 + replicate})
            name = f"f{frequency:g}_r{replicate}"
            runs.append(Run(folder.name, name, {KEY: frequency}, replicate, at, {}))
    write_plan(runs, folder)
    (folder / "study.yaml").write_text("title: Which frequency fills the tube best?\n")
    noise = np.random.default_rng(7)
    for run in runs:
        value = planted[run.parameters[KEY]] + float(noise.normal(0, spread))
        write_run(folder / "runs" / run.run, run, value, run.run in failed, grains, count)
    return folder


ENGINES = {"lammps": 2.8e6, "liggghts": 3.4e6, "reference": 2.1e7}
"""Engines with a speed in grain-steps per second."""


def write_twins(
    folder: Path,
    fill: Mapping[str, float],
    packing: Mapping[str, float],
    replicates: int = 6,
    failed: Sequence[str] = (),
) -> Path:
    """Write a study over engines that share their seeds, with planted fills and solid fractions."""
    runs = []
    for engine in fill:
        for replicate in range(1, replicates + 1):
            at = scenario(50.0)
            chosen = at.engine.model_copy(update={"name": engine})
            at = at.model_copy(update={"seed": 1000 + replicate, "engine": chosen})
            name = f"engine_{engine}_r{replicate}"
            runs.append(Run(folder.name, name, {"engine.name": engine}, replicate, at, {}))
    write_plan(runs, folder)
    (folder / "study.yaml").write_text(
        "title: Do three engines fill and shake the same box alike?\n"
        "sweep: {keys: {engine.name: [" + ", ".join(fill) + "]}}\n"
        "equivalence: {keys: [engine.name], margins: {solid_fraction: 0.005, "
        "tube_fill_fraction: 0.03}}\n"
    )
    noise = np.random.default_rng(7)
    for run in runs:
        engine = run.scenario.engine.name
        value = fill[engine] + float(noise.normal(0, 0.012))
        dense = packing[engine] + float(noise.normal(0, 0.0015))
        write_run(
            folder / "runs" / run.run,
            run,
            value,
            run.run in failed,
            200,
            12,
            dense,
            ENGINES[engine],
        )
    return folder


def write_cross_check(folder: Path, engine: str = "lammps", replicates: int = 3) -> Path:
    """Write a study over frequency on the reference engine, with one point on another too."""
    runs = []
    for frequency in PLANTED:
        for part in ("sweep", "cross_check"):
            own = part == "sweep"
            for replicate in range(1, replicates + 1) if own or frequency == 50.0 else ():
                at = scenario(frequency)
                chosen = at.engine.model_copy(update={"name": "reference" if own else engine})
                at = at.model_copy(update={"seed": 1000 + replicate, "engine": chosen})
                name = f"{'' if own else 'engine_lammps_'}f{frequency:g}_r{replicate}"
                one = Run(folder.name, name, {KEY: frequency}, replicate, at, {}, part)  # type: ignore[arg-type]
                runs.append(one)
    write_plan(runs, folder)
    (folder / "study.yaml").write_text(
        "title: Which frequency fills the tube best?\n"
        "scenario: {engine: {name: reference}}\n"
        f"sweep: {{keys: {{{KEY}: [25, 50, 100]}}}}\nreplicates: {replicates}\n"
        f"cross_check: {{engine: {engine}, at: {{{KEY}: 50}}}}\n"
        "equivalence: {margins: {solid_fraction: 0.005, tube_fill_fraction: 0.03}}\n"
    )
    noise = np.random.default_rng(7)
    for run in runs:
        own = run.part == "sweep"
        # the other engine's runs would win if they counted
        value = PLANTED[run.parameters[KEY]] + (0.0 if own else 0.3)
        value += float(noise.normal(0, 0.005))
        dense = 0.78 + float(noise.normal(0, 0.0015))
        speed = ENGINES[run.scenario.engine.name]
        write_run(folder / "runs" / run.run, run, value, False, 200, 12, dense, speed)
    return folder


def write_run(
    path: Path,
    run: Run,
    value: float,
    is_failed: bool,
    grains: int,
    count: int,
    packing: float = 0.78,
    speed: float | None = None,
) -> None:
    made = snapshots(run, value, grains, count)
    made = made[: count // 3] if is_failed else made
    write_snapshots(path, made)
    rows = []
    for snapshot in made:
        share = 1 - np.exp(-2 * np.nan_to_num(snapshot.vibration_time_s))
        tube = {"tube_fill_fraction": value * share / (1 - np.exp(-2 * DURATION_S))}
        tube["tube_sand_m2"] = tube["tube_fill_fraction"] * 0.0012
        rows.append(
            {
                "time_s": snapshot.time_s,
                "vibration_time_s": snapshot.vibration_time_s,
                "stage": snapshot.stage,
                "grains": len(snapshot.id),
                **(tube if run.scenario.obstacles else {}),
                "bed_height_m": 0.085 - 0.003 * share,
                "solid_fraction": packing + 0.04 * share,
                "apparent_density_corrected_kg_m3": 1800 + 90 * share,
                "coordination": 3.2 + 0.5 * share,
                "largest_overlap_fraction": 0.02,
            }
        )
    pd.DataFrame(rows).to_csv(path / "measures.tsv", sep="\t", index=False)
    outcome = RunOutcome(Outcome.FINISHED, "", made[-1].time_s, FILLING_S + DURATION_S)
    if is_failed:
        said = "3 grains passed through the floor at 0.71 s."
        outcome = RunOutcome(Outcome.LOST_GRAINS, said, made[-1].time_s, FILLING_S + DURATION_S)
    outcome.write(path / "outcome.json")
    cost = {
        "engine": run.scenario.engine.name, "version": "22 Jul 2025", "ranks": 1, "grains": grains,
        "steps": 400_000, "grain_steps": 400_000 * grains, "wall_s": 41.5, "engine_wall_s": 40.9,
        "cpu_s": 41.2, "peak_memory_bytes": 1.6e8, "time_step_s": 6.1e-6,
        "time_step_fraction": 0.5, "largest_overlap_fraction": 0.034,
        "grain_steps_per_s": speed or 400_000 * grains / 41.5,
    }  # fmt: skip
    said = {
        "template_sha256": "0f3a" * 16,
        "seed": run.seed,
        "versions": {"lammps": "2025.7.22.4.0", "numpy": "2.4.6"},
        "machine": {"system": "Linux", "cores": 2},
        "command": "snakemake --configfile config/studies/tube_demo.yaml",
    }
    save_manifest(path, {"cost": cost, "origin": said})
