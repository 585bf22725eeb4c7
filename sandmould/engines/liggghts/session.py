"""A scenario computed by a living LIGGGHTS: the deck's own blocks, runs cut at checks."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sandmould.engines.deck import Deck
from sandmould.engines.deck_session import DeckSession
from sandmould.engines.liggghts.mesh_files import outline_strips, write_stl
from sandmould.engines.liggghts.process import (
    Conversation,
    LiggghtsDied,
    executable,
    read_grains,
    version_of,
)
from sandmould.engines.liggghts.render import atoms_data, refuse, surface_meshes
from sandmould.engines.program import Program
from sandmould.engines.session import Array, EngineStop, RefusedError, engine_stop
from sandmould.engines.snapshot import Snapshot
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario

_VALUE = re.compile(r"^value (\S+)$", re.M)


@dataclass(frozen=True)
class TriangleLoads:
    """What the sand does to each triangle of a surface at one instant."""

    corners_m: Array
    """(n, 3, 3) float64, m."""
    area_m2: Array
    """(n,) float64, m2."""
    stress_pa: Array
    """(n, 3) float64, Pa: force of the sand on the triangle over its area."""

    @property
    def force_n(self) -> Array:
        """Force of the sand on each triangle, (n, 3) float64, N."""
        return self.stress_pa * self.area_m2[:, None]


def read_triangle_loads(path: Path) -> TriangleLoads:
    """Read what ``dump mesh/vtk ... stresscomponents area`` wrote; meshio ends the process on it.

    Raises
    ------
    ValueError
        When the file is no such export, or is cut short.
    """
    words = path.read_text(encoding="ascii", errors="replace").split()
    try:
        points = _numbers(words, words.index("POINTS") + 3, 3 * int(_after(words, "POINTS")))
        length = int(words[words.index("POLYGONS") + 2])
        corners = _numbers(words, words.index("CONNECTIVITY") + 2, length).astype(int)
        triangles = points.reshape(-1, 3)[corners.reshape(-1, 3)]
        stress = _field(words, "stress", 3, len(triangles))
        area = _field(words, "area", 1, len(triangles))[:, 0]
    except (ValueError, IndexError) as error:
        raise ValueError(f"{path}: not a stress export of LIGGGHTS ({error})") from error
    return TriangleLoads(triangles, area, stress)


def _after(words: list[str], keyword: str) -> str:
    return words[words.index(keyword) + 1]


def _numbers(words: list[str], first: int, count: int) -> Array:
    values = np.array(words[first : first + count], dtype=float)
    if len(values) < count:
        raise ValueError("it is cut short")
    return values


def _field(words: list[str], name: str, width: int, count: int) -> Array:
    """Values of one field: its name, its width, its number of rows, its type, its numbers."""
    start = words.index(name, words.index("CELL_DATA"))
    if [int(words[start + 1]), int(words[start + 2])] != [width, count]:
        raise ValueError(f"field {name} has another shape")
    return _numbers(words, start + 4, width * count).reshape(count, width)


class BendingMesh:
    """Strips across the plane of the discs along an outline, one between two vertices."""

    def __init__(self, name: str, vertices_m: Array) -> None:
        """Lie as drawn. ``vertices_m``, (nv, 2) float64, m: of the closed outline in order."""
        self.name = name
        self._vertices_m = vertices_m
        self.sums_n = np.zeros_like(vertices_m)
        """Loads on the vertices, summed over the samples of this check."""
        self.samples = 0

    @classmethod
    def of(cls, scenario: Scenario) -> BendingMesh | None:
        """The pattern of a scenario; None where there is none."""
        pattern = scenario.pattern
        if pattern is None:
            return None
        outline = next(o for o in scenario.scene.outlines if o.name == pattern.name)
        return cls(pattern.name, outline.vertices_m)

    def move(self, vertices_m: Array) -> None:
        """Take a new place."""
        self._vertices_m = vertices_m

    def add(self, loads: TriangleLoads, begins_check: bool) -> None:
        """Add a sample: half of what a triangle bears to each end of the side it stands on.

        So force is kept, and moment but for where on its side a grain lies. ``begins_check``:
        whether samples up to now belong to an earlier check.
        """
        if begins_check:
            self.sums_n, self.samples = np.zeros_like(self.sums_n), 0
        following = np.roll(self._vertices_m, -1, axis=0)
        middle_m = 0.5 * (self._vertices_m + following)
        low, high = loads.corners_m.min(axis=1), loads.corners_m.max(axis=1)
        place_m = 0.5 * (low + high)[:, :2]
        side = np.linalg.norm(place_m[:, None] - middle_m, axis=2).argmin(axis=1)
        half_n = 0.5 * loads.force_n[:, :2]
        np.add.at(self.sums_n, side, half_n)
        np.add.at(self.sums_n, (side + 1) % len(self.sums_n), half_n)
        self.samples += 1

    def exchange(self, walls: str, path: Path) -> str:
        """Commands that put a mesh file in the place of this mesh.

        ``walls``: the deck's block, which has the commands of the mesh as drawn.
        """
        lines = walls.splitlines()
        starts = (f"fix surface_{self.name} ", "fix walls ")
        surface, contacts = (next(x for x in lines if x.startswith(start)) for start in starts)
        surface = surface.replace(f"layers/{self.name}.stl", f'"{path}"')
        return "\n".join(["unfix walls", f"unfix surface_{self.name}", surface, contacts])


class LiggghtsSession(DeckSession):
    """See ``sandmould.engines.session.Session``.

    A checkpoint keeps the history of all contacts, those with meshes included. In the laboratory
    frame one force is lost wherever LIGGGHTS is set up, which is at fixed steps: there the dashpots
    of walls see a wall that stands still.
    """

    steps = 0
    _restart = "liggghts.restart"
    _valid_surface = "the pattern of the scenario on engine liggghts"

    def __init__(
        self, program: Program, deck: Deck, folder: Path, log: Path, checkpoint: Path | None = None
    ) -> None:
        """Start LIGGGHTS on a deck, afresh or from a checkpoint.

        ``log``: LIGGGHTS's own log; files that are read at once lie beside it. Raises RefusedError
        or EngineStop.
        """
        refuse(program.scenario)
        path = executable()
        version = version_of(path) if path else None
        if path is None or version is None:
            raise EngineStop(
                Outcome.ENGINE_MISSING, "LIGGGHTS cannot be started: apt install liggghts"
            )
        super().__init__(program, deck)
        self.version = version
        self._surfaces = list(surface_meshes(program))
        self._bending = BendingMesh.of(program.scenario)
        self._scratch = tempfile.TemporaryDirectory(prefix="liggghts_", dir=log.absolute().parent)
        self._liggghts = Conversation(path, folder, log)
        self._set_up(checkpoint)
        if checkpoint is not None:
            self.steps, self.grains = (int(x) for x in self.values(["step", "count(all)"]))
            self._take_up(checkpoint)

    def send(self, commands: str) -> str:
        """Execute commands of LIGGGHTS; an error becomes the outcome that fits."""
        try:
            return self._liggghts.say(commands)
        except LiggghtsDied as death:
            raise engine_stop("LIGGGHTS", str(death)) from death

    def values(self, formulas: list[str]) -> list[float]:
        """Numbers that LIGGGHTS's formulas give now, such as ``c_top``."""
        printed = self.send("\n".join(f'print "value $({formula})"' for formula in formulas))
        return [float(word) for word in _VALUE.findall(printed)]

    def insert_layer(self, number: int) -> None:
        """Drop a planned layer from over the bed."""
        self.send(self._blocks[f"layer_{number}"].text)
        self.grains = int(self.values(["count(all)"])[0])

    def set_state(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> None:
        """Place all grains now in the box exactly, without contact history."""
        kinds = np.concatenate([layer.class_number for layer in self._program.layers])
        path = Path(self._scratch.name) / "state.data"
        text = atoms_data(
            self._scenario, "a given state", 1, kinds[: self.grains], position_m,
            (velocity_m_s, spin_rad_s),
        )  # fmt: skip
        path.write_text(text, encoding="utf-8")
        self.send(f'delete_atoms group all\nread_data "{path}" add\nrun 0')
        self._setup_due = True

    def _compute_to(self, target: int) -> None:
        """Compute at once, or from sample to sample of the loads on a mesh that bends."""
        if self._bending is not None:
            self._sample_to(target, self._bending)
            return
        super()._compute_to(target)
        self.steps = target

    def _sample_to(self, target: int, mesh: BendingMesh) -> None:
        every = self._counts.load
        while self.steps < target:
            begins_check = self.steps % self._counts.check < every
            step = min(target, (self.steps // every + 1) * every)
            super()._compute_to(step)
            self.steps = step
            if step % every == 0:
                mesh.add(self.triangle_loads(mesh.name), begins_check)

    def _rms_speed_m_s(self) -> float:
        return self.values(["v_rms_speed"])[0]

    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box.

        Raises
        ------
        EngineStop
            When grains are missing.
        """
        path = Path(self._scratch.name) / "grains.bin"
        self.send(f'write_dump all custom "{path}" id x y z vx vy vz omegax omegay omegaz radius')
        table = read_grains(path)
        if len(table) != self.grains:
            raise EngineStop(
                Outcome.LOST_GRAINS, f"LIGGGHTS has {len(table)} grains left of {self.grains}"
            )
        d = self._scenario.dimension
        return self._snapshot(
            table[:, 0].astype(np.int64),
            table[:, 1 : 1 + d],
            table[:, 4 : 4 + d],
            table[:, 7:10],
            table[:, 10],
        )

    def _mean_loads(self) -> Mapping[str, Array]:
        d = self._scenario.dimension
        count = d * len(self._surfaces)
        values = np.array(self.values([f"f_loads[{i + 1}]" for i in range(count)]))
        return dict(zip(self._surfaces, values.reshape(-1, d), strict=True))

    def triangle_loads(self, name: str) -> TriangleLoads:
        """Stress of the sand on each triangle of a surface at this instant, in three dimensions."""
        path = Path(self._scratch.name) / "surface.vtk"
        fields = "stress stresscomponents area id"
        self.send(f'write_dump all mesh/vtk "{path}" {fields} surface_{name}')
        return read_triangle_loads(path)

    def _vertex_sums(self, name: str) -> tuple[Array, int]:
        """Loads of triangles, shared evenly by the two vertices of their side."""
        mesh = self._bending_mesh(name)
        return mesh.sums_n.copy(), mesh.samples

    def move_surface(self, name: str, vertices_m: Array, window_s: float) -> None:
        """Exchange the pattern's mesh for one at its new place, at once.

        Meshes of LIGGGHTS move as a whole only. Grains do not see the velocity of the new one, and
        tangential springs with all meshes begin anew, for it keeps them together.
        """
        mesh = self._bending_mesh(name)
        path = Path(self._scratch.name) / "bent.stl"
        mesh.move(vertices_m)
        drawn_m = surface_meshes(self._program)[name]
        span_m = float(drawn_m[..., 2].min()), float(drawn_m[..., 2].max())
        write_stl(path, name, outline_strips(vertices_m, span_m))
        self.send(mesh.exchange(self._blocks["walls"].text, path))
        self._setup_due = True

    def _bending_mesh(self, name: str) -> BendingMesh:
        """The mesh of a name, if it is the one that bends; refuse any other."""
        if self._bending is None or name != self._bending.name:
            raise RefusedError("surface", name, self._valid_surface)
        return self._bending

    def close(self) -> None:
        """End LIGGGHTS."""
        self._liggghts.close()
        self._scratch.cleanup()
