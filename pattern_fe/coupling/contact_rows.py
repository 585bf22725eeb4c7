"""The mass that contacts of explicitly stepped grains ask of a pattern's surface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack

from sandmould.pattern_fe.coupling.explicit_foam import ContactBound
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.perimeter import Perimeter
from sandmould.scenario.scenario import Scenario

Array = NDArray[np.float64]
_CLOSEST = 2.0 / math.sqrt(3.0)
"""Balls on the square of their diameter where they lie closest in a plane."""


@dataclass(frozen=True)
class ContactRows:
    """What touches the surface at most: grains of one size all round it, and one more.

    In 2D they lie in a row; in 3D as close as balls can lie on a plane, spread evenly.

    A contact under central differences with lagged dashpots is borne by the mass
    dt C / 2 + dt^2 K / 4 (section 3.5); shared among the vertices as its force is, it is a matrix.
    """

    row_kg: tuple[Array, ...]
    """(n, n) float64, kg: for each size the sum over a full row, components vertex by vertex; in 3D
    of the size that weighs most."""
    one_kg: float
    """Of the heaviest contact."""

    @classmethod
    def of(cls, scenario: Scenario, pattern: Pattern) -> ContactRows:
        """Rows of all sizes of a scenario's sand along the surface of its pattern."""
        sizes = scenario.sand.classes(scenario.dimension)
        masses_kg = [
            ContactBound.of_grain(scenario, size.diameter_m).mass_kg(scenario.step_s)
            for size in sizes
        ]
        if scenario.dimension == 2:
            shares = [shares_along(pattern, size.diameter_m) for size in sizes]
            products = [kg * share.T @ share for kg, share in zip(masses_kg, shares, strict=True)]
        else:
            # one matrix times a number a size: the largest bears them all
            on_area = max(
                _CLOSEST * kg / size.diameter_m**2
                for kg, size in zip(masses_kg, sizes, strict=True)
            )
            products = [on_area * products_over(pattern.surface)]
        rows = [np.kron(row, np.eye(scenario.dimension)).astype(np.float64) for row in products]
        return cls(tuple(rows), masses_kg[-1])


def products_over(surface: Perimeter) -> Array:
    """Integrals of products of shape functions over a surface of triangles, (nv, nv) float64, m2.

    Of linear ones over a triangle of area A they are A/12, and A/6 of one with itself.
    """
    area = np.linalg.norm(surface.facet_area_vector_m2, axis=1)
    products = np.zeros((len(surface.vertices_m),) * 2)
    for i, j in product(range(3), repeat=2):
        share = area / (6.0 if i == j else 12.0)
        np.add.at(products, (surface.facets[:, i], surface.facets[:, j]), share)
    return products


def shares_along(pattern: Pattern, apart_m: float) -> Array:
    """Shape functions at points along the outer line of a pattern, an even distance apart.

    Gives (points, nv) float64; shares of all vertices of the surface.
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


def shares_on_top(pattern: Pattern, apart_m: float, up: float) -> csr_array:
    """Shape functions at points of an even grid on all that faces up, in 3D, (points, nv) float64.

    Shares of all vertices of the surface, sparse. ``apart_m``: least distance of two points; a face
    that is smaller has one, in its middle. ``up``: share of a facet's area that must face up.
    """
    surface = pattern.surface
    area = surface.facet_area_vector_m2
    facets = surface.facets[area[:, 2] > up * np.linalg.norm(area, axis=1)]
    none = csr_array((0, len(surface.vertices_m)), dtype=np.float64)
    if not len(facets):
        return none
    corner_m = surface.vertices_m[facets][:, :, :2]
    low_m, high_m = corner_m.min(axis=(0, 1)), corner_m.max(axis=(0, 1))
    counts = [max(1, int(side / apart_m)) for side in high_m - low_m]
    lines = [
        a + (np.arange(n) + 0.5) * (b - a) / n
        for a, b, n in zip(low_m, high_m, counts, strict=True)
    ]
    points_m = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2)
    rows = [none]
    for vertices, corner in zip(facets, corner_m, strict=True):
        along = np.linalg.solve((corner[1:] - corner[0]).T, (points_m - corner[0]).T).T
        shares = np.column_stack([1.0 - along.sum(axis=1), along])
        inside = (shares > -1e-9).all(axis=1)
        count = int(inside.sum())
        entries = np.repeat(np.arange(count), 3), np.tile(vertices, count)
        rows.append(csr_array((shares[inside].ravel(), entries), shape=(count, none.shape[1])))
    found = csr_array(vstack(rows))
    # A point on the edge of two facets lies on both of them.
    place = np.rint(np.asarray(found @ surface.vertices_m) / (1e-6 * apart_m))
    return found[np.sort(np.unique(place, axis=0, return_index=True)[1])]
