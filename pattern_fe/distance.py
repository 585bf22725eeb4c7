"""How far a deformed pattern is from its drawing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sandmould.geometry.geometry import Array
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.pattern_fe.perimeter import Perimeter


@dataclass(frozen=True)
class Distance:
    """Distances of a deformed surface from the surface drawn."""

    vertex_m: Array
    """(nv,) float64, m: of each vertex; positive where it is outside the drawing."""
    largest_m: float
    rms_m: float
    """Root of the mean square over the deformed surface, by area."""


def distance_from_drawing(drawn: Perimeter, deformed: Perimeter) -> Distance:
    """Measure from each vertex of the deformed surface to the nearest point of the drawn one.

    What slides along itself has no distance.
    """
    place_m = deformed.vertices_m
    if drawn.loops:
        away_m = _from_lines_m(drawn, place_m)
    else:
        away_m = TriangleMesh("drawn", drawn.vertices_m, drawn.facets).distance_m(place_m)
    rms_m = float(np.sqrt(np.average(away_m**2, weights=deformed.vertex_area_m2)))
    return Distance(away_m, float(np.abs(away_m).max()), rms_m)


def _from_lines_m(drawn: Perimeter, place_m: Array) -> Array:
    """Signed distance from closed lines; the solid lies left of them, so holes run clockwise."""
    distances_m = []
    for loop in drawn.loops:
        vertices_m = drawn.vertices_m[loop]
        x, y = vertices_m.T
        is_outer = np.dot(x, np.roll(y, -1)) > np.dot(y, np.roll(x, -1))
        away_m = Outline("drawn", vertices_m).distance_m(place_m)
        distances_m.append(away_m if is_outer else -away_m)
    return np.asarray(np.max(distances_m, axis=0))
