"""How good the mesh of a drawn pattern is, in a sentence of the plan and the report."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.mesh import TriangleMesh
from sandmould.pattern_fe.pattern import Pattern
from sandmould.runs.formatting import number
from sandmould.scenario.pattern import PatternDrawing
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import drawn_surface

Array = NDArray[np.float64]
POOR = 0.05
"""Quality below which an element is flat: its stiffness is far from the foam's."""


def tetrahedron_quality(mesh: Any) -> Array:
    """Three times the radius of the inner ball over that of the outer one, 1 where regular.

    r = 3 V / A, and 24 V R is the root of (a+b+c)(a+b-c)(a-b+c)(-a+b+c) for the products a, b, c of
    opposite edges.

    Gives (ne,) float64.
    """
    p = mesh.p[:, mesh.t].transpose(2, 1, 0)
    volume = np.abs(np.linalg.det(p[:, 1:] - p[:, :1])) / 6.0
    faces = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
    area = sum(
        0.5 * np.linalg.norm(np.cross(p[:, j] - p[:, i], p[:, k] - p[:, i]), axis=1)
        for i, j, k in faces
    )
    a, b, c = (
        np.linalg.norm(p[:, i] - p[:, j], axis=1) * np.linalg.norm(p[:, k] - p[:, m], axis=1)
        for i, j, k, m in ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2))
    )
    product = np.sqrt(np.maximum((a + b + c) * (a + b - c) * (a - b + c) * (b + c - a), 0.0))
    outer = np.divide(product, 24.0 * volume, out=np.full_like(volume, np.inf), where=volume > 0.0)
    return np.asarray(9.0 * volume / (area * outer))


def mesh_sentence(scenario: Scenario, pattern: Pattern) -> str:
    """Elements, unknowns, volume and quality of the mesh of a drawn pattern."""
    config = scenario.pattern
    assert config is not None
    mesh, space = pattern.space.mesh, pattern.space
    quality = tetrahedron_quality(mesh)
    of_body = np.bincount(space.body_of_node[space.cells[:, 0]], weights=space.weight.sum(axis=1))
    volumes = [
        (volume_m3, TriangleMesh("pattern", *drawn_surface(body.shape, "pattern.shape")).measure)
        for body, volume_m3 in zip(config.bodies, of_body, strict=True)
        if isinstance(body.shape, PatternDrawing)
    ]
    held_m3, drawn_m3 = np.sum(volumes, axis=0)
    poor = int((quality < POOR).sum())
    warning = (
        f" {poor} are flatter than {number(POOR)}: another pattern.element_m may do better."
        if poor
        else ""
    )
    return (
        f"The pattern's mesh has {mesh.nelements:,} tetrahedra of {number(1e3 * config.element_m)} "
        f"mm, {pattern.space.node_m.size:,} unknowns and {len(pattern.surface.vertices_m):,} "
        f"vertices that sand meets; it holds {held_m3 / drawn_m3:.1%} of "
        "the drawing's volume. Quality of its elements, 1 where regular: "
        f"{number(quality.mean(), 2)} in the mean, {number(quality.min(), 2)} at worst.{warning}"
    )
