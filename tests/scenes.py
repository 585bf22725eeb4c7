"""Small scenes that tests share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sandmould.engines.deck import Deck
from sandmould.engines.lammps.render import write_deck
from sandmould.engines.lammps.session import LammpsSession
from sandmould.engines.program import build_program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.session import Session
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario

TUBE_SCENE: dict[str, Any] = {
    "box": {"width_m": 0.08, "height_m": 0.08},
    "obstacles": [
        {
            "kind": "tube",
            "diameter_m": 0.02,
            "length_m": 0.03,
            "left_end_x_m": 0.05,
            "axis_height_m": 0.025,
        }
    ],
    "sand": {"size_scale": 8.0, "size_classes": 3, "disc_thickness_m": 0.1},
    "contact": {"springs_at_size_scale": None},
    "fill": {"layers": [{"count": 60, "repeat": 2}]},
    "vibration": [{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.06}],
    "record": {"snapshot_every_s": 0.02},
    "time_step": {"bed_fraction": 0.0},
}
"""About the smallest scene in which sand flows into a tube; soft, for the length of its step, which
is one from beginning to end."""


def tube_scene(**changes: Any) -> Scenario:
    """Make the small tube scene, with sections changed."""
    return Scenario.model_validate(merge(TUBE_SCENE, changes, Origin(), "test"))


def open_lammps(scenario: Scenario, folder: Path, checkpoint: Path | None = None) -> LammpsSession:
    """Render a scenario into a folder and open LAMMPS on it."""
    program = build_program(scenario)
    write_deck(program, {}, folder, "test", "test")
    deck = Deck.read(folder / "deck.in")
    return LammpsSession(program, deck, folder, folder / "engine.log", checkpoint)


def open_engine(scenario: Scenario, folder: Path, checkpoint: Path | None = None) -> Session:
    """Open LAMMPS or the reference engine, whichever a scenario names."""
    if scenario.engine.name == "lammps":
        return open_lammps(scenario, folder, checkpoint)
    return ReferenceSession(build_program(scenario), checkpoint)
