"""What types alone cannot see: a scene whose parts do not go together."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sandmould.bad_input import BadInputError, Problem
from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.outline import outline_fault
from sandmould.limits import GRAINS
from sandmould.scenario.box import (
    Plate,
    Polygon,
    Tube,
    box_walls,
    plate_blocks,
    tube_blocks,
    tube_wall,
)
from sandmould.scenario.checks.cavities import cavity_problems
from sandmould.scenario.checks.moving import piston_problems, table_mass_problem, unbalance_problems
from sandmould.scenario.checks.placed import placed_problems
from sandmould.scenario.placement import fall_s, plan_counts, portion_of, predicted_bed_height_m
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import (
    Cylinder,
    SolidMesh,
    Triangles,
    cylinder_solid,
    mesh_solid,
    unit_hint,
)
from sandmould.scenario.time_step import LEAST_STEPS_A_PERIOD
from sandmould.scenario.vibration import Shaking, VibrationStage

MOST_OF_BED = 2
"""Of the planned critical step: the limits of beds were at most 1.7 of it."""
SHORTEST_STEP_S = 1e-9
"""A second of shorter steps takes more than ten hours for a thousand grains."""
KINDS = {2: ("plate", "tube", "polygon"), 3: ("plate", "tube", "cylinder", "mesh", "triangles")}
"""Kinds of obstacles that a dimension has."""


def problems(scenario: Scenario) -> list[Problem]:
    """List all that keeps a well-typed scenario from being run."""
    faults = [
        *_obstacles(scenario),
        *_discharge(scenario),
        *piston_problems(scenario),
        *_grains(scenario),
        *_pouring(scenario),
        *_spout(scenario),
        *placed_problems(scenario),
        *_springs(scenario),
        *_time(scenario),
        *_vibration(scenario),
        *unbalance_problems(scenario),
    ]
    # Cavities lie among obstacles, and the bed can only be predicted for a scene that is sound.
    return (
        faults or [*cavity_problems(scenario)] or [*_fill(scenario), *table_mass_problem(scenario)]
    )


def _obstacles(s: Scenario) -> Iterator[Problem]:
    names = [o.name for o in s.obstacles]
    walls = [wall.name for wall in box_walls(s.box, s.dimension)]
    for i, obstacle in enumerate(s.obstacles):
        key = f"obstacles.{i}"
        if obstacle.name in walls:
            valid = f"a name that no wall of the box has: {', '.join(walls)}"
            yield Problem(f"{key}.name", obstacle.name, valid)
        if names.index(obstacle.name) != i:
            yield Problem(f"{key}.name", obstacle.name, "a name no other obstacle has")
        kinds = KINDS[s.dimension]
        if obstacle.kind not in kinds:
            valid = f"{', '.join(kinds[:-1])} or {kinds[-1]} in {s.dimension}D"
            if s.dimension == 2:
                valid += f"; {obstacle.kind} needs dimension: 3"
            yield Problem(f"{key}.kind", obstacle.kind, valid)
        elif isinstance(obstacle, Plate):
            yield from _plate(s, obstacle, key)
        elif isinstance(obstacle, Tube):
            yield from _tube(s, obstacle, key)
        elif isinstance(obstacle, Polygon):
            yield from _polygon(s, obstacle, key)
        elif isinstance(obstacle, Cylinder):
            if not s.box.holds(cylinder_solid(obstacle).corners(), s.dimension):
                valid = f"a cylinder inside the box, {_size(s)}"
                yield Problem(f"{key}.centre_m", list(obstacle.centre_m), valid)
        elif isinstance(obstacle, Triangles):
            yield from _triangles(s, obstacle, key)
        else:
            yield from _mesh(s, obstacle, key)


def _plate(s: Scenario, plate: Plate, key: str) -> Iterator[Problem]:
    for part in ("centre_m", "size_m"):
        value = getattr(plate, part)
        if len(value) != s.dimension:
            yield Problem(f"{key}.{part}", list(value), f"{s.dimension} numbers, one a dimension")
            return
    if not s.box.holds(plate_blocks(plate, s.dimension)[0].corners(), s.dimension):
        yield Problem(
            f"{key}.centre_m", list(plate.centre_m), f"a plate inside the box, {_size(s)}"
        )


def _tube(s: Scenario, tube: Tube, key: str) -> Iterator[Problem]:
    if tube.left_end_x_m >= s.box.width_m:
        yield Problem(
            f"{key}.left_end_x_m",
            tube.left_end_x_m,
            f"less than box.width_m, {s.box.width_m:g} m",
        )
    elif tube.right_end_x_m > s.box.width_m * (1 + 1e-9):
        yield Problem(
            f"{key}.length_m",
            tube.length_m,
            f"at most {s.box.width_m - tube.left_end_x_m:.6g}, so that the tube ends in the box",
        )
    elif not s.box.holds(_tube_corners(s, tube), s.dimension):
        yield Problem(
            f"{key}.axis_height_m", tube.axis_height_m, f"a tube inside the box, {_size(s)}"
        )
    largest = s.largest_diameter_m
    if largest >= tube.diameter_m:
        yield Problem(
            f"{key}.diameter_m",
            tube.diameter_m,
            f"more than the largest grain, {largest:.6g} m",
        )


def _tube_corners(s: Scenario, tube: Tube) -> np.ndarray:
    if s.dimension == 3 and tube.section == "round":
        return tube_wall(tube, s.box).corners()
    return np.vstack([b.corners() for b in tube_blocks(tube, s.box, s.dimension)])


def _polygon(s: Scenario, polygon: Polygon, key: str) -> Iterator[Problem]:
    vertices_m = np.array(polygon.vertices_m)
    valid = outline_fault(vertices_m)
    if valid is None and not s.box.holds(vertices_m, s.dimension):
        valid = f"a polygon inside the box, {_size(s)}"
    if valid is not None:
        yield Problem(f"{key}.vertices_m", [list(v) for v in polygon.vertices_m], valid)


def _mesh(s: Scenario, solid: SolidMesh, key: str) -> Iterator[Problem]:
    try:
        corners_m = mesh_solid(solid, key).corners()
    except BadInputError as error:
        yield from error.problems
        return
    # a face on the wall may stand out by the round-off of its file's seven digits
    if not s.box.holds(corners_m, s.dimension, slack=1e-6):
        ends_m = (corners_m.min(axis=0).tolist(), corners_m.max(axis=0).tolist())
        low, high = (f"({', '.join(f'{x:.4g}' for x in end)})" for end in ends_m)
        box_m = np.array([s.box.width_m, s.box.depth_m, s.box.height_m])
        hint = unit_hint(solid, np.ptp(corners_m, axis=0), box_m)
        valid = (
            f"one that puts the mesh, now from {low} to {high} m, inside the box, {_size(s)}{hint}"
        )
        yield Problem(f"{key}.position_m", list(solid.position_m), valid)


def _triangles(s: Scenario, solid: Triangles, key: str) -> Iterator[Problem]:
    from sandmould.geometry.mesh_file import check_surface  # slow to import, and few scenes have it

    size = f"{len(solid.triangles)} triangles"
    try:
        check_surface(solid.solid.vertices_m, solid.solid.triangles)
    except MeshFileError as fault:
        yield Problem(f"{key}.triangles", size, str(fault))
        return
    if not s.box.holds(solid.solid.corners(), s.dimension, slack=1e-6):
        yield Problem(f"{key}.vertices_m", size, f"a solid inside the box, {_size(s)}")


def _size(s: Scenario) -> str:
    return s.box.size_text(s.dimension)


def _discharge(s: Scenario) -> Iterator[Problem]:
    if s.discharge is None:
        return
    if s.gate is None:
        plates = [o.name for o in s.obstacles if isinstance(o, Plate)]
        valid = f"a plate among the obstacles: {', '.join(plates) or 'there is none'}"
        yield Problem("discharge.gate", s.discharge.gate, valid)
    elif s.gate.angle_deg != 0.0:
        valid = "a plate with angle_deg 0, level or upright"
        yield Problem("discharge.gate", s.discharge.gate, valid)
    opening_s, duration_s = s.discharge.opening_time_s, s.discharge.duration_s
    if duration_s is not None and duration_s <= (opening_s or 0.0):
        valid = f"more than discharge.opening_time_s, {opening_s:g} s, which is a part of it"
        yield Problem("discharge.duration_s", duration_s, valid)


def _pouring(s: Scenario) -> Iterator[Problem]:
    if s.dimension == 2 and s.fill.over_y_m is not None:
        yield Problem("fill.over_y_m", list(s.fill.over_y_m), "absent in 2D")
    largest = s.largest_diameter_m
    sizes = (("over_x_m", s.box.width_m, "width_m"), ("over_y_m", s.box.depth_m, "depth_m"))
    for (key, size_m, name), (low, high) in zip(sizes, s.pouring_m, strict=False):
        if not (low >= 0.0 and high <= size_m and high - low >= 3 * largest):
            valid = (
                f"two numbers between 0 and box.{name}, {size_m:g} m, at least three of the "
                f"largest grains apart, {3 * largest:.6g} m"
            )
            yield Problem(f"fill.{key}", [low, high], valid)


def _spout(s: Scenario) -> Iterator[Problem]:
    """A spout that leaves the box, is too narrow, or does not go with another key."""
    spout, largest = s.fill.spout, s.largest_diameter_m
    if spout is None:
        return
    if s.fill.vibration is not None:
        yield Problem("fill.spout", "given", "absent with fill.vibration, which pours at once")
    if spout.width_m < 3 * largest:
        valid = f"at least three of the largest grains, {3 * largest:.6g} m"
        yield Problem("fill.spout.width_m", spout.width_m, valid)
    for key in ("from_m", "to_m"):
        middle, half_m = getattr(spout, key), spout.width_m / 2
        if len(middle) != s.dimension - 1:
            valid = "one number, x, in 2D and two, x and y, in 3D"
            yield Problem(f"fill.spout.{key}", list(middle), valid)
        elif any(
            not half_m <= x <= size_m - half_m
            for x, size_m in zip(middle, s.box.size_m(s.dimension), strict=False)
        ):
            valid = f"a spout over the box, {_size(s)}, with half of width_m on either side"
            yield Problem(f"fill.spout.{key}", list(middle), valid)


def _grains(s: Scenario) -> Iterator[Problem]:
    largest = s.largest_diameter_m
    narrowest = min(s.box.width_m, s.box.depth_m) if s.dimension == 3 else s.box.width_m
    if largest * 3 > narrowest:
        key = "box.width_m" if narrowest == s.box.width_m else "box.depth_m"
        yield Problem(key, narrowest, f"at least three of the largest grains, {3 * largest:.6g} m")


def _springs(s: Scenario) -> Iterator[Problem]:
    speed_m_s = s.contact.wave_speed_m_s
    if speed_m_s is not None and s.dimension == 2 and s.sand.disc_thickness_m != "grain":
        valid = "null with sand.disc_thickness_m in m: discs are as hard as springs over thickness"
        yield Problem("contact.wave_speed_m_s", speed_m_s, valid)
    elif s.critical_step.step_s < SHORTEST_STEP_S:
        key, value = "contact.wave_speed_m_s", speed_m_s
        if speed_m_s is None:
            key = "contact.grain_grain.normal_stiffness_n_m"
            value = s.contact.grain_grain.normal_stiffness_n_m
        valid = f"springs whose critical time step is {SHORTEST_STEP_S:g} s or longer"
        yield Problem(key, value, f"{valid}, not {s.critical_step.step_s:.2g} s")


def _time(s: Scenario) -> Iterator[Problem]:
    critical = s.critical_step
    own = s.time_step.step_s
    step_s = own or s.step_s
    of_bed = s.pattern is None and bool(s.vibrations)
    most_s = critical.step_s * (MOST_OF_BED if of_bed else 1)
    if step_s > most_s:
        valid = f"at most the critical step {most_s:.4g} s"
        if of_bed:
            valid = f"at most {most_s:.4g} s, {MOST_OF_BED} times the critical step"
        yield Problem("time_step.step_s", own, f"{valid}, set by {critical.cause}")
    elif s.rest.check_every_s < step_s:
        yield Problem(
            "rest.check_every_s", s.rest.check_every_s, f"at least the time step {step_s:.4g} s"
        )
    shaken_s = s.rest.shaken_check_every_s
    key, least_s = "rest.check_every_s", s.rest.check_every_s
    if shaken_s is not None:
        if not s.step_s <= shaken_s <= least_s:
            valid = f"from the time step {s.step_s:.4g} s to rest.check_every_s, {least_s:g} s"
            yield Problem("rest.shaken_check_every_s", shaken_s, valid)
        elif not s.vibrations:
            yield Problem("rest.shaken_check_every_s", shaken_s, "absent without vibration")
        key, least_s = "rest.shaken_check_every_s", s.from_vibration.rest.check_every_s
    loop = None if s.pattern is None else s.pattern.loop
    if loop is not None and loop.has_windows and loop.window_s > least_s:
        yield Problem("pattern.loop.window_s", loop.window_s, f"at most {key}, {least_s:.4g} s")
    if s.record.series_every_s < s.rest.check_every_s:
        yield Problem(
            "record.series_every_s",
            s.record.series_every_s,
            f"at least rest.check_every_s, {s.rest.check_every_s:g} s",
        )
    if s.record.snapshot_every_s < s.record.series_every_s:
        yield Problem(
            "record.snapshot_every_s",
            s.record.snapshot_every_s,
            f"at least record.series_every_s, {s.record.series_every_s:g} s",
        )


def _vibration(s: Scenario) -> Iterator[Problem]:
    stages: list[tuple[str, Shaking]] = []
    for i, stage in enumerate(s.vibration):
        shortest_s = s.fill.settling.shortest_s
        if isinstance(stage, VibrationStage):
            stages.append((f"vibration.{i}", stage))
        elif stage.longest_s <= shortest_s:
            valid = f"more than fill.settling.shortest_s, {shortest_s:g} s"
            yield Problem(f"vibration.{i}.longest_s", stage.longest_s, valid)
    between, pouring = s.fill.vibration_between_layers, s.fill.vibration
    if between is not None:
        stages.append(("fill.vibration_between_layers", between))
        if pouring is not None:
            valid = "absent with fill.vibration, which has no pause between layers"
            yield Problem("fill.vibration_between_layers", "given", valid)
    if pouring is not None:
        stages.append(("fill.vibration", pouring))
    for key, shaking in stages:
        if not isinstance(shaking.direction, str) and len(shaking.direction) != s.dimension:
            yield Problem(
                f"{key}.direction",
                list(shaking.direction),
                f"vertical, horizontal or {s.dimension} numbers",
            )
        step_s = s.time_step.step_s or s.step_s
        steps = 1 / (shaking.frequency_hz * step_s)
        if steps < LEAST_STEPS_A_PERIOD:
            yield Problem(
                f"{key}.frequency_hz",
                shaking.frequency_hz,
                f"at most {1 / (LEAST_STEPS_A_PERIOD * step_s):.4g} Hz, "
                f"{LEAST_STEPS_A_PERIOD} time steps a period",
            )


def _fill(s: Scenario) -> Iterator[Problem]:
    counts = plan_counts(s)
    for i, count in enumerate(counts):
        if count < 1:
            valid = "a layer of at least one grain, or one for each portion of fill.spout"
            valid = valid if s.fill.spout is not None else "a layer of at least one grain"
            yield Problem("fill.layers", f"layer {portion_of(s, i + 1)[0]}", valid)
            return
    if (number := sum(counts)) > GRAINS.most:
        yield from _too_many_grains(s, number)
        return
    yield from _time_of_layers(s, counts)
    height = predicted_bed_height_m(s, counts)
    floor = s.box.width_m * (s.box.depth_m if s.dimension == 3 else 1.0)
    # The box's own walls hold sand that is poured over all of it.
    over_part = s.floor_measure < (1 - 1e-9) * floor
    if s.discharge is not None and over_part and height > s.scene.top_m:
        yield Problem(
            "fill.layers",
            f"a bed about {height:.4g} m high",
            f"layers that stay below {s.scene.top_m:g} m, the top of what holds the sand",
        )
    if height > s.box.height_m:
        yield Problem(
            "fill.layers",
            f"a bed about {height:.4g} m high",
            f"layers that fit into box.height_m, {s.box.height_m:g} m",
        )


def _too_many_grains(s: Scenario, number: int) -> Iterator[Problem]:
    """Say from which size on the grains of a flask can be computed."""
    if any(layer.height_m is None for layer in s.fill.layers):
        yield from GRAINS.problems("fill.layers", number)
        return
    scale = s.sand.size_scale * (number / GRAINS.most) ** (1 / s.dimension)
    least = math.ceil(10 * scale * (1 - 1e-9)) / 10
    valid = f"at least {least:g} here: the layers hold {number:,} of at most {GRAINS.most:,} grains"
    yield Problem("sand.size_scale", s.sand.size_scale, valid)


def _time_of_layers(s: Scenario, counts: list[int]) -> Iterator[Problem]:
    """Layers or portions that are poured on before they have fallen."""
    vibration, spout = s.fill.vibration, s.fill.spout
    if spout is not None:
        least_s = (spout.portions - 1) * max(fall_s(s, count) for count in counts)
        if spout.time_s < least_s:
            valid = f"at least {least_s:.4g} s, in which each portion falls before the next"
            yield Problem("fill.spout.time_s", spout.time_s, valid)
    if vibration is None:
        return
    least_s = max(1 / vibration.frequency_hz, *(fall_s(s, count) for count in counts))
    if vibration.layer_s < least_s:
        valid = f"at least {least_s:.4g} s, in which a layer falls and the box vibrates once"
        yield Problem("fill.vibration.layer_s", vibration.layer_s, valid)
