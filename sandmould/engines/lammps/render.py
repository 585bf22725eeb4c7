"""Render a scenario into a LAMMPS deck.

A fix of a wall goes through all grains of its group in every step, and turns each one into the
frame of a turned block. So each wall has a group of the grains within ``reach_m`` of it: a radius
of the largest grain and a slack. The groups are made again before any grain can have gone the
slack, so that a grain outside cannot touch the wall meanwhile. Where a grain is too fast for that,
the groups are of all grains. A grain that leaves a group has no history of contact: forces were
computed where it now stands, away from the wall, and LAMMPS drops the history there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from sandmould.engines.bed_deck import render_parts
from sandmould.engines.deck import Deck, exact, vector
from sandmould.engines.deck_context import deck_context
from sandmould.engines.deck_lines import Lines, simulation_box, size_classes
from sandmould.engines.lammps import OLDEST_VERSION
from sandmould.engines.program import Program
from sandmould.engines.session import RefusedError
from sandmould.geometry.geometry import Array, Block, Wall
from sandmould.scenario.contact import Contact, ContactLaw, restitution
from sandmould.scenario.placement import PlannedLayer
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import Shaking

HALF_SLAB_M = 0.0005
MOST_GROUPS = 32 - 2
"""LAMMPS has 32 at most, one of them is ``all``, and a layer that falls takes one for a moment."""
SLACK_RADII = 1.0
"""Slack over the radius of the largest grain."""
_SLOWEST_M_S = 1e-3
"""Speed that is allowed where neither gravity nor the box moves a grain."""


@dataclass(frozen=True)
class NearGrains:
    """Groups of near grains of one scene."""

    scenario: Scenario
    most_steps: ClassVar[int] = 100
    """Steps after which groups are made again at the latest."""
    spare_steps: ClassVar[int] = 8
    """Steps by which they are made again before the fastest grain could have gone the slack."""
    speed_check_steps: ClassVar[int] = 5
    """Steps after which the speed of the fastest grain is looked at."""

    @property
    def slack_m(self) -> float:
        """How far a grain may go before the groups are made again."""
        return SLACK_RADII * self.scenario.largest_diameter_m / 2

    @property
    def reach_m(self) -> float:
        """Distance from a wall at rest up to which the centre of a grain counts as near.

        In the laboratory frame a wall moves by the amplitude.
        """
        moves = self.scenario.frame == "laboratory"
        amplitudes = [v.amplitude_m for v in self._vibrations] if moves else []
        return self.scenario.largest_diameter_m / 2 + self.slack_m + max(amplitudes, default=0.0)

    @property
    def gain_m_s(self) -> float:
        """Speed that gravity and the box can give a grain before the groups are made again."""
        time_s = self.most_steps * self.scenario.step_s
        shaken = [
            v.amplitude_m * v.angular_frequency_rad_s * (1.0 + v.angular_frequency_rad_s * time_s)
            for v in self._vibrations
        ]
        fallen = self.scenario.gravity_m_s2 * time_s
        return max(fallen + max(shaken, default=0.0), _SLOWEST_M_S)

    @property
    def _vibrations(self) -> list[Shaking]:
        return [*self.scenario.vibrations, *self.scenario.fill.shakings]

    @property
    def one_for_all(self) -> bool:
        """Whether all walls share one group, since LAMMPS has too few for one each."""
        return len(self._solids) > MOST_GROUPS

    @property
    def _solids(self) -> list[Wall | Block]:
        return [*self.scenario.scene.walls, *self.scenario.scene.blocks]

    @property
    def gate(self) -> str:
        """The plate that is taken away, which always has a group of its own."""
        return "" if self.scenario.discharge is None else self.scenario.discharge.gate

    def group(self, name: str) -> str:
        """Group of a wall or block."""
        return "near_walls" if self.one_for_all and name != self.gate else f"near_{name}"

    def groups(self, opened: bool = False) -> list[str]:
        """All groups, each once, without that of the gate where it is open."""
        names = [solid.name for solid in self._solids if not (opened and solid.name == self.gate)]
        return list(dict.fromkeys(map(self.group, names)))

    def commands(self, opened: bool = False) -> list[str]:
        """Commands that make the groups again."""
        clear = [f"group {group} clear" for group in self.groups(opened)]
        fill = [
            f"group {self.group(solid.name)} region near_{solid.name}"
            for solid in self._solids
            if not (opened and solid.name == self.gate)
        ]
        return clear + fill

    def commands_of_all(self, opened: bool = False) -> list[str]:
        """Commands that put all grains into the groups."""
        return [f"group {group} union all" for group in self.groups(opened)]

    def regions(self) -> list[tuple[str, str]]:
        """Name and shape of the region near each wall and block, as LAMMPS takes it."""
        return [(solid.name, self._shape(solid)) for solid in self._solids]

    def _shape(self, solid: Wall | Block) -> str:
        if isinstance(solid, Wall):
            point = solid.point_m + self.reach_m * solid.normal
            return f"plane {vector(point)} {vector(solid.normal)} side out"
        # Upright, so that no grain is turned.
        corners = solid.corners()
        low, high = corners.min(axis=0) - self.reach_m, corners.max(axis=0) + self.reach_m
        bounds = " ".join(f"{exact(a)} {exact(b)}" for a, b in zip(low, high, strict=True))
        return f"block {bounds}{' INF INF' if len(low) == 2 else ''}"

    def speed_bound(self) -> str:
        """Formula of a speed that no grain exceeds, m/s, of the greatest of each component."""
        d = self.scenario.dimension
        return "sqrt(" + "+".join(f"c_fastest[{i}]*c_fastest[{i}]" for i in range(1, d + 1)) + ")"


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
