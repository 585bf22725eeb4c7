"""Render a scenario into a LAMMPS deck and its layers of grains; refuse what LAMMPS cannot do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.engines.bed_deck import render_parts
from sandmould.engines.deck import Deck, exact
from sandmould.engines.deck_context import deck_context
from sandmould.engines.deck_lines import Lines, simulation_box, size_classes
from sandmould.engines.lammps import OLDEST_VERSION
from sandmould.engines.lammps.near_grains import NearGrains
from sandmould.engines.program import Program
from sandmould.engines.session import RefusedError
from sandmould.geometry.geometry import Array, Block
from sandmould.scenario.contact import Contact, ContactLaw, restitution
from sandmould.scenario.placement import PlannedLayer
from sandmould.scenario.scenario import Scenario

HALF_SLAB_M = 0.0005


@dataclass(frozen=True)
class Dashpot:
    """One restitution of the deck."""

    ratio: float
    """The damping ratio that it stands for."""

    @property
    def restitution(self) -> float:
        """What ``damping coeff_restitution`` makes c = 2 ratio sqrt(k_n m) of."""
        return restitution(self.ratio)


@dataclass(frozen=True)
class Dashpots:
    """Dashpots of all contacts of a deck.

    A fix of a wall has one restitution for all grains, so that c is in proportion to sqrt(m).
    Corrected coefficients c / (1 + c dt / (4 m)) are not quite: walls take the mean of the damping
    ratios that the smallest and the largest class ask for (docs/stability.md).
    """

    contact: Contact
    classes: list[dict[str, Any]]
    """As ``sandmould.engines.deck_lines.size_classes`` gives them."""
    lag_s: float

    def pair(self, i: dict[str, Any], j: dict[str, Any]) -> Dashpot:
        """Of grains of two size classes."""
        mass = i["mass_kg"] * j["mass_kg"] / (i["mass_kg"] + j["mass_kg"])
        return Dashpot(self.contact.grain_grain.dashpot_ratio(mass, self.lag_s))

    @property
    def wall(self) -> Dashpot:
        """Of all grains at walls."""
        law: ContactLaw = self.contact.grain_wall
        ends = (self.classes[0], self.classes[-1])
        low, high = (law.dashpot_ratio(size["mass_kg"], self.lag_s) for size in ends)
        return Dashpot(low + 0.5 * (high - low))


@dataclass(frozen=True)
class _Solid:
    """A block as a LAMMPS region: bounds before it is turned about its centre."""

    name: str
    bounds: str
    angle_rad: float
    centre: Array
    axis: Array


def _solid(block: Block) -> _Solid:
    from scipy.spatial.transform import Rotation  # no plan needs it

    d = len(block.centre_m)
    low, high = block.centre_m - block.half_size_m, block.centre_m + block.half_size_m
    bounds = " ".join(f"{exact(a)} {exact(b)}" for a, b in zip(low, high, strict=True))
    turn = np.eye(3)
    turn[:d, :d] = block.axes.T
    rotation = Rotation.from_matrix(turn).as_rotvec()
    angle = float(np.linalg.norm(rotation))
    axis = rotation / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
    return _Solid(block.name, bounds + (" INF INF" if d == 2 else ""), angle, block.centre_m, axis)


def surfaces(scenario: Scenario) -> list[str]:
    """Names of all walls and blocks, in the order of the deck: regions of LAMMPS."""
    scene = scenario.scene
    return [wall.name for wall in scene.walls] + [block.name for block in scene.blocks]


def pressed(scenario: Scenario) -> list[str]:
    """Names of the surfaces that only the session's callback can press on."""
    scene = scenario.scene
    names = [outline.name for outline in scene.outlines] + [mesh.name for mesh in scene.meshes]
    return names + [solid.name for solid in scene.revolved]


def needs_callback(scenario: Scenario) -> bool:
    """Whether the deck cannot be computed without the session's callback."""
    isotropic = scenario.background_damping.form == "nonviscous_isotropic"
    return isotropic or bool(pressed(scenario))


def render_deck(
    program: Program, sources: Mapping[str, str], run: str = "scene", study: str = "none"
) -> Deck:
    """Render a scenario's deck.

    ``sources``: source of each key's value; shown on the value's line.
    """

    def context_of(program: Program) -> dict[str, Any]:
        lines = Lines(program.scenario, sources)
        return deck_context(program, lines, run, study) | _own_context(program)

    return render_parts("lammps", program, context_of)


def _own_context(program: Program) -> dict[str, Any]:
    """What only the templates of LAMMPS are given."""
    scenario = program.scenario
    contact, step_s = scenario.laws, scenario.step_s
    return {
        "scene": scenario.scene,
        "laws": {"grain": contact.grain_grain, "wall": contact.grain_wall},
        "dashpots": Dashpots(contact, size_classes(scenario), contact.lag_s(step_s)),
        "slip_of_half_step": scenario.dimension == 3 and contact.slip_normal == "half_step",
        "simulation_box": simulation_box(scenario, program),
        "half_slab": HALF_SLAB_M,
        "blocks": [_solid(b) for b in scenario.scene.blocks],
        "surfaces": surfaces(scenario),
        "near": NearGrains(scenario),
        "pressed": pressed(scenario),
        "needs_callback": needs_callback(scenario),
        "oldest_version": OLDEST_VERSION,
    }


def layer_data(scenario: Scenario, layer: PlannedLayer, number: int) -> str:
    """Write a layer as a LAMMPS data file; heights count from the layer's lowest point."""
    d = scenario.dimension
    classes = scenario.sand.classes(d)
    upper = [*[scenario.box.width_m, scenario.box.depth_m][: d - 1], layer.height_m]
    bounds = [(0.0, u) for u in upper] + ([(-HALF_SLAB_M, HALF_SLAB_M)] if d == 2 else [])
    head = [
        f"# layer {number}: id, type, diameter (m), density (kg/m3), x, y, z (m); seed"
        f" {scenario.seed}",
        "",
        f"{len(layer.radius_m)} atoms",
        f"{len(classes)} atom types",
        "",
        *(
            f"{exact(lo)} {exact(hi)} {a}lo {a}hi"
            for (lo, hi), a in zip(bounds, "xyz", strict=True)
        ),
        "",
        "Atoms # sphere",
        "",
    ]
    density = exact(scenario.sand.density_kg_m3)
    diameters = [exact(c.diameter_m) for c in classes]
    rows = [
        f"{i} {c} {diameters[c - 1]} {density} " + " ".join(map(repr, p)) + (" 0" if d == 2 else "")
        for i, (c, p) in enumerate(
            zip(layer.class_number.tolist(), layer.position_m.tolist(), strict=True), start=1
        )
    ]
    if layer.velocity_m_s is not None:
        rows += ["", "Velocities", ""]
        rows += [
            f"{i} {' '.join(map(repr, v))}{' 0' if d == 2 else ''} 0 0 0"
            for i, v in enumerate(layer.velocity_m_s.tolist(), start=1)
        ]
    return "\n".join([*head, *rows]) + "\n"


def write_deck(
    program: Program, sources: Mapping[str, str], folder: Path, run: str, study: str
) -> None:
    """Write ``deck.in`` and ``layers/``; the deck last, so that it stands for all of them."""
    (folder / "layers").mkdir(parents=True, exist_ok=True)
    for number, layer in enumerate(program.layers, start=1):
        path = folder / "layers" / f"layer_{number}.data"
        path.write_text(layer_data(program.scenario, layer, number), encoding="utf-8")
    render_deck(program, sources, run, study).write(folder)


def refuse(scenario: Scenario) -> None:
    """Refuse what this engine lacks.

    Raises
    ------
    RefusedError
        With one sentence.
    """
    if scenario.dimension == 3 and scenario.contact.rolling_axes == "all":
        raise RefusedError("contact.rolling_axes", "all", "tangent on engine lammps in 3D")
    if scenario.time_step.rotational_inertia == "scaled":
        raise RefusedError("time_step.rotational_inertia", "scaled", "physical on engine lammps")
    if scenario.record.orientation:
        raise RefusedError("record.orientation", True, "false on engine lammps")
    if scenario.engine.ranks > 1 and needs_callback(scenario):
        # The force callback lives in one process.
        valid = "1 on engine lammps with polygons, round solids, meshes or isotropic damping"
        raise RefusedError("engine.ranks", scenario.engine.ranks, valid)
