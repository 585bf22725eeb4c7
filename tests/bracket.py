"""The shipped pattern of a disc with a side bracket; written by ``python -m tests.bracket``.

As an STL file, and as a STEP file whose disc is round.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from sandmould import ROOT

BRACKET = ROOT / "config" / "meshes" / "bracket.stl"
STEP = BRACKET.with_suffix(".step")
SECTORS, HALF_TAB = 72, 4
RADIUS, REACH = 30.0, 50.0
HEIGHTS = (-8.0, -3.0, 3.0, 8.0)
"""mm: bottom of the disc, bottom and top of the bracket, top of the disc."""


def bracket() -> tuple[np.ndarray, np.ndarray]:
    """A disc about z and a bracket towards x, vertices in mm and outward triangles."""
    angle = 2 * np.pi / SECTORS * np.arange(SECTORS)
    rim = np.column_stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle)])
    tab = np.arange(-HALF_TAB, HALF_TAB + 1)
    edge = np.column_stack([np.full(len(tab), REACH), rim[tab, 1]])
    vertices: list[list[float]] = []

    def add(points: np.ndarray, z: float) -> np.ndarray:
        vertices.extend([x, y, z] for x, y in points)
        return np.arange(len(vertices) - len(points), len(vertices))

    rings = [add(rim, z) for z in HEIGHTS]
    outer = {level: add(edge, HEIGHTS[level]) for level in (1, 2)}
    foot, top = (int(add(np.zeros((1, 2)), z)[0]) for z in (HEIGHTS[0], HEIGHTS[-1]))
    quads, fans = [], []
    for i in range(SECTORS):
        j = (i + 1) % SECTORS
        fans += [(foot, rings[0][j], rings[0][i]), (top, rings[3][i], rings[3][j])]
        opens = i < HALF_TAB or i >= SECTORS - HALF_TAB
        quads += [
            (rings[k][i], rings[k][j], rings[k + 1][j], rings[k + 1][i])
            for k in range(3)
            if not (opens and k == 1)
        ]
    for a, b in zip(range(len(tab) - 1), range(1, len(tab)), strict=True):
        low_a, low_b, high_a, high_b = (rings[k][tab[n]] for k in (1, 2) for n in (a, b))
        quads += [
            (outer[1][a], low_a, low_b, outer[1][b]),
            (high_a, outer[2][a], outer[2][b], high_b),
            (outer[1][a], outer[1][b], outer[2][b], outer[2][a]),
        ]
    first, last = tab[0], tab[-1]
    quads += [
        (rings[1][first], outer[1][0], outer[2][0], rings[2][first]),
        (outer[1][-1], rings[1][last], rings[2][last], outer[2][-1]),
    ]
    split = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return np.array(vertices), np.array(fans + split)


def write_step(path: Path) -> None:
    """Write disc and bracket as one round solid."""
    half_mm = RADIUS * math.sin(HALF_TAB * 2 * math.pi / SECTORS)
    low, inner, outer, high = HEIGHTS

    def build(kernel: Any) -> None:
        disc = kernel.addCylinder(0, 0, low, 0, 0, high - low, RADIUS)
        tab = kernel.addBox(0, -half_mm, inner, REACH, 2 * half_mm, outer - inner)
        kernel.fuse([(3, disc)], [(3, tab)])

    write_solid(path, build)


def write_solid(path: Path, build: Callable[[Any], Any]) -> None:
    """Write a STEP file of what a function builds in mm with Gmsh's kernel of solids."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        build(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def main() -> None:
    """Write the files."""
    vertices, triangles = bracket()
    BRACKET.parent.mkdir(exist_ok=True)
    meshio.stl.write(str(BRACKET), meshio.Mesh(vertices, [("triangle", triangles)]), binary=True)
    write_step(STEP)


if __name__ == "__main__":
    main()
