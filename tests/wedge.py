"""One frictionless disc squeezed between the left wall and the end of a foam bar, no gravity.

The bar is one element high and of the first order: its end stays straight, so that two contact
springs and the bar, a third spring, are in series.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.program import StepCounts
from sandmould.pattern_fe.coupling.explicit_foam import ContactBound, ExplicitFoam
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.session import CoupledSession
from sandmould.pattern_fe.coupling.stepped_sessions import MonolithicSession
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.shapes import bar, mesh_of
from sandmould.pattern_fe.supports import Supports
from sandmould.scenario.pattern import Loop
from sandmould.scenario.scenario import Scenario
from tests.scenes import open_engine
from tests.verification.one_grain import RADIUS_M, one_grain_scene

Array = NDArray[np.float64]
SQUEEZE_M = 1e-4
"""Overlap with either side before the bar gives way."""
WALL_N_M = 2e4
HEIGHT_M = 0.015
"""Of the disc and of the middle of the bar."""
LENGTH_M = 0.02
DISCS = 8
"""On the plate."""
FILL: dict[str, Any] = {"layers": [{"count": 1}], "settling": {"shortest_s": 1.9}}


def wedge_pattern(young_pa: float, gap_m: float = 2 * (RADIUS_M - SQUEEZE_M)) -> Pattern:
    """A bar clamped at its right end, its left end at a distance from the wall."""
    mesh = mesh_of(bar(LENGTH_M, 0.01), 0.01).translated(np.array([gap_m, HEIGHT_M - 0.005]))
    return Pattern(mesh, Supports(clamped=("right",)), Foam(young_pa), 1, 0.1)


def end_stiffness_n_m(pattern: Pattern) -> float:
    """Force on the middle of the bar's end over the way it goes."""
    surface = pattern.surface
    end = surface.vertices_m[:, 0] < surface.vertices_m[:, 0].min() + 1e-9
    load = np.zeros_like(surface.vertices_m)
    load[end, 0] = 0.5
    moved = pattern.on_surface(pattern.solve_linear(pattern.on_nodes(load)))
    return float(1.0 / moved[end, 0].mean())


def wedge_scene(pattern: Pattern, damping_ratio: float = 0.95, **changes: Any) -> Scenario:
    """The scene of a bar; the fill ends when a test does."""
    outline = pattern.surface.vertices_m[pattern.surface.outer_line]
    wall = {"friction": 0.0, "damping_ratio": damping_ratio, "normal_stiffness_n_m": WALL_N_M}
    scene = {
        "gravity_m_s2": 0.0,
        "obstacles": [{"kind": "polygon", "name": "pattern", "vertices_m": outline.tolist()}],
        "contact": {"grain_wall": wall},
        "time_step": {"step_s": 1e-5},
        "engine": {"name": "reference"},
        "fill": FILL,
        "rest": {"load_every_steps": 1, "check_every_s": 2e-3},
    }
    return one_grain_scene(**(scene | changes))


def monolithic(
    pattern: Pattern, scenario: Scenario, folder: Path, checkpoint: Path | None = None, **foam: Any
) -> MonolithicSession:
    """The monolithic scheme of a scene; see ``ExplicitFoam`` for the settings of the foam."""
    explicit = ExplicitFoam(pattern, scenario.step_s, ContactBound.of(scenario, pattern), **foam)
    sand, counts = open_engine(scenario, folder, checkpoint), StepCounts.of(scenario)
    body = FoamBody(pattern)
    return MonolithicSession(sand, explicit, body, "pattern", 0.01, counts, folder, checkpoint)


def staggered(pattern: Pattern, scenario: Scenario, folder: Path, **changes: Any) -> CoupledSession:
    """The staggered loop of a scene."""
    values: dict[str, Any] = {
        "window_s": 2e-4, "scheme": "quasi_newton", "factor": 0.1, "least_factor": 1e-3,
        "most_factor": 1.0, "repeats": 0, "tolerance": 1e-9,
        "largest_displacement_m": 0.01,
    }  # fmt: skip
    # Unchecked: the limit of a factor may lie above 1, which no scenario may ask for.
    settings = Loop.model_construct(**(values | changes))
    inner, counts = open_engine(scenario, folder), StepCounts.of(scenario)
    return CoupledSession(inner, FoamBody(pattern), "pattern", settings, counts, folder)


def put_disc(session: Any, x_m: float = RADIUS_M - SQUEEZE_M, speed_m_s: float = 0.0) -> None:
    """Place the disc before the bar and begin."""
    session.insert_layer(1)
    session.set_state(np.array([[x_m, HEIGHT_M]]), np.array([[speed_m_s, 0.0]]), np.zeros((1, 3)))
    session.start_stage(session.stage)


def end_moved_m(session: Any, pattern: Pattern) -> float:
    """How far the bar's end has been pushed in."""
    vertices = pattern.surface.vertices_m[pattern.surface.outer_line]
    end = vertices[:, 0] < vertices[:, 0].min() + 1e-9
    return float(session.displacement_m[end, 0].mean())


def plate_pattern() -> Pattern:
    """A plate that lies on springs, free to bend."""
    plate = mesh_of(bar(0.045, 0.005), 0.005).translated(np.array([0.0025, 0.01]))
    return Pattern(plate, Supports(bedding_n_m3=1.2e7), order=1, thickness_m=0.1)


def plate_scene(pattern: Pattern, **changes: Any) -> Scenario:
    """The scene of discs that press on the plate by their weight."""
    fill = FILL | {"layers": [{"count": DISCS}]}
    return wedge_scene(pattern, gravity_m_s2=9.80665, fill=fill, **changes)


def rest_on_plate(session: Any) -> None:
    """Place the discs on the plate and let them come to rest."""
    across = np.linspace(0.006, 0.044, DISCS)
    places = np.column_stack([across, np.full(DISCS, 0.015 + RADIUS_M)])
    session.insert_layer(1)
    session.set_state(places, np.zeros((DISCS, 2)), np.zeros((DISCS, 3)))
    session.start_stage(session.stage)
    for _ in range(15):
        session.advance()
