"""Walls of LAMMPS that look at near grains alone give every digit that looking at all gives."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.deck import Deck
from sandmould.engines.lammps import render
from sandmould.engines.lammps.render import NearGrains, render_deck, write_deck
from sandmould.engines.lammps.session import LammpsSession
from sandmould.engines.program import build_program
from sandmould.scenario.scenario import Scenario
from tests.hopper import hopper_scene
from tests.scenes import tube_scene

SHORT: dict[str, Any] = {
    "fill": {"layers": [{"count": 20, "repeat": 2}], "settling": {"longest_s": 0.09}},
    "discharge": {"duration_s": 0.1},
    "vibration": [{"acceleration_g": 3.0, "frequency_hz": 50.0, "duration_s": 0.02}],
}
TUBE = {name: SHORT[name] for name in ("fill", "vibration")}


def of_all(text: str) -> str:
    """The deck with all grains in the groups, which an open gate still leaves."""
    return re.sub(r'"group (near_\w+) region \w+"', r'"group \1 union all"', text)


def computed(scenario: Scenario, folder: Path, edit: Any) -> LammpsSession:
    """Take a session through all stages of an edited deck, each up to its longest time."""
    program = build_program(scenario)
    write_deck(program, {}, folder, "test", "test")
    deck = Deck(edit((folder / "deck.in").read_text(encoding="utf-8")))
    session = LammpsSession(program, deck, folder, folder / "engine.log")
    for stage in program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
        session.end_stage()
    return session


def same(ours: LammpsSession, other: LammpsSession) -> bool:
    """Whether two sessions ended in the same digits, some grains touching walls."""
    a, b = ours.snapshot(), other.snapshot()
    assert np.abs(ours._recorded_loads()).max() > 0.01
    return all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for name in ("position_m", "velocity_m_s", "spin_rad_s")
    )


def in_groups(session: LammpsSession, scene: Scenario) -> float:
    """Grains of all groups, those in several counted as often."""
    groups = NearGrains(scene).groups()
    session.send(f'variable near equal "{"+".join(f"count({name})" for name in groups)}"')
    return float(session._lmp.extract_variable("near"))


@pytest.mark.parametrize(
    "scene",
    [
        tube_scene(frame="box", **TUBE),
        tube_scene(frame="laboratory", **TUBE),
        hopper_scene("lammps", **SHORT),
    ],
    ids=["box frame", "laboratory frame", "gate"],
)
def test_every_digit_is_that_of_walls_that_look_at_all(scene: Scenario, tmp_path: Path) -> None:
    ours = computed(scene, tmp_path / "near", str)
    other = computed(scene, tmp_path / "all", of_all)
    assert same(ours, other)
    if scene.discharge is None:  # sand that flows out is too fast for groups
        assert in_groups(ours, scene) < 0.8 * in_groups(other, scene)


@pytest.mark.parametrize(
    ("name", "value"),
    [("near_gain", 1e-4), ("near_slack", 1e-6)],
    ids=["grains faster than allowed for", "too fast for groups"],
)
def test_no_contact_is_missed_where_grains_are_fast(
    name: str, value: float, tmp_path: Path
) -> None:
    scene = tube_scene(frame="box", **TUBE)

    def narrow(text: str) -> str:
        return re.sub(rf"^(variable {name} index) \S+", rf"\1 {value}", text, flags=re.M)

    ours = computed(scene, tmp_path / "near", narrow)
    other = computed(scene, tmp_path / "all", of_all)
    assert same(ours, other)


def test_all_walls_share_a_group_where_lammps_has_too_few(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = hopper_scene("lammps", **SHORT)
    other = computed(scene, tmp_path / "one_each", str)
    monkeypatch.setattr(render, "MOST_GROUPS", 3)
    assert NearGrains(scene).groups() == ["near_walls", f"near_{NearGrains(scene).gate}"]
    assert "one group for all walls" in render_deck(build_program(scene), {}).text
    assert same(computed(scene, tmp_path / "one", str), other)


def test_groups_of_many_facets_fit() -> None:
    tube = {"kind": "tube", "diameter_m": 0.054, "length_m": 0.09, "axis_height_m": 0.054}
    box = {"width_m": 0.18, "depth_m": 0.12, "height_m": 0.18}
    for facets, one in ((24, False), (32, True)):
        given = {"left_end_x_m": 0.09, "wall_thickness_m": 0.006, "facets": facets}
        scene = tube_scene(dimension=3, box=box, obstacles=[{**tube, **given}])
        near = NearGrains(scene)
        assert near.one_for_all == one
        assert len(near.groups()) == (1 if one else 5 + facets)
        assert len(near.groups()) + 2 <= 32
