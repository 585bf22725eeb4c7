"""The one mesh of a LIGGGHTS scene that bends: its loads by vertex, its exchange.

The loads are LIGGGHTS's export of the stress on each triangle, legacy VTK polydata: meshio cannot
read this format and ends the process when it tries.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sandmould.geometry.geometry import Array
from sandmould.scenario.scenario import Scenario


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
    """Read what ``dump mesh/vtk ... stresscomponents area`` wrote.

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
