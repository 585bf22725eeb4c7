"""The one mesh of a LIGGGHTS scene that bends: its loads by vertex, its exchange."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sandmould.engines.liggghts.vtk_stress import TriangleLoads
from sandmould.geometry.geometry import Array
from sandmould.scenario.scenario import Scenario


class BendingMesh:
    """Strips across the plane of the discs along an outline, one between two vertices."""

    def __init__(self, name: str, vertices_m: Array) -> None:
        """Lie as drawn.

        ``vertices_m``, (nv, 2) float64, m: of the closed outline in order.
        """
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

        So force is kept, and moment but for where on its side a grain lies.

        ``begins_check``: whether samples up to now belong to an earlier check.
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
