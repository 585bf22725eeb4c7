"""What the staggered loop asks of a pattern."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Answer:
    """The pattern at rest under given loads."""

    displacement_m: Array
    """(nv, d) float64, m, of the vertices of its surface."""
    energy_j: float
    """Elastic energy stored in it."""
    reaction_n: Array
    """(d,) float64, N: force of the supports on the pattern."""
    moment_left_n_m: float = np.nan
    """Size of the moment about the origin that loads and reactions leave; none unless told."""


class ElasticBody(Protocol):
    """A pattern behind the surface that the sand sees."""

    @property
    def vertices_m(self) -> Array:
        """Vertices of the surface at rest, (nv, d) float64, m."""

    def answer(self, load_n: Array) -> Answer:
        """Find the pattern at rest under loads on its vertices, (nv, d) float64, N."""
