"""What a coupled session needs of the pattern: where loads bend it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StaticSolution:
    """The pattern at rest under given loads."""

    displacement_m: Array
    """(nv, d) float64, m, of the vertices of its surface."""
    nodes_m: Array
    """(n, d) float64, m: displacement of all its nodes."""
    energy_j: float
    """Elastic energy stored in it."""
    reaction_n: Array
    """(d,) float64, N: force of the supports on the pattern, and of what it touches."""
    moment_left_n_m: float = np.nan
    """Size of the moment about the origin that loads and reactions leave; NaN where unknown."""
    contact_n: Array | None = None
    """(nv, d) float64, N: of floor, walls and obstacles on the vertices; None where none do."""


class ElasticBody(Protocol):
    """A pattern behind the surface that the sand meets."""

    @property
    def vertices_m(self) -> Array:
        """Vertices of the surface at rest, (nv, d) float64, m."""

    def solve(self, load_n: Array) -> StaticSolution:
        """Find the pattern at rest under loads on its vertices, (nv, d) float64, N."""
