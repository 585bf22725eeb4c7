"""Calibration on maps whose truth is known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from sandmould.definition.comparing import calibration_problems
from sandmould.definition.sweep import Sweep
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.calibration.posterior import OffTheMapError, iso_line, posterior
from sandmould.statistics.calibration.sands import calibrate, write_materials
from sandmould.statistics.config import Calibration, Target
from sandmould.statistics.emulator import Emulator, TooFewRunsError, fit_emulator

KEYS = ("contact.grain_grain.friction", "contact.grain_grain.rolling_arm_fraction")
NOISE_DEG = 0.5


def angle_deg(points: np.ndarray) -> np.ndarray:
    """An angle that rises with both parameters: a ridge."""
    return 12.0 + 14.0 * np.tanh(2.0 * points[:, 0]) + 40.0 * points[:, 1]


def time_s(points: np.ndarray) -> np.ndarray:
    """A time that tells friction from rolling."""
    return 1.0 + 0.5 * points[:, 0] - 0.8 * points[:, 1]


def grid(replicates: int = 3) -> np.ndarray:
    values = np.meshgrid(np.linspace(0.1, 0.9, 6), np.linspace(0.0, 0.3, 6), indexing="ij")
    return np.repeat(np.stack(values, axis=-1).reshape(-1, 2), replicates, axis=0)


def runs(replicates: int = 3, seed: int = 1) -> pd.DataFrame:
    rng, points = np.random.default_rng(seed), grid(replicates)
    return pd.DataFrame({
        KEYS[0]: points[:, 0],
        KEYS[1]: points[:, 1],
        "outcome_code": 0,
        "cpu_s": 20.0,
        "heap_angle_deg": angle_deg(points) + rng.normal(0.0, NOISE_DEG, len(points)),
        "outflow_time_s": time_s(points) + rng.normal(0.0, 0.01, len(points)),
    })  # fmt: skip


def emulated(replicates: int = 3) -> Emulator:
    table = runs(replicates)
    return fit_emulator(
        "heap_angle_deg", table[list(KEYS)].to_numpy(), table["heap_angle_deg"].to_numpy()
    )


@pytest.mark.parametrize("replicates", [1, 3])
def test_emulator_knows_the_map_between_its_runs_and_its_own_error(replicates: int) -> None:
    emulator = emulated(replicates)
    rng = np.random.default_rng(7)
    inside = rng.uniform([0.1, 0.0], [0.9, 0.3], (200, 2))
    mean, se = emulator.at(inside)
    error = np.abs(mean - angle_deg(inside))
    # A smooth surface through 36 points is known better than one run of a point is.
    assert error.max() < 1.5 * NOISE_DEG
    assert (error < 2 * se).mean() > 0.85
    assert emulator.noise_sd == pytest.approx(NOISE_DEG, rel=0.4)


def test_too_few_points_make_no_emulator() -> None:
    with pytest.raises(TooFewRunsError, match="known at 5 settings, at least 6"):
        fit_emulator("angle", grid(1)[:5], np.ones(5))


def test_the_line_of_an_angle_is_that_of_the_map() -> None:
    line = iso_line(emulated(), Target(value=28.0, sd=0.2))
    there = np.isfinite(line.first)
    on_it = np.column_stack([line.first, line.second])[there]
    assert there.sum() > 60
    np.testing.assert_allclose(angle_deg(on_it), 28.0, atol=NOISE_DEG)
    inside = there & np.isfinite(line.low)
    assert (line.low[inside] <= line.first[inside]).all()
    assert (line.first[inside] <= line.high[inside]).all()


def test_a_second_measure_breaks_the_ridge() -> None:
    table = runs()
    truth = np.array([[0.45, 0.12]])
    targets = {
        "heap_angle_deg": {"value": float(angle_deg(truth)[0]), "sd": 0.3},
        "outflow_time_s": {"value": float(time_s(truth)[0]), "sd": 0.006},
    }
    asked = Calibration.model_validate({"sands": [{"name": "planted", "targets": targets}]})
    result = calibrate(asked, table, KEYS)
    (one,) = result.sands
    assert one.posterior is not None
    assert one.by_first is not None
    assert one.by_first.correlation < -0.8  # along the ridge
    assert one.posterior.sd[0] < 0.5 * one.by_first.sd[0]
    assert one.posterior.bits > one.by_first.bits + 1.0
    assert np.abs(np.array(one.posterior.mode) - truth[0]).max() < 0.08
    assert result.worths[0].measure == "outflow_time_s"
    assert result.worths[0].bits_added > 1.0


def test_posteriors_hold_the_truth_as_often_as_they_claim() -> None:
    emulators = {"heap_angle_deg": emulated()}
    rng = np.random.default_rng(3)
    held = 0
    for truth in rng.uniform([0.15, 0.02], [0.85, 0.28], (200, 2)):
        mean, se = emulators["heap_angle_deg"].at(truth[None])
        # What the map does not know is part of the truth too.
        value = rng.normal(float(mean[0]), math.hypot(float(se[0]), 0.3))
        found = posterior(emulators, {"heap_angle_deg": Target(value=value, sd=0.3)})
        i = int(np.abs(found.first - truth[0]).argmin())
        j = int(np.abs(found.second - truth[1]).argmin())
        held += int(found.region()[i, j])
    # 95 % of 200 with a standard error of 1.5 %; the grid's edges take some.
    assert 0.90 <= held / 200 <= 1.0


def test_what_is_taken_for_granted_picks_a_place_on_the_ridge() -> None:
    emulators = {"heap_angle_deg": emulated()}
    targets = {"heap_angle_deg": Target(value=28.0, sd=0.3)}
    found = posterior(emulators, targets, [None, Target(value=0.1763, sd=0.01)])
    friction, arm = found.mode
    assert arm == pytest.approx(0.1763, abs=0.01)
    assert angle_deg(np.array([[friction, arm]]))[0] == pytest.approx(28.0, abs=NOISE_DEG)
    assert found.sd[1] < 0.015


def test_a_target_off_the_map_is_told() -> None:
    with pytest.raises(OffTheMapError, match=r"heap_angle_deg = 60 cannot be calibrated: the runs"):
        posterior({"heap_angle_deg": emulated()}, {"heap_angle_deg": Target(value=60.0, sd=0.5)})


def test_what_cannot_be_calibrated_leaves_the_other_sands(tmp_path: Path) -> None:
    sands = [
        {"name": "steep", "targets": {"heap_angle_deg": {"value": 60.0, "sd": 0.5}}},
        {"name": "unknown", "targets": {"colour": {"value": 1.0, "sd": 0.5}}},
        {"name": "good", "targets": {"heap_angle_deg": {"value": 28.0, "sd": 0.5}}},
    ]
    result = calibrate(Calibration.model_validate({"sands": sands}), runs(), KEYS)
    assert "cannot be calibrated" in result.sands[0].problem
    assert "colour cannot be calibrated: the runs of this map give heap" in result.sands[1].problem
    (written,) = write_materials(result, Scenario(), "a_study", tmp_path)
    tree = yaml.safe_load(written.read_text(encoding="utf-8"))
    friction = tree["contact"]["grain_grain"]["friction"]
    assert friction["unit"] == "1"
    assert "study a_study for heap_angle_deg 28 (sd 0.5)" in friction["source"]
    arm = tree["contact"]["grain_grain"]["rolling_arm_fraction"]["value"]
    assert angle_deg(np.array([[friction["value"], arm]]))[0] == pytest.approx(28.0, abs=NOISE_DEG)


def test_another_study_adds_its_columns_and_its_cost() -> None:
    other = runs(seed=2).rename(columns={"outflow_time_s": "run_out_m"})
    other = other.drop(columns="heap_angle_deg")
    sands = [{"name": "one", "targets": {"heap_angle_deg": {"value": 28.0, "sd": 0.5}}}]
    table = runs().drop(columns="outflow_time_s")
    result = calibrate(
        Calibration.model_validate({"sands": sands}), table, KEYS, {"column_map": other}
    )
    (worth,) = result.worths
    assert worth.measure == "column_map__run_out_m"
    assert worth.cpu_s == 20.0


@pytest.mark.parametrize(
    ("keys", "valid"),
    [
        ({KEYS[0]: [0.1, 0.2]}, "exactly two swept keys"),
        ({KEYS[0]: [0.1, 0.2], "engine.name": ["lammps"]}, "a number of the material"),
        ({KEYS[0]: [0.1, 0.2], "box.width_m": [0.1]}, "a number of the material"),
    ],
)
def test_a_sweep_that_cannot_be_calibrated_is_told(keys: dict[str, object], valid: str) -> None:
    target = {"heap_angle_deg": {"value": 25.0, "sd": 0.5}}
    asked = Calibration.model_validate({"sands": [{"name": "a", "targets": target}]})
    found = list(calibration_problems(asked, Sweep.model_validate({"keys": keys})))
    assert valid in found[0].valid


def test_names_of_sands_differ() -> None:
    sand = {"name": "a", "targets": {"heap_angle_deg": {"value": 25.0, "sd": 0.5}}}
    asked = Calibration.model_validate({"sands": [sand, sand]})
    sweep = Sweep.model_validate({"keys": {KEYS[0]: [0.1], KEYS[1]: [0.1]}})
    assert [p.key for p in calibration_problems(asked, sweep)] == ["calibration.sands.1.name"]
