"""After vibration the box stops smoothly and the sand comes to rest, on every engine alike."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.engines.driver import Driver
from sandmould.engines.durations import grain_steps, run_s, stage_s
from sandmould.engines.guard import measure_health
from sandmould.engines.program import Stage, StepCounts, build_program, displacements
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.registry import engine_of
from sandmould.kinds.sand.measure import measure_snapshot
from sandmould.runs.outcome import Outcome
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.reading import Origin, validated
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind
from sandmould.scenario.vibration import STOP_PERIODS, RestStage, VibrationStage
from tests.scenes import tube_scene
from tests.verification.cases.bench import Bench, scene, vector

SHAKE = {"acceleration_g": 3.0, "frequency_hz": 50.0, "duration_s": 0.06}
REST = {"kind": "rest", "longest_s": 1.0}


def stages_of(*vibration: dict[str, Any], **changes: Any) -> list[Stage]:
    """Stages after the fill."""
    program = build_program(tube_scene(vibration=list(vibration), **changes))
    return [stage for stage in program.stages if not stage.layer]


def test_a_rest_follows_the_last_vibration_unless_it_is_switched_off() -> None:
    assert [s.name for s in stages_of(SHAKE)] == ["vibrate_1", "rest"]
    assert [s.name for s in stages_of(SHAKE, measure_at_rest=False)] == ["vibrate_1"]
    assert stages_of() == []


def test_a_rest_stands_anywhere_and_is_numbered_by_its_place() -> None:
    stages = stages_of(SHAKE, REST, SHAKE)
    assert [s.name for s in stages] == ["vibrate_1", "rest_2", "vibrate_3", "rest"]
    assert [s.name for s in stages_of(SHAKE, REST)] == ["vibrate_1", "rest_2"]
    assert [s.name for s in stages_of(REST, SHAKE)] == ["rest_1", "vibrate_2", "rest"]
    assert [s.stop_s for s in stages_of(REST, SHAKE)] == [0.0, 0.0, STOP_PERIODS / 50.0]


def test_the_rule_of_the_fill_is_applied_once_the_box_stands() -> None:
    rule, stop_s = tube_scene().fill.settling, STOP_PERIODS / 50.0
    first, last = (s.settling for s in stages_of(SHAKE, REST, SHAKE) if s.settling)
    assert first is not None
    assert last is not None
    assert first.shortest_s == last.shortest_s == pytest.approx(rule.shortest_s + stop_s)
    assert first.longest_s == pytest.approx(1.0 + stop_s)
    assert last.longest_s == pytest.approx(rule.longest_s + stop_s)


def test_a_plan_pays_for_the_rest() -> None:
    with_rest, without = (
        build_program(tube_scene(measure_at_rest=at_rest)) for at_rest in (True, False)
    )
    rest_s = stage_s(with_rest, with_rest.stages[-1])
    assert rest_s > with_rest.stages[-1].stop_s
    assert run_s(with_rest) == pytest.approx(run_s(without) + rest_s)
    assert grain_steps(with_rest) > grain_steps(without)


def course_of(stages: list[Stage], step_s: float, counts: StepCounts) -> np.ndarray:
    """Place of the box in every step of some stages."""
    parts = []
    for stage in stages:
        steps = counts.steps(stage.stop_s) + 100
        if stage.kind is StageKind.VIBRATE and stage.vibration is not None:
            steps = counts.vibration(stage.vibration)
        parts.append(displacements(stage, 1, steps, step_s))
    return np.concatenate(parts)


def test_the_box_stops_without_a_jump() -> None:
    sand = tube_scene(vibration=[SHAKE])
    counts, stage = StepCounts.of(sand), sand.vibrations[0]
    peak = stage.amplitude_m * stage.angular_frequency_rad_s**2
    hardest = []
    for changes in ({}, {"measure_at_rest": False}):
        stages = stages_of(SHAKE, **changes)
        course = np.append(course_of(stages, counts.step_s, counts), [0.0, 0.0])
        acceleration = np.diff(course, 2) / counts.step_s**2
        hardest.append(np.abs(acceleration[10:]).max() / peak)  # behind the kick of the start
        assert course[-3] == 0.0
    # As hard as the vibration and 5 % more (STOP_PERIODS); a dead stop takes all velocity within
    # one step or two.
    assert hardest[0] < 1.06
    assert hardest[1] > 0.5 / (stage.angular_frequency_rad_s * counts.step_s)


def test_with_a_ramp_of_its_own_the_box_stands_already() -> None:
    vibrating, resting = stages_of(SHAKE | {"ramp_s": 0.02})
    assert (resting.stop_s, resting.stops_smoothly, vibrating.stops_smoothly) == (0.0, False, False)
    assert not displacements(resting, 1, 1000, StepCounts.of(tube_scene()).step_s).any()


@pytest.mark.parametrize("frame", ["box", "laboratory"])
@pytest.mark.parametrize("engine", ["reference", "lammps", "liggghts"])
def test_every_engine_moves_the_box_so(engine: str, frame: str) -> None:
    # A free grain without gravity stays where it was, so relative to the box it moves by -s(t).
    direction = (0.6, 0.8)
    stage = {"acceleration_g": 3.0, "frequency_hz": 50.0, "duration_s": 0.06}
    given = scene(engine, 2, step_s=5e-5, frame=frame,
                  vibration=[stage | {"direction": list(direction)}],
                  rest={"load_every_steps": 20, "check_every_s": 1e-3})  # fmt: skip
    start, off_course = vector(2, 0.05, 0.05), []
    with Bench(given) as bench:
        bench.place([start], stage=-2)
        shaken, rest = given.vibrations[0], bench.program.stages[-1]
        while True:
            now = bench.advance(1.7e-3)
            t = now.time_s - bench.session.step_s
            course = start - shaken.displacements_at(np.array(t), True) * np.array(direction)
            off_course.append(np.abs(now.position_m[0] - course).max())
            if bench.session.stage_over:
                bench.session.end_stage()
                bench.session.start_stage(rest)
            if t > shaken.whole_duration_s + 1.2 * rest.stop_s:
                break
    # A velocity of 0.1 m/s keeps for 0.1 s what each of 2 000 steps rounds off of s(t).
    assert max(off_course) < 1e-11
    np.testing.assert_allclose(now.position_m[0], start, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["lammps", "liggghts"])
def test_sand_rests_at_the_end_of_a_run_of_a_deck(engine: str, tmp_path: Path) -> None:
    names, speeds, _ = computed(engine, tmp_path, SHAKE)
    assert names == ["vibrate_1", "rest"]
    assert speeds[1] < 0.02 < speeds[0]


def test_sand_rests_at_the_end_of_a_run(tmp_path: Path) -> None:
    slower = SHAKE | {"frequency_hz": 20.0, "duration_s": 0.1}
    names, speeds, clocks = computed("reference", tmp_path, SHAKE, REST, slower)
    assert names == ["vibrate_1", "rest_2", "vibrate_3", "rest"]
    assert max(speeds[1], speeds[3]) < 0.02 < min(speeds[0], speeds[2])
    # Whole steps: two at rest and one for rounding up, in either stage.
    assert clocks[0] == clocks[1] == pytest.approx(0.06, abs=1e-4)
    assert clocks[2] == clocks[3] == pytest.approx(0.16, abs=2e-4)


def computed(
    engine: str, folder: Path, *vibration: dict[str, Any]
) -> tuple[list[str], list[float], list[float]]:
    """Name of each stage after the fill, speed of the grains and clock of vibration at its end."""
    discs = {"disc_inertia": "sphere"} if engine == "liggghts" else {}
    sand = tube_scene(
        engine={"name": engine},
        background_damping={"form": "none"},
        sand=discs,
        fill={"layers": [{"count": 60}]},
        rest={"rms_speed_m_s": 0.02},
        vibration=list(vibration),
        time_step={"fraction": 0.9},
    )
    program, module = build_program(sand), engine_of(sand)
    module.write_deck(program, {}, folder, "rest", "test")
    session = module.open_session(program, folder, folder / "engine.log")
    names, speeds, clocks = [], [], []
    for stage in program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
        session.end_stage()
        if not stage.layer:
            snapshot = session.snapshot()
            names.append(snapshot.stage)
            speeds.append(measure_health(sand, snapshot).rms_speed_m_s)
            clocks.append(snapshot.vibration_time_s)
    session.close()
    return names, speeds, clocks


class EndedVibration(VibrationStage):
    """A stage that ends at any phase of its period."""

    @property
    def whole_duration_s(self) -> float:
        """The duration as it is."""
        return self.duration_s


def test_the_phase_at_which_vibration_ends_does_not_decide_the_packing() -> None:
    sand = tube_scene(engine={"name": "reference"}, obstacles=[], fill={"layers": [{"count": 160}]},
                      time_step={"fraction": 0.9})  # fmt: skip
    session = ReferenceSession(build_program(sand))
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    while not session.stage_over:
        session.advance()
    filled = session.save_checkpoint()
    at_speed, at_rest = [], []
    for phase in (0.0, 0.25, 0.5, 0.75):
        stage = EndedVibration(frequency_hz=12, acceleration_g=3.0, duration_s=(3 + phase) / 12)
        shaken = sand.model_copy(update={"vibration": (stage,)})
        session.restore_checkpoint(filled)
        for part, found in zip(build_program(shaken).stages[-2:], (at_speed, at_rest), strict=True):
            session.start_stage(part)
            while not session.stage_over:
                session.advance()
            found.append(measure_snapshot(shaken, session.snapshot())["solid_fraction"])
    # The bed is in the air for half of a period; landed it packs alike.
    assert np.ptp(at_speed) > 0.1
    assert np.ptp(at_rest) < 0.25 * np.ptp(at_speed)
    assert min(at_rest) > max(at_speed) - 0.02


def test_sand_that_does_not_come_to_rest_says_which_key_allows_how_long(tmp_path: Path) -> None:
    sand = tube_scene(
        engine={"name": "reference"},
        rest={"rms_speed_m_s": 0.02},
        vibration=[SHAKE, REST | {"longest_s": 0.051}],
    )
    program = build_program(sand)
    engine_of(sand).write_deck(program, {}, tmp_path, "rest", "test")
    outcome = Driver(program, tmp_path, "rest", "hash").run()
    assert outcome.outcome is Outcome.NOT_SETTLED
    said = "the sand was not at rest after vibration.1.longest_s = 0.051; at the last check: "
    assert outcome.detail.startswith(said)


@pytest.mark.parametrize(
    ("entry", "key", "valid"),
    [
        ({"kind": "pause"}, "vibration.0.kind", "'vibrate', 'rest'"),
        ({"kind": "rest", "longest_s": 0}, "vibration.0.longest_s", "greater than 0"),
        ({"kind": "rest", "frequency_hz": 5}, "vibration.0.frequency_hz", "longest_s"),
    ],
)
def test_a_stage_that_cannot_be_is_refused(entry: Any, key: str, valid: str) -> None:
    with pytest.raises(BadInputError) as refused:
        validated(Scenario, {"vibration": [entry]}, Origin())
    (problem,) = refused.value.problems
    assert problem.key.startswith(key.removesuffix(".kind"))
    assert valid in problem.valid


def test_a_rest_shorter_than_its_rule_is_refused() -> None:
    sand = tube_scene(vibration=[SHAKE, REST | {"longest_s": 0.05}])
    (problem,) = problems(sand)
    assert (problem.key, problem.value) == ("vibration.1.longest_s", 0.05)
    assert problem.valid == "more than fill.settling.shortest_s, 0.05 s"
    assert isinstance(sand.vibration[1], RestStage)
    assert math.isclose(sand.vibrations[0].frequency_hz, 50.0)
