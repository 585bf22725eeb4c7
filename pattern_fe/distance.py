"""How far a deformed pattern is from its drawing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pattern_fe.perimeter import Perimeter
from sandmould.scenario.geometry import Array
from sandmould.scenario.mesh import TriangleMesh
from sandmould.scenario.outline import Outline


@dataclass(frozen=True)
class Distance:
    """Distances of a deformed surface from the surface drawn, mm."""

    largest_mm: float
    rms_mm: float
    """Root of the mean square over the deformed surface, by area."""


def distance_from_drawing(drawn: Perimeter, deformed: Perimeter) -> Distance:
    """Measure from each vertex of the deformed surface to the nearest point of the drawn one.

    What slides along itself has no distance.

    Parameters
    ----------
    drawn, deformed : Perimeter
        Of the same pattern.
    """
    place_m = deformed.vertices_m
    if drawn.loops:
        lines = [Outline("drawn", drawn.vertices_m[loop]) for loop in drawn.loops]
        away_m = np.min([np.abs(line.distance_m(place_m)) for line in lines], axis=0)
    else:
        surface = TriangleMesh("drawn", drawn.vertices_m, drawn.facets)
        away_m = np.abs(surface.distance_m(place_m))
    area: Array = deformed.vertex_area_m2
    rms = float(np.sqrt(np.average(away_m**2, weights=area)))
    return Distance(1e3 * float(away_m.max()), 1e3 * rms)
