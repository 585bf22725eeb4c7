"""The mass that contacts of explicitly stepped grains ask of a pattern's surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pattern_fe.coupling.explicit_foam import ContactBound
from pattern_fe.pattern import Pattern
from sandmould.scenario.scenario import Scenario

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactRows:
    """What touches the surface at most: grains of one size in a row all round it, and one more.

    A contact under central differences with lagged dashpots is borne by the mass
    dt C / 2 + dt^2 K / 4 (section 3.5); shared among the vertices as its force is, it is a matrix.
    """

    row_kg: tuple[Array, ...]
    """(n, n) float64, kg: for each size the sum over a full row, components vertex by vertex."""
    one_kg: float
    """Of the heaviest contact."""

    @classmethod
    def of(cls, scenario: Scenario, pattern: Pattern) -> ContactRows:
        """Rows of all sizes of a scenario's sand along the outer line of its pattern."""
        rows: list[Array] = []
        one_kg = 0.0
        for size in scenario.sand.classes(scenario.dimension):
            one_kg = ContactBound.of_grain(scenario, size.diameter_m).mass_kg(scenario.step_s)
            share = shares_along(pattern, size.diameter_m)
            row_kg = one_kg * np.kron(share.T @ share, np.eye(scenario.dimension))
            rows.append(row_kg.astype(np.float64))
        return cls(tuple(rows), one_kg)


def shares_along(pattern: Pattern, apart_m: float) -> Array:
    """Shape functions at points along the outer line of a pattern, an even distance apart.

    Parameters
    ----------
    pattern : Pattern
    apart_m : float, m

    Returns
    -------
    (points, nv) float64
        Shares of all vertices of the surface.
    """
    vertices, line = pattern.surface.vertices_m, pattern.surface.outer_line
    number = np.arange(line.start, line.stop)
    following = np.roll(number, -1)
    length = np.linalg.norm(vertices[following] - vertices[number], axis=1)
    end = np.cumsum(length)
    place = np.arange(0.0, end[-1], apart_m)
    facet = np.searchsorted(end, place, side="right")
    along = 1.0 - (end[facet] - place) / length[facet]
    shares = np.zeros((len(place), len(vertices)))
    points = np.arange(len(place))
    shares[points, number[facet]] = 1.0 - along
    shares[points, following[facet]] = along
    return shares
