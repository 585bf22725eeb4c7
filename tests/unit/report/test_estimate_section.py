"""The report of a study that asks for a value: heaps, map and calibrated sands of planted runs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from sandmould.definition.run import Run
from sandmould.engines.durations import cost_before
from sandmould.engines.snapshot import Snapshot
from sandmould.kinds.sand.measure import write_measures
from sandmould.report.page import write_report
from sandmould.runs.manifest import read_manifest, save_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.scenario.box import Box, Plate
from sandmould.scenario.fill import Discharge, Fill, Layer
from sandmould.scenario.scenario import Scenario
from sandmould.study.calibration.run import write_calibration
from sandmould.study.collect import collect
from sandmould.study.plan.plan_files import VERDICT_FILE, read_run
from tests.planned import write_plan
from tests.snapshots import write_snapshots

FRICTION = "contact.grain_grain.friction"
ARM = "contact.grain_grain.rolling_arm_fraction"
R_M = 1e-3
SLOPES = {(f, a): 15.0 + 20.0 * f + 40.0 * a for f in (0.1, 0.4, 0.7) for a in (0.0, 0.1, 0.2)}
"""Angle of the planted heap by friction and rolling arm."""


def scene() -> Scenario:
    """A small hopper over a floor."""
    plate = {"kind": "plate", "size_m": (0.08, 0.01)}
    return Scenario(
        box=Box(width_m=0.4, height_m=0.2),
        obstacles=(
            Plate(**plate, name="floor_left", centre_m=(0.14, 0.125)),
            Plate(kind="plate", name="gate", centre_m=(0.2, 0.125), size_m=(0.04, 0.01)),
            Plate(**plate, name="floor_right", centre_m=(0.26, 0.125)),
        ),
        fill=Fill(layers=(Layer(count=10),), over_x_m=(0.1, 0.3)),
        discharge=Discharge(gate="gate"),
    )


def heap(angle_deg: float, time_s: float) -> Snapshot:
    """Grains on a square grid under two slopes."""
    axes = np.arange(R_M, 0.4, 2 * R_M), np.arange(R_M, 0.1, 2 * R_M)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    under = 0.055 - np.abs(grid[:, 0] - 0.2) * np.tan(np.radians(angle_deg))
    position = grid[grid[:, 1] < under]
    n = len(position)
    return Snapshot(
        time_s, np.nan, "discharge", np.arange(1, n + 1), np.ones(n, dtype=np.int64), position,
        np.zeros((n, 2)), np.zeros((n, 3)), np.full(n, R_M),
    )  # fmt: skip


def write_planted(folder: Path, points: dict[tuple[float, float], float], extra: str) -> Path:
    """Write a study whose runs left heaps of known angle."""
    runs = [
        Run(folder.name, f"f{f:g}_a{a:g}_r{r}".replace(".", "p"), {FRICTION: f, ARM: a}, r,
            scene().model_copy(update={"seed": r}), {})
        for f, a in points for r in (1, 2)
    ]  # fmt: skip
    write_plan(runs, folder)
    said = "title: Which angle?\nobjective: {measure: heap_angle_deg, better: neither%s}\n"
    (folder / "study.yaml").write_text(said % extra)
    for run in runs:
        angle = points[run.parameters[FRICTION], run.parameters[ARM]] + 0.4 * (run.replicate - 1.5)
        place = folder / "runs" / run.run
        write_snapshots(place, [heap(angle, 1.0), heap(angle, 2.0)])
        header = "time_s\tvibration_time_s\tstage\tsurface\tforce_x_n\tforce_y_n\n"
        rows = "0.5\t-1\tsettle_1\tgate\t0\t-2.0\n0.5\t-1\tsettle_1\tleft\t-0.5\t0\n"
        (place / "loads.tsv").write_text(header + rows)
        write_measures(read_run(place / "scenario.yaml").scenario, place, place / "measures.tsv")
        RunOutcome(Outcome.FINISHED, "", 2.0, 2.0).write(place / "outcome.json")
        cost = {**cost_before(run.scenario).row(), "cpu_s": 3.5, "grain_steps_per_s": 1e6}
        save_manifest(place, {"cost": cost, "origin": {"commit": "abc"}})
    collect(folder)
    return folder


def test_one_setting_is_told_beside_what_was_reported(tmp_path: Path) -> None:
    extra = ", reported: {value: 25.0, by: 'A paper'}"
    folder = write_planted(tmp_path / "one", {(0.5, 0.1): 29.0}, extra)
    write_report(folder, folder / "report.html")
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert '<p class="first">The heap angle is 29' in text
    assert "Run every setting at least 3 times" in text
    assert "(2 runs)" in text
    assert "A paper reports 25" in text
    assert "Heap and hopper of run f0p5_a0p1_r1" in text
    assert "Settings compared with the best" not in text


def test_one_run_has_no_interval_and_a_failed_one_no_say_in_what_is_typical(
    tmp_path: Path,
) -> None:
    folder = write_planted(tmp_path / "one", {(0.5, 0.1): 29.0}, "")
    place = folder / "runs" / "f0p5_a0p1_r2"
    RunOutcome(Outcome.UNSTABLE, "", 0.1, 2.0).write(place / "outcome.json")
    for run, grains in ((folder / "runs" / "f0p5_a0p1_r1", 400), (place, 100)):
        manifest = read_manifest(run)
        save_manifest(run, manifest | {"cost": manifest["cost"] | {"grains": grains}})
    collect(folder)
    write_report(folder, folder / "report.html")
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "its error is unknown: one run" in text
    assert "<dt>grains in a run</dt><dd>400</dd>" in text


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_planted(tmp_path_factory.mktemp("results") / "a_map", SLOPES, "")
    with (folder / "study.yaml").open("a") as file:
        file.write(
            "calibration:\n  sands:\n"
            "  - {name: sand_26, targets: {heap_angle_deg: {value: 26.0, sd: 0.5}}}\n"
            "  - {name: sand_80, targets: {heap_angle_deg: {value: 80.0, sd: 0.5}}}\n"
        )
    return folder


@pytest.mark.slow
def test_a_map_has_its_table_its_picture_and_its_sands(mapped: Path) -> None:
    write_report(mapped, mapped / "report.html")
    text = (mapped / "report.html").read_text(encoding="utf-8")
    # Planted from 17 to 37 degrees.
    assert re.search(r"The heap angle goes from 1[67]\.\d ± \d\.\d° .* to 3[67]\.\d° ", text)
    assert (mapped / VERDICT_FILE).read_text(encoding="utf-8") == (
        "sand_26 has friction 0.28 ± 0.12 and rolling arm 0.137 ± 0.058. Nothing on the map gives "
        "what was measured of sand_80.\n"
    )
    assert "Contour map of the heap angle" in text
    assert "5.71°" in text  # tan(alpha) = 0.1 as an angle
    assert (
        "sand_26: heap angle 26 ± 0.5 was measured; most probable are friction 0.28 ± 0.12 and "
        "rolling arm 0.137 ± 0.058 (± a standard deviation)."
    ) in text
    assert "with more of the one, less of the other fits nearly as well." in text
    assert "By the first measured value alone 18 % of the map is still possible." in text
    assert "heap_angle_deg = 80 cannot be calibrated: the runs" in text
    assert "Posterior of sand_26" in text
    names = {path.name for path in (mapped / "figures").iterdir()}
    assert {"map.png", "heaps.png", "posterior_sand_26.png"} <= names
    assert "posterior_sand_80.png" not in names


def test_the_sands_that_are_found_become_materials(mapped: Path, tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"^sand_80: heap_angle_deg = 80 cannot be .*$"):
        write_calibration(mapped, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["sand_26.yaml"]
