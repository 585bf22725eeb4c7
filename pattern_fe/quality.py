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

    Returns
    -------
    (ne,) float64
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
    assert isinstance(config.shape, PatternDrawing)
    mesh = pattern.space.mesh
    quality = tetrahedron_quality(mesh)
    drawn = TriangleMesh("pattern", *drawn_surface(config.shape, "pattern.shape"))
    poor = int((quality < POOR).sum())
    warning = (
        f" {poor} are flatter than {number(POOR)}: another pattern.element_m may do better."
        if poor
        else ""
    )
    return (
        f"The pattern's mesh has {mesh.nelements:,} tetrahedra of {number(1e3 * config.element_m)} "
        f"mm, {pattern.space.node_m.size:,} unknowns and {len(pattern.surface.vertices_m):,} "
        f"vertices that sand meets; it holds {pattern.space.weight.sum() / drawn.measure:.1%} of "
        "the drawing's volume. Quality of its elements, 1 where regular: "
        f"{number(quality.mean(), 2)} in the mean, {number(quality.min(), 2)} at worst.{warning}"
    )
