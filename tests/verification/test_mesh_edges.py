"""A grain that falls on a block from a file: on a face, a seam, beside an edge and a vertex."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from sandmould.kinds.sand.planning import SandPlanning
from tests.verification.cases.bench import RADIUS_M, Array, Bench, law, scene
from tests.verification.cases.case import RefusedCase

SPEED_M_S = 2e-3
"""So slow that the normal at an edge hardly turns during a contact: overlaps of 5e-4 radii."""
HALF_M, TOP_M, MIDDLE_M = 0.02, 0.07, 0.1
OFFSETS = {
    "face": (0.5 * HALF_M, -0.3 * HALF_M), "seam": (0.0, 0.0),
    "beyond the edge": (HALF_M + 0.5 * RADIUS_M, 0.0),
    "beyond the vertex": (HALF_M + 0.3 * RADIUS_M, HALF_M + 0.3 * RADIUS_M),
    "inside the edge": (HALF_M - 5e-3 * RADIUS_M, 0.0),
    "inside the vertex": (HALF_M - 5e-3 * RADIUS_M, HALF_M - 5e-3 * RADIUS_M),
}  # fmt: skip
"""Of the grain's middle from that of the block."""


def rebounds(engine: str, file: Path) -> dict[str, Array]:
    """Velocity after an impact straight down over the speed before it, (3,), by place."""
    block = trimesh.creation.box(extents=3 * [2 * HALF_M])
    block.apply_translation([MIDDLE_M, MIDDLE_M, TOP_M - HALF_M])
    block.export(file)
    of_walls = law(3, damping_ratio=0.3)
    obstacle = {"kind": "mesh", "name": "block", "file": str(file), "unit_m": 1.0}
    given = scene(engine, 3, 1, (RADIUS_M,), of_walls, of_walls, 2e-6, obstacles=[obstacle])
    # The plan says where the engine is wrong.
    assert ("Edges" in {note.about for note in SandPlanning().notes(given)}) == (
        engine == "liggghts"
    )
    found = {}
    with Bench(given) as bench:
        for place, offset in OFFSETS.items():
            aside = np.maximum(np.abs(offset) - HALF_M, 0.0)
            up_m = np.sqrt(RADIUS_M**2 - aside @ aside) + 1.03e-7
            bench.place([[*(MIDDLE_M + np.array(offset)), TOP_M + up_m]], [[0.0, 0.0, -SPEED_M_S]])
            found[place] = bench.advance(4e-3).velocity_m_s[0] / SPEED_M_S
    return found


@pytest.mark.parametrize("engine", ["reference", "lammps", "liggghts"])
def test_a_grain_leaves_faces_seams_edges_and_vertices_alike(engine: str, tmp_path: Path) -> None:
    """Along the contact's normal the rebound is that on a face, within 1 %: the length of a step.

    LIGGGHTS presses by face and edge both just inside an edge; its plan says so.
    """
    try:
        found = rebounds(engine, tmp_path / "block.stl")
    except RefusedCase as refusal:
        if "CI" in os.environ:
            raise
        pytest.skip(f"{engine}: {refusal}")
    restitution = found["face"][-1]
    assert found["seam"] == pytest.approx([0.0, 0.0, restitution], abs=0.01 * restitution)
    for place in ("beyond the edge", "beyond the vertex"):
        normal = np.array([*np.maximum(np.array(OFFSETS[place]) - HALF_M, 0.0) / RADIUS_M, 0.0])
        normal[-1] = np.sqrt(1.0 - normal @ normal)
        along = found[place] @ normal
        # It meets the edge with a share of its speed, and slides past with the rest.
        assert along == pytest.approx(restitution * normal[-1], rel=0.01)
        sideways = found[place] - along * normal
        before = np.array([0.0, 0.0, -1.0]) + normal[-1] * normal
        assert sideways == pytest.approx(before, abs=0.01)
    for place in ("inside the edge", "inside the vertex"):
        if engine == "liggghts":
            assert 0.6 * restitution < found[place][-1] < 0.9 * restitution
        else:
            assert found[place] == pytest.approx([0.0, 0.0, restitution], abs=0.01 * restitution)
