"""A scenario as the arrays and laws of the reference solver."""

from __future__ import annotations

import numpy as np

from sandmould.dem.contact_law import Law
from sandmould.dem.grains import Grains
from sandmould.dem.motion import COMPONENTWISE, ISOTROPIC, NONE, VISCOUS, Damping
from sandmould.dem.steps import DemScene
from sandmould.dem.surfaces import Surfaces
from sandmould.engines.program import Stage
from sandmould.engines.reference.moved_solver import MovedSolver
from sandmould.engines.solid_surfaces import add_solids
from sandmould.scenario.box import piston_wall
from sandmould.scenario.contact import ContactLaw
from sandmould.scenario.placement import PlannedLayer
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.time_step import inertia_factor

SKIN_OVER_DIAMETER = 0.3
"""Neighbour skin over the mean diameter. A run of 1 134 shaken discs took no longer at 0.4 and more
than twice as long at 0.15, one busy machine, two runs each."""

LID_WAITS_M = 1e3
"""How far over the box its lid waits until it is put on: no layer falls from there."""


def _law(scenario: Scenario, law: ContactLaw, step_s: float) -> Law:
    return Law(**scenario.laws.parameters(law, scenario.dimension, step_s))


def _damping(scenario: Scenario) -> Damping:
    damping = scenario.background_damping
    if damping.form == "none":
        return Damping(NONE, 0.0, 0.0)
    if damping.form == "viscous":
        return Damping(VISCOUS, damping.viscous_translation_per_s, damping.viscous_rotation_per_s)
    form = ISOTROPIC if damping.form == "nonviscous_isotropic" else COMPONENTWISE
    return Damping(form, damping.nonviscous_translation, damping.nonviscous_rotation)


def scene_of(scenario: Scenario, stage: Stage, step_s: float) -> DemScene:
    """What does not change during a stage."""
    d = scenario.dimension
    up = (0.0,) * (d - 1) + (1.0,)
    direction = up if stage.vibration is None else stage.vibration.unit_direction(d)
    return DemScene(
        _law(scenario, scenario.laws.grain_grain, step_s),
        _law(scenario, scenario.laws.grain_wall, step_s),
        _damping(scenario),
        (0.0,) * (d - 1) + (-scenario.gravity_m_s2,),
        direction,
        scenario.frame == "box",
        step_s,
    )


def surfaces_of(scenario: Scenario) -> Surfaces:
    """Walls, blocks, outlines, meshes and round solids as surfaces."""
    scene = scenario.scene
    surfaces = Surfaces(scenario.dimension)
    for wall in scene.walls:
        surfaces.add_plane(wall.name, wall.point_m, wall.normal)
    piston = scenario.piston
    if piston is not None and piston.wall == "top":
        lid = piston_wall(piston, scenario.box, scenario.dimension, -LID_WAITS_M)
        surfaces.add_plane(lid.name, lid.point_m, lid.normal)
    for block in scene.blocks:
        surfaces.add_facets(block.name, block.corners(), block.facets())
    add_solids(surfaces, scene)
    return surfaces


def solver_of(scenario: Scenario, stage: Stage, step_s: float) -> MovedSolver:
    """Make the solver of a scenario, without grains."""
    return MovedSolver(
        scene_of(scenario, stage, step_s),
        surfaces_of(scenario),
        SKIN_OVER_DIAMETER * scenario.sand.mean_diameter_m(scenario.dimension),
        scenario.engine.ranks,
        scenario.record.orientation,
    )


def grains_of(scenario: Scenario, layer: PlannedLayer, base_m: float, first_id: int) -> Grains:
    """Grains of a planned layer at rest, its lowest point at a height, or as placed by hand."""
    d, n = scenario.dimension, len(layer.radius_m)
    radius, spins = layer.radius_m, 1 if d == 2 else 3
    position, by_hand = layer.position_m.copy(), layer.velocity_m_s
    if by_hand is None:
        position[:, -1] += base_m
    mass = scenario.sand.grain_mass_kg(1.0, d) * (2 * radius) ** d
    factor = inertia_factor(scenario.sand, scenario.laws, scenario.time_step, d)
    return Grains.of(
        first_id + np.arange(n),
        position,
        np.zeros((n, d)) if by_hand is None else by_hand.copy(),
        np.zeros((n, spins)),
        radius.copy(),
        mass,
        factor * mass * radius**2,
    )
