"""Render a scenario into a LIGGGHTS deck, its meshes and its layers of grains."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.bed_deck import render_parts
from sandmould.engines.deck import Deck, exact
from sandmould.engines.deck_context import deck_context
from sandmould.engines.deck_lines import Lines, simulation_box, size_classes
from sandmould.engines.liggghts import OLDEST_VERSION
from sandmould.engines.liggghts.contact_model import pair_tables, refuse_law, rolling_model
from sandmould.engines.liggghts.mesh_files import largest_motion_m, surface_triangles, write_stl
from sandmould.engines.program import Program
from sandmould.engines.session import RefusedError
from sandmould.geometry.geometry import Array
from sandmould.scenario.placement import PlannedLayer
from sandmould.scenario.scenario import Scenario

_HERE = "on engine liggghts"


def bounds_m(program: Program) -> list[tuple[float, float]]:
    """Bounds of the simulation box along three axes, with room for walls that move."""
    scenario = program.scenario
    bounds = simulation_box(scenario, program)
    motion = largest_motion_m(scenario)
    if scenario.dimension == 2:
        half = 2 * scenario.largest_diameter_m
        bounds.append((-half, half))
    return [(low - motion, high + motion) for low, high in bounds]


def surface_meshes(program: Program) -> dict[str, Array]:
    """Triangles of all walls and obstacles, in the order of the deck."""
    return surface_triangles(program.scenario, bounds_m(program))


def render_deck(
    program: Program, sources: Mapping[str, str], run: str = "scene", study: str = "none"
) -> Deck:
    """Render a scenario's deck."""

    def context_of(program: Program) -> dict[str, Any]:
        lines = Lines(program.scenario, sources)
        return deck_context(program, lines, run, study) | _own_context(program, lines)

    return render_parts("liggghts", program, context_of)


def _own_context(program: Program, lines: Lines) -> dict[str, Any]:
    scenario = program.scenario
    gate = scenario.discharge is not None
    return {
        "tables": pair_tables(scenario.laws, size_classes(scenario), lines, scenario.step_s, gate),
        "rolling_model": rolling_model(scenario.laws),
        "simulation_box": bounds_m(program),
        "surfaces": list(surface_meshes(program)),
        "wall_names": [wall.name for wall in scenario.scene.walls],
        "first_id": [1 + sum(program.counts[:i]) for i in range(len(program.counts))],
        "oldest_version": OLDEST_VERSION,
    }


def atoms_data(
    scenario: Scenario,
    title: str,
    first_id: int,
    class_number: NDArray[np.int64],
    position_m: Array,
    motion: tuple[Array, Array] | None = None,
) -> str:
    """Write grains as a LIGGGHTS data file.

    Parameters
    ----------
    class_number : (n,) int64
    position_m : (n, d) float64, m
    motion : tuple, optional
        Velocity (n, d) in m/s and spin (n, 3) in rad/s.
    """
    d = scenario.dimension
    classes = scenario.sand.classes(d)
    # In 2D a sphere of this density has the mass of a disc, rho pi r^2 b.
    density = [
        scenario.sand.grain_mass_kg(c.diameter_m, d) / (math.pi / 6 * c.diameter_m**3)
        for c in classes
    ]
    kinds = [
        f"{c.number} {exact(c.diameter_m)} {exact(rho)}"
        for c, rho in zip(classes, density, strict=True)
    ]
    flat = " 0" if d == 2 else ""
    rows = [
        f"{i} {kinds[c - 1]} " + " ".join(map(repr, p)) + flat
        for i, (c, p) in enumerate(
            zip(class_number.tolist(), position_m.tolist(), strict=True), start=first_id
        )
    ]
    text = [f"# {title}", "", f"{len(rows)} atoms", "", "Atoms", "", *rows]
    if motion is not None:
        text += ["", "Velocities", ""]
        text += [
            f"{i} " + " ".join(map(repr, v)) + flat + " " + " ".join(map(repr, w))
            for i, (v, w) in enumerate(
                zip(motion[0].tolist(), motion[1].tolist(), strict=True), start=first_id
            )
        ]
    return "\n".join(text) + "\n"


def layer_data(scenario: Scenario, layer: PlannedLayer, number: int, first_id: int) -> str:
    """Write a layer as a data file; heights count from the layer's lowest point."""
    title = (
        f"layer {number}: id, type, diameter (m), density (kg/m3), x, y, z (m); seed"
        f" {scenario.seed}"
    )
    velocity_m_s = layer.velocity_m_s
    moves = None if velocity_m_s is None else (velocity_m_s, np.zeros((len(velocity_m_s), 3)))
    return atoms_data(scenario, title, first_id, layer.class_number, layer.position_m, moves)


def write_deck(
    program: Program, sources: Mapping[str, str], folder: Path, run: str, study: str
) -> None:
    """Write ``deck.in`` and ``layers/``; the deck last, so that it stands for all of them."""
    layers = folder / "layers"
    layers.mkdir(parents=True, exist_ok=True)
    first_id = 1
    for number, layer in enumerate(program.layers, start=1):
        text = layer_data(program.scenario, layer, number, first_id)
        (layers / f"layer_{number}.data").write_text(text, encoding="utf-8")
        first_id += len(layer.radius_m)
    for name, triangles in surface_meshes(program).items():
        write_stl(layers / f"{name}.stl", name, triangles)
    render_deck(program, sources, run, study).write(folder)


def refuse(scenario: Scenario) -> None:
    """Refuse what this engine lacks.

    Raises
    ------
    RefusedError
        With one sentence.
    """
    if scenario.engine.ranks > 1:
        raise RefusedError("engine.ranks", scenario.engine.ranks, f"1 {_HERE}")
    if scenario.dimension == 2 and scenario.sand.disc_inertia == "disc":
        # Meshes need three dimensions, where a grain is a sphere.
        raise RefusedError("sand.disc_inertia", "disc", f"sphere {_HERE}")
    if scenario.time_step.rotational_inertia == "scaled":
        raise RefusedError("time_step.rotational_inertia", "scaled", f"physical {_HERE}")
    if scenario.record.orientation:
        raise RefusedError("record.orientation", True, f"false {_HERE}")
    _refuse_round_solids(scenario)
    _refuse_damping(scenario)
    refuse_law(scenario.contact)


def _refuse_round_solids(scenario: Scenario) -> None:
    """Meshes have flat facets; how many would do is for the user to say."""
    for i, obstacle in enumerate(scenario.obstacles):
        if obstacle.kind == "cylinder":
            valid = f"plate, tube, polygon or mesh {_HERE}"
            raise RefusedError(f"obstacles.{i}.kind", obstacle.kind, valid)
        if obstacle.kind == "tube" and scenario.dimension == 3 and obstacle.section == "round":
            raise RefusedError(f"obstacles.{i}.section", obstacle.section, f"facets {_HERE}")


def _refuse_damping(scenario: Scenario) -> None:
    damping = scenario.background_damping
    if damping.form not in ("none", "viscous"):
        raise RefusedError("background_damping.form", damping.form, f"none or viscous {_HERE}")
    if damping.form == "viscous" and damping.viscous_rotation_per_s > 0:
        raise RefusedError(
            "background_damping.viscous_rotation_per_s",
            damping.viscous_rotation_per_s,
            f"0 {_HERE}, which damps translation only",
        )
