"""Small scenes for LIGGGHTS, and the mark of tests that need its executable."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.deck import Deck
from sandmould.engines.liggghts.process import executable
from sandmould.engines.liggghts.render import write_deck
from sandmould.engines.liggghts.session import LiggghtsSession
from sandmould.engines.program import build_program
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from tests.scenes import TUBE_SCENE

needs_liggghts = pytest.mark.skipif(
    executable() is None and "CI" not in os.environ, reason="LIGGGHTS is not installed"
)
"""Skip where LIGGGHTS is missing, but fail on the machine that checks every change."""
RADIUS_M = 0.002
SPRINGS = ("normal_stiffness_n_m", "tangential_stiffness_n_m", "rolling_stiffness_n_m")
WALL_SPRINGS = dict.fromkeys(SPRINGS, 2e4)
SOFT = {name: dict.fromkeys(SPRINGS, 500.0) for name in ("grain_grain", "grain_wall")}
"""Springs for spheres, which weigh so much less than discs 0.1 m thick; steps get longer."""
WHAT_LIGGGHTS_CAN: dict[str, Any] = {
    "engine": {"name": "liggghts"},
    "background_damping": {"form": "none"},
    "sand": {"disc_inertia": "sphere"},
}
ONE_GRAIN: dict[str, Any] = {
    "engine": {"name": "liggghts"},
    "background_damping": {"form": "none"},
    "box": {"width_m": 0.05, "height_m": 0.05, "depth_m": 0.05},
    "sand": {
        "disc_inertia": "sphere",
        "size_scale": 1.0,
        "size_classes": 1,
        "sieve": [
            {"opening_m": 2 * RADIUS_M / 1.001, "passing_fraction": 0},
            {"opening_m": 2 * RADIUS_M * 1.001, "passing_fraction": 1},
        ],
        "disc_thickness_m": 0.1,
    },
    "contact": {"springs_at_size_scale": None},
    "fill": {"layers": [{"count": 1}]},
    "time_step": {"fraction": 0.01},
    "rest": {"load_every_steps": 1, "check_every_s": 1e-4},
    "record": {"series_every_s": 1e-4, "snapshot_every_s": 1e-4},
}
"""An empty box of which only the floor matters."""


def _merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    return merge(base, changes, Origin(), "test")


def liggghts_scene(**changes: Any) -> Scenario:
    """Make the small tube scene as LIGGGHTS can compute it, with sections changed."""
    base = _merged(TUBE_SCENE, WHAT_LIGGGHTS_CAN)
    return Scenario.model_validate(_merged(base, changes))


def one_grain_scene(**changes: Any) -> Scenario:
    """Make the scene of one grain, with sections changed."""
    return Scenario.model_validate(_merged(ONE_GRAIN, changes))


def open_liggghts(
    scenario: Scenario, folder: Path, checkpoint: Path | None = None
) -> LiggghtsSession:
    """Render a scenario into a folder and open LIGGGHTS on it."""
    program = build_program(scenario)
    write_deck(program, {}, folder, "test", "test")
    deck = Deck.read(folder / "deck.in")
    return LiggghtsSession(program, deck, folder, folder / "engine.log", checkpoint)


def put_grain(
    session: LiggghtsSession, height_m: float, speed_m_s: list[float], spin_rad_s: float = 0.0
) -> None:
    """Place the one grain over the floor, away from the walls and the floor's diagonal."""
    session.insert_layer(1)
    d = session._scenario.dimension
    place = np.array([[*[0.011, 0.017][: d - 1], height_m]])
    # A roll along x turns about -z in 2D and about y in 3D.
    spin = [0.0, 0.0, -spin_rad_s] if d == 2 else [0.0, spin_rad_s, 0.0]
    session.set_state(place, np.array([speed_m_s]), np.array([spin]))
