"""Bad values of a scenario: one sentence with file, key, value and what is valid."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould import ROOT
from tests.unit.refusing import refused

TABLE = (
    "based_on: tube\nscenario: {vibration: [{frequency_hz: 50, hold: unbalance, unbalance: {%s}}]}"
)
FULL = "moment_kg_m: 0.05, moving_mass_kg: 60, mount_frequency_hz: 8, flask_depth_m: 0.3"
CASES: dict[str, tuple[str, str]] = {
    "pattern outside the box": (
        "based_on: l_pattern\nscenario: {pattern: {position_m: [0.2, 0.0]}}",
        "trial.yaml: scenario.pattern.position_m = [0.2, 0.0] cannot be used: "
        "valid is one that can be computed: pattern reaches from (0.2, 0) to (0.32, 0.1) m, "
        "valid is inside the box from (0, 0) to (0.3, 0.3) m.",
    ),
    "default that an engine cannot take": (
        "based_on: l_pattern\nscenario: {engine: {name: liggghts}, frame: box}",
        "trial.yaml: scenario.engine.name = 'liggghts' cannot be used: valid is one with which "
        "scenario.pattern.loop.repeats of config/scenarios/l_pattern.yaml, here 12, is 0 on engine "
        "liggghts, which cannot go back.",
    ),
    "wrong type": (
        'based_on: tube\nscenario: {sand: {density_kg_m3: "heavy"}}',
        "trial.yaml: scenario.sand.density_kg_m3 = 'heavy' cannot be used: valid is a number "
        "in kg/m3.",
    ),
    "number in quotes": (
        'based_on: tube\nscenario: {box: {width_m: "0.2"}}',
        "trial.yaml: scenario.box.width_m = '0.2' cannot be used: valid is a number in m.",
    ),
    "unknown key": (
        "based_on: tube\nscenario: {box: {widht_m: 0.2}}",
        "trial.yaml: scenario.box.widht_m = 0.2 cannot be used: "
        "valid is one of the keys depth_m, height_m, width_m (did you mean width_m?).",
    ),
    "negative size": (
        "based_on: tube\nscenario: {sand: {size_scale: -4}}",
        "trial.yaml: scenario.sand.size_scale = -4 cannot be used: "
        "valid is a number of at least 0.01.",
    ),
    "negative opening": (
        "based_on: tube\nscenario: {sand: {sieve: [{opening_m: -1e-3, passing_fraction: 0}, "
        "{opening_m: 1e-3, passing_fraction: 1}]}}",
        "trial.yaml: scenario.sand.sieve.0.opening_m = -0.001 cannot be used: "
        "valid is a number of at least 1e-06.",
    ),
    "empty sieve": (
        "based_on: tube\nscenario: {sand: {sieve: []}}",
        "trial.yaml: scenario.sand.sieve = [] cannot be used: valid is a list of at least 2 "
        "entries.",
    ),
    "tube outside the box": (
        "based_on: tube\nscenario: {box: {width_m: 0.1}}",
        "trial.yaml: scenario.box.width_m = 0.1 cannot be used: valid is one with which "
        "scenario.obstacles.0.length_m of config/scenarios/tube.yaml, here 0.05, is at most 0.03, "
        "so that the tube ends in the box.",
    ),
    "tube beside the box": (
        "based_on: tube\nscenario: {box: {width_m: 0.06}}",
        "trial.yaml: scenario.box.width_m = 0.06 cannot be used: valid is one with which "
        "scenario.obstacles.0.left_end_x_m of config/scenarios/tube.yaml, here 0.07, is less than "
        "box.width_m, 0.06 m.",
    ),
    "tube above the box": (
        "based_on: tube\nscenario: {obstacles: [{kind: tube, diameter_m: 0.024, length_m: 0.05, "
        "left_end_x_m: 0.07, axis_height_m: 0.1}]}",
        "trial.yaml: scenario.obstacles.0.axis_height_m = 0.1 cannot be used: "
        "valid is a tube inside the box, 0.12 x 0.11 m.",
    ),
    "polygon outside the box": (
        "based_on: tube\nscenario: {obstacles: [{kind: polygon, "
        "vertices_m: [[0, 0], [0.2, 0], [0, 0.05]]}]}",
        "trial.yaml: scenario.obstacles.0.vertices_m = [[0.0, 0.0], [0.2, 0.0], [0.0, 0.05]] "
        "cannot be used: valid is a polygon inside the box, 0.12 x 0.11 m.",
    ),
    "polygon that crosses itself": (
        "based_on: tube\nscenario: {obstacles: [{kind: polygon, "
        "vertices_m: [[0.01, 0.01], [0.05, 0.05], [0.05, 0.01], [0.01, 0.04]]}]}",
        "trial.yaml: scenario.obstacles.0.vertices_m = [[0.01, 0.01], [0.05, 0.05], [0.05, 0.01], "
        "[0.01, 0.04]] cannot be used: valid is edges that neither cross nor touch one another.",
    ),
    "polygon in 3D": (
        "based_on: bracket\nscenario: {obstacles: [{kind: polygon, "
        "vertices_m: [[0, 0], [0.1, 0], [0, 0.05]]}]}",
        "trial.yaml: scenario.obstacles.0.kind = 'polygon' cannot be used: "
        "valid is plate, tube, cylinder, mesh or triangles in 3D.",
    ),
    "cylinder in 2D": (
        "based_on: tube\nscenario: {obstacles: [{kind: cylinder, centre_m: [0, 0, 0], "
        "diameter_m: 0.01, length_m: 0.02}]}",
        "trial.yaml: scenario.obstacles.0.kind = 'cylinder' cannot be used: "
        "valid is plate, tube or polygon in 2D; cylinder needs dimension: 3.",
    ),
    "cylinder outside the box": (
        "based_on: bracket\nscenario: {obstacles: [{kind: cylinder, centre_m: [0.07, 0.05, 0.02], "
        "axis: x, diameter_m: 0.05, length_m: 0.02}]}",
        "trial.yaml: scenario.obstacles.0.centre_m = [0.07, 0.05, 0.02] cannot be used: "
        "valid is a cylinder inside the box, 0.14 x 0.1 x 0.14 m.",
    ),
    "mesh that is not there": (
        "based_on: bracket\nscenario: {obstacles: [{kind: mesh, file: absent.stl}]}",
        "trial.yaml: scenario.obstacles.0.file = 'absent.stl' cannot be used: "
        "valid is a readable file (No such file or directory).",
    ),
    "mesh that is no STL": (
        "based_on: bracket\nscenario: {obstacles: [{kind: mesh, file: trial.yaml}]}",
        "trial.yaml: scenario.obstacles.0.file = 'trial.yaml' cannot be used: "
        "valid is an STL file, ASCII or binary, or one of OBJ, PLY, 3MF or STEP whose name ends "
        "so.",
    ),
    "mesh outside the box": (
        "based_on: tube_3d_small\nscenario: {obstacles: [{kind: mesh, "
        f"file: {ROOT}/config/meshes/bracket.stl, position_m: [0, 0, 0.05]}}]}}",
        "trial.yaml: scenario.obstacles.0.position_m = [0.0, 0.0, 0.05] cannot be used: valid is "
        "one that puts the mesh, now from (-30, -30, -7.95) to (50, 30, 8.05) m, inside the box, "
        "0.18 x 0.12 x 0.18 m; with unit_m: 0.001 it fits: it seems to be drawn in mm.",
    ),
    "grains larger than the tube": (
        "based_on: tube\nscenario: {sand: {size_scale: 30}}",
        "trial.yaml: scenario.sand.size_scale = 30 cannot be used: valid is one with which "
        "scenario.obstacles.0.diameter_m of config/scenarios/tube.yaml, here 0.024, is more than "
        "the largest grain, 0.0290371 m.",
    ),
    "time step above that of all beds": (
        "based_on: tube\nscenario: {time_step: {step_s: 1e-3}}",
        "trial.yaml: scenario.time_step.step_s = 0.001 cannot be used: valid is at most 4.577e-06 "
        "s, 2 times the critical step, set by normal grain-grain contact.",
    ),
    "time step above critical": (
        "based_on: tube\nscenario: {vibration: [], time_step: {step_s: 1e-3}}",
        "trial.yaml: scenario.time_step.step_s = 0.001 cannot be used: valid is at most the "
        "critical step 2.289e-06 s, set by normal grain-grain contact.",
    ),
    "frequency 0": (
        "based_on: tube\nscenario: {vibration: [{frequency_hz: 0, acceleration_g: 1.5}]}",
        "trial.yaml: scenario.vibration.0.frequency_hz = 0 cannot be used: "
        "valid is a number of at least 0.1.",
    ),
    "direction that is no direction": (
        "based_on: tube\nscenario: {vibration: [{acceleration_g: 1.5, direction: up}]}",
        "trial.yaml: scenario.vibration.0.direction = 'up' cannot be used: "
        "valid is one of 'vertical' or 'horizontal' or a list.",
    ),
    "layer that cannot fit": (
        "based_on: tube\nscenario: {fill: {layers: [{height_m: 0.2}]}}",
        "trial.yaml: scenario.fill.layers = 'a bed about 0.2125 m high' cannot be used: "
        "valid is layers that fit into box.height_m, 0.11 m.",
    ),
    "layer of a count that no memory holds": (
        "based_on: tube\nscenario: {fill: {layers: [{count: 10000000, repeat: 100}]}}",
        "trial.yaml: scenario.fill.layers = '1,000,000,000 grains' cannot be used: "
        "valid is at most 20,000,000 grains: fewer or thinner layers, or a larger "
        "sand.size_scale.",
    ),
    "flask with grains of their own size": (
        "based_on: tube_3d\nscenario: {sand: {size_scale: 0.2}, engine: {name: reference}}",
        "trial.yaml: scenario.sand.size_scale = 0.2 cannot be used: valid is at least 0.6 here: "
        "the layers hold 459,521,448 of at most 20,000,000 grains.",
    ),
    "gate that is not there": (
        "based_on: hopper\nscenario: {discharge: {gate: sluice}}",
        "trial.yaml: scenario.discharge.gate = 'sluice' cannot be used: valid is a plate among "
        "the obstacles: floor_left, gate, floor_right, side_left, side_right.",
    ),
    "gate that is no plate": (
        "based_on: tube\nscenario: {discharge: {gate: tube}}",
        "trial.yaml: scenario.discharge.gate = 'tube' cannot be used: "
        "valid is a plate among the obstacles: there is none.",
    ),
    "discharge without a gate": (
        "based_on: tube\nscenario: {discharge: {duration_s: 9}}",
        "trial.yaml: scenario.discharge.gate = None cannot be used: "
        "valid is a value: this key must be given.",
    ),
    "gate that is turned": (
        "based_on: hopper\nscenario: {obstacles: [{kind: plate, name: gate, "
        "centre_m: [0.6, 0.245], size_m: [0.06, 0.01], angle_deg: 10}]}",
        "trial.yaml: scenario.obstacles = [{'kind': 'plate', 'name': 'gate', 'centre_m': [0.6, "
        "0.245], 'size_m': [0.06, 0.01], 'angle_deg': 10}] cannot be used: valid is one with which "
        "scenario.discharge.gate of config/scenarios/hopper.yaml, here gate, is a plate with "
        "angle_deg 0, level or upright.",
    ),
    "pouring over what is outside the box": (
        "based_on: hopper\nscenario: {fill: {over_x_m: [0.45, 1.25]}}",
        "trial.yaml: scenario.fill.over_x_m = [0.45, 1.25] cannot be used: valid is two numbers "
        "between 0 and box.width_m, 1.2 m, at least three of the largest grains apart, "
        "0.0116148 m.",
    ),
    "pouring from right to left": (
        "based_on: hopper\nscenario: {fill: {over_x_m: [0.75, 0.45]}}",
        "trial.yaml: scenario.fill.over_x_m = [0.75, 0.45] cannot be used: valid is two numbers "
        "between 0 and box.width_m, 1.2 m, at least three of the largest grains apart, "
        "0.0116148 m.",
    ),
    "pouring through less than three grains": (
        "based_on: bracket\nscenario: {fill: {over_y_m: [0.05, 0.061]}}",
        "trial.yaml: scenario.fill.over_y_m = [0.05, 0.061] cannot be used: valid is two numbers "
        "between 0 and box.depth_m, 0.1 m, at least three of the largest grains apart, "
        "0.0116148 m.",
    ),
    "layers higher than what holds them": (
        "based_on: hopper\nscenario: {fill: {layers: [{count: 8000, repeat: 3}]}}",
        "trial.yaml: scenario.fill.layers = 'a bed about 0.555 m high' cannot be used: "
        "valid is layers that stay below 0.55 m, the top of what holds the sand.",
    ),
    "key of another kind": (
        "based_on: tube\nscenario: {obstacles: [{kind: tube, diameter_m: 0.02, length_m: 0.05, "
        "left_end_x_m: 0.07, axis_height_m: 0.02, radius_m: 90}]}",
        "trial.yaml: scenario.obstacles.0.radius_m = 90 cannot be used: valid is one of the keys "
        "axis_height_m, closed_end, diameter_m, facets, kind, left_end_x_m, length_m, "
        "name, section, wall_thickness_m.",
    ),
    "misspelt key of a kind": (
        "based_on: l_pattern\nscenario: {pattern: {shape: {kind: l_shape, reach: 0.1}}}",
        "trial.yaml: scenario.pattern.shape.reach = 0.1 cannot be used: valid is one of the keys "
        "height_m, kind, reach_m, thickness_m (did you mean reach_m?).",
    ),
    "shape without a kind": (
        "based_on: plates\nscenario: {shapes: [{low_m: [0, 0], high_m: [0.02, 0.02]}]}",
        "trial.yaml: scenario.shapes.0 = {'low_m': [0, 0], 'high_m': [0.02, 0.02]} cannot be used: "
        "valid is a mapping with a kind: rectangle, polygon, plates, mesh, image.",
    ),
    "obstacle without a kind": (
        "based_on: tube\nscenario: {obstacles: [{diameter_m: 0.02}]}",
        "trial.yaml: scenario.obstacles.0 = {'diameter_m': 0.02} cannot be used: valid is a "
        "mapping with a kind: plate, tube, polygon, cylinder, mesh, triangles.",
    ),
    "place of one number": (
        "based_on: plates\nscenario: {box: {low_m: [0], high_m: [0.02, 0.02]}}",
        "trial.yaml: scenario.box.low_m = [0] cannot be used: valid is a list of 2 or 3 entries.",
    ),
    "place with a word": (
        "based_on: plates\nscenario: {box: {low_m: [0, left], high_m: [0.02, 0.02]}}",
        "trial.yaml: scenario.box.low_m.1 = 'left' cannot be used: valid is a number in m.",
    ),
    "place of four numbers": (
        "based_on: plates\nscenario: {box: {low_m: [0, 0, 0, 0], high_m: 3}}",
        "trial.yaml: scenario.box.low_m = [0, 0, 0, 0] cannot be used: valid is a list of 2 or 3 "
        "entries.\n"
        "trial.yaml: scenario.box.high_m = 3 cannot be used: valid is a list.",
    ),
    "unit of another key": (
        "based_on: tube\nscenario: {sand: {density_kg_m3: {value: 2.4, unit: g/cm3, source: x}}}",
        "trial.yaml: scenario.sand.density_kg_m3.unit = 'g/cm3' cannot be used: "
        "valid is the unit of the key, kg/m3: write 2400 (kg/m3).",
    ),
    "table without a mass": (
        TABLE % "moment_kg_m: 0.05, mount_frequency_hz: 8, flask_depth_m: 0.3",
        "trial.yaml: scenario.vibration.0.unbalance.moving_mass_kg = None cannot be used: valid "
        "is a value: this key must be given.",
    ),
    "table without a flask in 2D": (
        TABLE % "moment_kg_m: 0.05, moving_mass_kg: 60, mount_frequency_hz: 8",
        "trial.yaml: scenario.vibration.0.unbalance.flask_depth_m = None cannot be used: valid is"
        " the flask's depth across the plane in m. In 2D the discs are only as thick as"
        " sand.disc_thickness_m, and the table carries the sand of the whole flask.",
    ),
    "unbalance without a moment": (
        TABLE % "moment_kg_m: 0, moving_mass_kg: 60, mount_frequency_hz: 8, flask_depth_m: 0.3",
        "trial.yaml: scenario.vibration.0.unbalance.moment_kg_m = 0 cannot be used: valid is a "
        "number greater than 0.",
    ),
    "mounts of no frequency": (
        TABLE % "moment_kg_m: 0.05, moving_mass_kg: 60, mount_frequency_hz: 0, flask_depth_m: 0.3",
        "trial.yaml: scenario.vibration.0.unbalance.mount_frequency_hz = 0 cannot be used: valid "
        "is a number of at least 0.01.",
    ),
    "negative damping of mounts": (
        TABLE
        % "moment_kg_m: 1, moving_mass_kg: 60, mount_frequency_hz: 8, mount_damping_ratio: -1",
        "trial.yaml: scenario.vibration.0.unbalance.mount_damping_ratio = -1 cannot be used: "
        "valid is a number of at least 0.",
    ),
    "table lighter than its sand": (
        TABLE
        % "moment_kg_m: 0.05, moving_mass_kg: 0.01, mount_frequency_hz: 8, flask_depth_m: 0.3",
        "trial.yaml: scenario.vibration.0.unbalance.moving_mass_kg = 0.01 cannot be used: valid "
        "is at least 0.56 kg, a tenth of the mass of the sand in the flask. The time step does "
        "not resolve a lighter table.",
    ),
    "unbalance without a table": (
        "based_on: tube\nscenario: {vibration: [{hold: unbalance}]}",
        "trial.yaml: scenario.vibration.0 = {'hold': 'unbalance'} cannot be used: valid is a "
        "section unbalance with moment_kg_m, moving_mass_kg and mount_frequency_hz.",
    ),
    "table that is moved as laid down": (
        "based_on: tube\nscenario: {vibration: [{acceleration_g: 1.5, unbalance: {moment_kg_m: 1, "
        "moving_mass_kg: 60, mount_frequency_hz: 8}}]}",
        "trial.yaml: scenario.vibration.0 = {'acceleration_g': 1.5, 'unbalance': {'moment_kg_m': "
        "1, 'moving_mass_kg': 60, 'mount_frequency_hz': 8}} cannot be used: valid is no section "
        "unbalance, or hold: unbalance.",
    ),
    "amplitude of a table with an unbalance": (
        "based_on: tube\nscenario: {vibration: [{hold: unbalance, velocity_m_s: 1, unbalance: "
        "{moment_kg_m: 1, moving_mass_kg: 60, mount_frequency_hz: 8}}]}",
        "trial.yaml: scenario.vibration.0 = {'hold': 'unbalance', 'velocity_m_s': 1, 'unbalance': "
        "{'moment_kg_m': 1, 'moving_mass_kg': 60, 'mount_frequency_hz': 8}} cannot be used: valid "
        "is none of acceleration_g, velocity_m_s, displacement_m and reference_frequency_hz with "
        "hold unbalance: the table's motion is computed.",
    ),
    "table in one stage of two": (
        (TABLE % FULL).replace("}]}", "}, {acceleration_g: 2}]}"),
        "trial.yaml: scenario.vibration.1.hold = 'acceleration' cannot be used: "
        "valid is unbalance in every stage of vibration, or in none.",
    ),
    "table that moves between layers": (
        "based_on: tube\nscenario: {fill: {vibration_between_layers: {hold: unbalance, unbalance: "
        "{moment_kg_m: 1, moving_mass_kg: 60, mount_frequency_hz: 8}}}}",
        "trial.yaml: scenario.fill.vibration_between_layers.hold = 'unbalance' cannot be used: "
        "valid is acceleration, velocity or displacement between layers: the table stands while it "
        "is filled.",
    ),
    "table under a pattern": (
        (TABLE % FULL).replace("tube", "l_pattern"),
        "trial.yaml: scenario.vibration.0.hold = 'unbalance' cannot be used: "
        "valid is acceleration, velocity or displacement in a scene with a pattern.",
    ),
    "flask depth in 3D": (
        (TABLE % FULL).replace(
            "{vibration", "{dimension: 3, sand: {size_scale: 8}, box: {depth_m: 0.05}, vibration"
        ),
        "trial.yaml: scenario.vibration.0.unbalance.flask_depth_m = 0.3 cannot be used: "
        "valid is absent in 3D, where box.depth_m is the flask's depth.",
    ),
}


@pytest.mark.parametrize("case", CASES, ids=[c.replace(" ", "_") for c in CASES])
def test_sentence(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text, sentence = CASES[case]
    assert refused(tmp_path, text, monkeypatch) == sentence
