"""Runs that differ only in what they record compute the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.deck import Deck
from sandmould.engines.driver import Driver
from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_of
from sandmould.engines.snapshot import Snapshot
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario
from tests.liggghts_scenes import liggghts_scene, needs_liggghts
from tests.patterns import _one_thread  # noqa: F401
from tests.scenes import tube_scene
from tests.workflow.runs import SOON, last_snapshot

RECORDS: tuple[dict[str, Any], ...] = (
    {"series_every_s": 0.005, "snapshot_every_s": 0.01, "checkpoint_every_s": 0.01},
    {"series_every_s": 0.02, "snapshot_every_s": 0.04, "checkpoint_every_s": 1.0},
)
ENGINES = pytest.mark.parametrize(
    "scene",
    [tube_scene, pytest.param(liggghts_scene, marks=needs_liggghts)],
    ids=["lammps", "liggghts"],
)
PLANK: dict[str, Any] = {
    "box": {"width_m": 0.06, "height_m": 0.1},
    "obstacles": [],
    "pattern": {
        "shape": {"kind": "bar", "width_m": 0.06, "height_m": 0.01},
        "position_m": [0.0, 0.005],
        "element_m": 0.01,
        "young_modulus_pa": 1e6,
        "supports": {"clamped": ["left", "right"]},
    },
    "fill": {"layers": [{"count": 10, "repeat": 2}]},
    "vibration": [{"acceleration_g": 1.0, "frequency_hz": 50.0, "duration_s": 0.02}],
    "rest": SOON,
    "engine": {"name": "reference"},
    # in_step's scaled masses swing with the box in a longer one
    "time_step": {"fraction": 0.4},
}


def last_of(scene: Scenario, folder: Path) -> Snapshot:
    """Compute a scene, and give its last snapshot."""
    program = build_program(scene)
    folder.mkdir(parents=True)
    engine_of(scene).write_deck(program, {}, folder, "test", "test")
    opening = open_coupled if scene.pattern is not None else None
    outcome = Driver(program, folder, "test", "hash", opening).run()
    assert outcome.outcome is Outcome.FINISHED, outcome.detail
    return last_snapshot(folder / "work")


def assert_same(one: Snapshot, other: Snapshot) -> None:
    assert one.time_s == other.time_s
    for name in ("position_m", "velocity_m_s", "spin_rad_s", "pattern_m", "pattern_load_n"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def test_sand_is_the_same_bit_for_bit(tmp_path: Path) -> None:
    scenes = [
        tube_scene(engine={"name": "reference"}, record=record, rest=SOON) for record in RECORDS
    ]
    assert_same(*(last_of(s, tmp_path / str(i)) for i, s in enumerate(scenes)))


@pytest.mark.parametrize("scheme", ["aitken", "measured", "per_layer", "in_step"])
def test_sand_and_pattern_are_the_same_bit_for_bit(scheme: str, tmp_path: Path) -> None:
    pattern = {**PLANK["pattern"], "loop": {"scheme": scheme}}
    scenes = [
        with_surface(tube_scene(**{**PLANK, "pattern": pattern, "record": record}))
        for record in RECORDS
    ]
    ended = [last_of(s, tmp_path / str(i)) for i, s in enumerate(scenes)]
    assert_same(*ended)
    drawn_m = scenes[0].scene.outlines[0].vertices_m
    assert ended[0].pattern_m is not None
    assert np.abs(ended[0].pattern_m - drawn_m).max() > 1e-6


@pytest.mark.parametrize("scene", [tube_scene, liggghts_scene], ids=["lammps", "liggghts"])
def test_decks_are_cut_at_checks_never_at_records(scene: Any, tmp_path: Path) -> None:
    decks = []
    for number, record in enumerate(RECORDS):
        given = scene(record=record)
        folder = tmp_path / str(number)
        engine_of(given).write_deck(build_program(given), {}, folder, "test", "test")
        blocks = Deck.read(folder / "deck.in").blocks
        # what a deck run by hand writes down
        decks.append({name: block.text for name, block in blocks.items() if name != "alone"})
    assert decks[0] == decks[1]


@pytest.mark.parametrize("frame", ["box", "laboratory"])
@ENGINES
def test_neither_records_nor_checkpoints_change_a_digit(
    scene: Any, frame: str, tmp_path: Path
) -> None:
    short = {
        "frame": frame,
        "fill": {"layers": [{"count": 30}]},
        "vibration": [{"acceleration_g": 1.0, "frequency_hz": 50.0, "duration_s": 0.02}],
        "rest": {"rms_speed_m_s": 0.05},
    }
    folders = [tmp_path / str(i) for i, _ in enumerate(RECORDS)]
    ended = [last_of(scene(**short, record=r), f) for r, f in zip(RECORDS, folders, strict=True)]
    assert_same(*ended)
    written = [any(folder.glob("work/checkpoint_*")) for folder in folders]
    assert written == [True, False]
