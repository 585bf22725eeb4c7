"""Solids of a scene as surfaces of our own solver, alone and inside LAMMPS."""

from __future__ import annotations

import numpy as np

from sandmould.dem.surfaces import Surfaces
from sandmould.geometry.geometry import Scene


def add_solids(surfaces: Surfaces, scene: Scene) -> None:
    """Add outlines, meshes and round solids: all solids but blocks."""
    for outline in scene.outlines:
        k = len(outline.vertices_m)
        ring = np.column_stack([np.arange(k), np.roll(np.arange(k), -1)])
        surfaces.add_facets(outline.name, outline.vertices_m, ring)
    for mesh in scene.meshes:
        surfaces.add_facets(mesh.name, mesh.vertices_m, mesh.triangles)
    for round_solid in scene.revolved:
        surfaces.add_revolved(
            round_solid.name, round_solid.origin_m, round_solid.axis, round_solid.profile_m, True
        )
