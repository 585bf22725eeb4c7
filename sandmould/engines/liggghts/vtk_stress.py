"""LIGGGHTS's export of the stress on each triangle of a mesh, legacy VTK polydata.

meshio cannot read this format and ends the process when it tries.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sandmould.geometry.geometry import Array


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
