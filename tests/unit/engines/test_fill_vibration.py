"""Sand that is poured into a vibrating box: one sine from the first layer until after the last."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould import ROOT
from sandmould.engines.durations import grain_steps, stage_s
from sandmould.engines.program import StepCounts, build_program, displacements
from sandmould.kinds.sand.kind import SAND
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.fill import FillVibration
from sandmould.study.plan.expand import expand
from sandmould.study.plan.fills import share_fills
from sandmould.study.plan.load_study import open_study
from tests.scenes import open_engine, tube_scene
from tests.verification.cases.bench import OMEGA_RAD_S, RADIUS_M, Bench, law, scene, vector

SHAKE = {"acceleration_g": 1.5, "frequency_hz": 50.0, "layer_s": 0.25, "after_s": 0.075}


def test_the_box_vibrates_from_the_first_layer_until_after_the_last() -> None:
    program = build_program(tube_scene(fill={"vibration": SHAKE}))
    names = [stage.name for stage in program.stages]
    assert names == ["pour_1", "pour_2", "settle", "vibrate_1", "rest"]
    assert [stage.layer for stage in program.stages] == [1, 2, 0, 0, 0]
    counts = StepCounts.of(program.scenario)
    first, second, rest = program.stages[:3]
    steps = [stage.longest_steps(counts) for stage in (first, second)]
    # Two steps at rest, as in every stage of vibration; 0.575 s are 28.75 periods, so 29.
    assert sum(steps) == counts.steps(0.58) + 2
    assert steps[0] == counts.steps(0.25)
    assert sum(stage_s(program, stage) for stage in (first, second)) == pytest.approx(0.58)
    assert rest.vibration_steps == sum(steps)
    assert rest.longest_key == "fill.settling.longest_s"
    layer = program.counts[0]
    shaken = build_program(program.scenario.model_copy(update={"vibration": ()}))
    planned = grain_steps(shaken) * counts.step_s
    expected = layer * (0.25 + 2 * 0.33 + 2 * stage_s(program, rest))
    assert planned == pytest.approx(expected, rel=1e-9)


def test_the_walls_follow_one_sine_over_all_layers_and_stop_without_a_jump() -> None:
    program = build_program(tube_scene(fill={"layers": [{"count": 9, "repeat": 4}],
                                             "vibration": SHAKE}))  # fmt: skip
    counts = StepCounts.of(program.scenario)
    *pours, rest = program.stages[:5]
    parts = [displacements(s, 1, s.longest_steps(counts), counts.step_s) for s in pours]
    assert len(parts) == 4
    course = np.concatenate(parts)
    shaken = program.scenario.fill.vibration
    assert shaken is not None
    time_s = counts.step_s * np.arange(len(course))
    sine = shaken.amplitude_m * np.sin(2 * np.pi * 50.0 * time_s)
    np.testing.assert_allclose(course[:-2], sine[:-2], rtol=0, atol=1e-15)
    after = displacements(rest, 1, counts.steps(rest.stop_s) + 100, counts.step_s)
    acceleration = np.diff(np.concatenate([course, after]), 2) / counts.step_s**2
    peak = shaken.amplitude_m * (2 * np.pi * 50.0) ** 2
    assert np.abs(acceleration[10:]).max() < 1.06 * peak
    assert not after[-50:].any()


@pytest.mark.parametrize("frame", ["box", "laboratory"])
@pytest.mark.parametrize(
    ("engine", "dimension"),
    [("reference", 2), ("reference", 3), ("lammps", 2), ("lammps", 3), ("liggghts", 3)],
)
def test_grains_of_every_layer_stand_still_where_nothing_pulls(
    engine: str, dimension: int, frame: str
) -> None:
    # Without gravity a grain stays where it was dropped, whatever the box does round it.
    direction = vector(dimension, 0.6, 0.8)
    given = scene(
        engine, dimension, step_s=5e-5, frame=frame,
        rest={"load_every_steps": 20, "check_every_s": 1e-3},
        fill={"layers": [{"count": 1, "repeat": 2}], "drop_height_m": 0.05,
              "vibration": {"acceleration_g": 3.0, "frequency_hz": 50.0, "layer_s": 0.047,
                            "direction": list(direction)}},
    )  # fmt: skip
    assert given.fill.vibration is not None
    whole = given.fill.vibration.over(2)
    with Bench(given) as bench:
        session, (first, second, rest) = bench.session, bench.program.stages[:3]
        bench.place([vector(dimension, 0.08, 0.006)])
        places = []
        for stage in (first, second, rest):
            if stage is not first:
                session.end_stage()
                if stage.layer:
                    session.insert_layer(stage.layer)
                session.start_stage(stage)
            for _ in range(30):
                now = bench.advance(2.3e-3)
                s = whole.displacements_at(np.array(now.time_s - session.step_s), True)
                places.append(now.position_m + s * direction)
                if session.stage_over:
                    break
    assert len(places[0]) == 1
    of_first = np.array([at[0] for at in places])
    start = vector(dimension, 0.08, 0.006)
    of_second = np.array([at[1] for at in places if len(at) == 2])
    np.testing.assert_allclose(of_first, [start] * len(of_first), atol=1e-9)
    np.testing.assert_allclose(of_second, [of_second[0]] * len(of_second), atol=1e-9)
    # It is dropped over the first one, wherever the box is.
    up = of_second[0][-1] - RADIUS_M - 0.05
    bed_m = max(of_first[0][-1] + RADIUS_M, 0.0)
    assert up == pytest.approx(bed_m, abs=1e-9)


@pytest.mark.parametrize("frame", ["box", "laboratory"])
def test_a_grain_on_the_floor_follows_the_box(frame: str) -> None:
    # Beside the box it is a driven oscillator, x'' + 2 w0 x' + w0^2 x = -s''.
    given = scene(
        "reference", 2, step_s=1e-5, gravity_m_s2=9.80665, frame=frame,
        wall=law(2, damping_ratio=1.0), contact={"dashpot": "plain"},
        rest={"load_every_steps": 20, "check_every_s": 1e-3},
        fill={"vibration": {"acceleration_g": 0.3, "frequency_hz": 50.0, "layer_s": 0.2}},
    )  # fmt: skip
    shaken = given.fill.vibration
    assert shaken is not None
    omega, sag = shaken.angular_frequency_rad_s, 9.80665 / OMEGA_RAD_S**2
    with Bench(given) as bench:
        bench.place([vector(2, 0.1, RADIUS_M - sag)])
        bench.advance(0.1)
        for _ in range(20):
            now = bench.advance(1.3e-3)
            time_s = now.time_s - bench.session.step_s
            wave = shaken.amplitude_m * omega**2 * np.exp(1j * omega * time_s)
            follows = wave / (OMEGA_RAD_S**2 - omega**2 + 2j * OMEGA_RAD_S * omega)
            expected = RADIUS_M - sag + follows.imag
            assert now.position_m[0, 1] == pytest.approx(expected, abs=0.02 * abs(follows))


def test_without_amplitude_every_bit_is_that_of_a_box_that_stands(tmp_path: Path) -> None:
    still = FillVibration.model_validate(SHAKE).model_copy(update={"acceleration_g": 0.0})
    sand = tube_scene(engine={"name": "reference"})
    ends = []
    for vibration in (None, still):
        fill = sand.fill.model_copy(update={"vibration": vibration})
        session = open_engine(sand.model_copy(update={"fill": fill}), tmp_path)
        program = build_program(sand.model_copy(update={"fill": fill}))
        session.insert_layer(1)
        session.start_stage(program.stages[0])
        session.advance(0.05)
        ends.append(session.snapshot())
        session.close()
    for name in ("position_m", "velocity_m_s", "spin_rad_s"):
        assert np.array_equal(getattr(ends[0], name), getattr(ends[1], name)), name


def test_runs_share_a_fill_that_vibrates_alike_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "trial.yaml"
    path.write_text(
        "based_on: tube\nscenario: {fill: {vibration: {acceleration_g: 1.5, frequency_hz: 50, "
        "layer_s: 0.5}}}\nsweep: {keys: {fill.vibration.acceleration_g: [1.0, 1.5], "
        "vibration.0.frequency_hz: [40, 50]}}\n"
    )
    runs, fills = share_fills(expand(open_study(path)), SAND.planning)
    assert len(fills) == 2
    for run in runs:
        acceleration = run.parameters["fill.vibration.acceleration_g"]
        (fill,) = (f for f in fills if f.run == run.fill)
        assert fill.scenario.fill.vibration.acceleration_g == acceleration


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"layer_s": 0.05}, "fill.vibration.layer_s = 0.05 cannot be used: valid is at least 0."),
        ({"direction": [0, 0, 1]}, "fill.vibration.direction = [0.0, 0.0, 1.0]"),
        ({"frequency_hz": 9000.0}, "fill.vibration.frequency_hz = 9000.0"),
        (
            {"hold": "unbalance", "acceleration_g": None,
             "unbalance": {"moment_kg_m": 0.01, "moving_mass_kg": 9, "mount_frequency_hz": 9}},
            "fill.vibration.hold = 'unbalance'",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_said(change: dict[str, Any], said: str) -> None:
    found = [str(x) for x in problems(tube_scene(fill={"vibration": SHAKE | change}))]
    assert any(said in problem for problem in found), found


def test_it_leaves_no_pause_between_layers() -> None:
    between = {"acceleration_g": 1.0, "duration_s": 0.02}
    both = tube_scene(fill={"vibration": SHAKE, "vibration_between_layers": between})
    assert "fill.vibration_between_layers" in [problem.key for problem in problems(both)]


def test_the_shipped_bracket_is_poured_into_a_vibrating_box() -> None:
    study = open_study(ROOT / "config" / "studies" / "bracket_fill_small.yaml")
    for run in expand(study):
        assert problems(run.scenario) == []
        stages = [stage.name for stage in build_program(run.scenario).stages]
        assert stages == ["pour_1", "pour_2", "pour_3", "pour_4", "settle"]


@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_a_run_goes_on_from_the_middle_of_a_pour(engine: str, tmp_path: Path) -> None:
    sand = tube_scene(
        engine={"name": engine},
        fill={"layers": [{"count": 20, "repeat": 2}], "vibration": SHAKE | {"layer_s": 0.15}},
    )
    stages = build_program(sand).stages
    straight = open_engine(sand, tmp_path)
    for stage in stages[:2]:
        straight.insert_layer(stage.layer)
        straight.start_stage(stage)
        while not straight.stage_over and straight.time_s < 0.2:
            straight.advance()
        if stage is stages[0]:
            straight.end_stage()
    kept = tmp_path / "kept"
    kept.mkdir()
    straight.write_checkpoint(kept)
    (tmp_path / "again").mkdir()
    resumed = open_engine(sand, tmp_path / "again", kept)
    ends = []
    for session in (straight, resumed):
        session.advance(0.05)
        assert session.stage.name == "pour_2"
        ends.append(session.snapshot().position_m)
        session.close()
    np.testing.assert_allclose(*ends, rtol=0, atol=0.0 if engine == "reference" else 1e-9)
