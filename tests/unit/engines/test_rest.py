"""Rest is decided by checks: speed and loads, several in a row, nobody holding the stage."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.engines.driver import Driver
from sandmould.engines.program import build_program
from sandmould.engines.rest import RestWatch
from sandmould.runs.outcome import Outcome
from sandmould.scenario.fill import Rest
from sandmould.scenario.reading import Origin, validated
from sandmould.scenario.scenario import Scenario
from tests.scenes import open_engine, tube_scene
from tests.verification.one_grain import RADIUS_M, one_grain_scene

WEIGHT_N = 5.0
SLOW_M_S = 0.001
SPRING_N_M = 2e4
SWING = 0.09
"""Share of its weight by which the load of a grain that swings on the floor is off at most."""


def watch(**rest: Any) -> RestWatch:
    return RestWatch(Rest(**({"checks": 3} | rest)), 0.01)


def seen(watch: RestWatch, speeds: list[float], loads: list[float]) -> list[bool]:
    """What the watch says after each check."""
    found = []
    for speed_m_s, load in zip(speeds, loads, strict=True):
        watch.check(speed_m_s, load * WEIGHT_N, WEIGHT_N)
        found.append(watch.at_rest)
    return found


def test_slow_sand_whose_loads_are_off_its_weight_is_not_at_rest() -> None:
    assert not any(seen(watch(), [SLOW_M_S] * 4, [1.09] * 4))
    assert not any(seen(watch(), [SLOW_M_S] * 4, [0.985] * 4))
    assert seen(watch(), [SLOW_M_S] * 4, [1.009, 0.991, 1.0, 1.0]) == [False, False, True, True]


def test_one_check_that_is_off_begins_the_count_anew() -> None:
    loads, speeds = [1.0] * 6, [SLOW_M_S] * 6
    assert seen(watch(), speeds, [1.0, 1.0, 1.02, 1.0, 1.0, 1.0]) == 5 * [False] + [True]
    assert seen(watch(), [SLOW_M_S, SLOW_M_S, 0.02, *speeds[:3]], loads) == 5 * [False] + [True]


def test_loads_are_not_asked_without_a_tolerance_or_without_weight() -> None:
    assert seen(watch(load_tolerance=None), [SLOW_M_S] * 3, [0.0] * 3)[-1]
    floating = watch()
    for _ in range(3):
        floating.check(SLOW_M_S, 0.0, 0.0)
    assert floating.at_rest
    assert math.isnan(floating.load_error)


def test_a_held_stage_goes_on_until_the_checks_pass_without_it() -> None:
    held = watch()
    for _ in range(5):
        held.hold("the pattern creeps")
        held.check(SLOW_M_S, WEIGHT_N, WEIGHT_N)
    assert held.sand_rests
    assert not held.at_rest
    assert held.sentence.startswith("the sand itself was at rest, but the pattern creeps; at the")
    assert seen(held, [SLOW_M_S] * 3, [1.0] * 3) == [False, False, True]


def test_a_held_stage_is_held_after_a_pause_too(tmp_path: Path) -> None:
    scenario = tube_scene(engine={"name": "reference"}, fill={"layers": [{"count": 5}]})
    straight = open_engine(scenario, tmp_path)
    straight.start_stage(build_program(scenario).stages[0])
    straight.insert_layer(1)
    straight.advance()
    straight.hold_rest("the pattern creeps")
    straight.write_checkpoint(tmp_path)
    paused = open_engine(scenario, tmp_path, tmp_path)
    for session in (straight, paused):
        session.advance()
    assert straight.rest_sentence.endswith("the pattern creeps")
    assert paused.rest_sentence == straight.rest_sentence


def ringing(engine: str) -> Scenario:
    """A grain on a floor without damping."""
    wall = {"damping_ratio": 0.0, "friction": 0.0, "normal_stiffness_n_m": SPRING_N_M}
    return one_grain_scene(
        contact={"grain_wall": wall},
        engine={"name": engine},
        time_step={"fraction": 0.2},
        fill={"layers": [{"count": 1}], "settling": {"shortest_s": 0.01, "longest_s": 0.02}},
        rest={"check_every_s": 5e-5, "load_every_steps": 1, "checks": 10},
    )


@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_a_ringing_bed_whose_floor_bears_nine_per_cent_too_much_is_refused(
    engine: str, tmp_path: Path
) -> None:
    scenario = ringing(engine)
    session = open_engine(scenario, tmp_path)
    session.insert_layer(1)
    weight_n = scenario.sand.grain_mass_kg(2 * RADIUS_M, 2) * scenario.gravity_m_s2
    low_m = RADIUS_M - (1.0 + SWING) * weight_n / SPRING_N_M
    session.set_state(np.array([[0.025, low_m]]), np.zeros((1, 2)), np.zeros((1, 3)))
    session.start_stage(build_program(scenario).stages[0])
    slow, off = [], []
    while not session.stage_over:
        session.advance()
        slow.append(float(np.abs(session.snapshot().velocity_m_s).max()))
        loads = session.surface_loads()
        if loads is not None:  # the last check is cut by the end of the stage
            off.append(abs(-loads["floor"][1] / weight_n - 1.0))
    at_rest, sentence = session.at_rest, session.rest_sentence
    session.close()
    # Any single check below the limit of speed ended the stage before.
    assert max(slow) < scenario.rest.rms_speed_m_s
    assert max(off) > 0.8 * SWING
    assert not at_rest
    assert "off the sand's weight (rest.load_tolerance 1 %)" in sentence


def test_a_bed_that_never_rests_ends_with_its_speed_and_its_loads_in_figures(
    tmp_path: Path,
) -> None:
    scene = tube_scene(
        engine={"name": "reference"},
        fill={"layers": [{"count": 30}], "settling": {"longest_s": 0.06}},
    )
    outcome = Driver(build_program(scene), tmp_path, "test", "hash").run()
    assert outcome.outcome is Outcome.NOT_SETTLED
    assert "layer 1 was not at rest after fill.settling.longest_s = 0.06" in outcome.detail
    assert "rms speed" in outcome.detail
    assert "% off the sand's weight (rest.load_tolerance 1 %)" in outcome.detail


@pytest.mark.parametrize(
    ("tree", "says"),
    [
        (
            {"fill": {"settling": {"rms_speed_m_s": 0.02}}},
            r"fill.settling.rms_speed_m_s = 0.02 .* the key rest.rms_speed_m_s, where this one has",
        ),
        (
            {"discharge": {"gate": "g", "settling": {"rms_speed_m_s": 0.02}}},
            r"discharge.settling = .* by rest.discharge_rms_speed_m_s",
        ),
        (
            {"record": {"load_every_steps": 5}},
            r"record.load_every_steps = 5 .* the key rest.load_every_steps, where this one has mov",
        ),
    ],
)
def test_a_key_that_has_moved_is_refused_with_its_new_name(tree: dict[str, Any], says: str) -> None:
    with pytest.raises(BadInputError, match=says):
        validated(Scenario, tree, Origin(), "scenario")
