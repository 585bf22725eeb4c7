"""The grains of the reference solver as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sandmould.arrays import Floats, Ints


class Grains(NamedTuple):
    """State and properties of n grains; d components, s = 1 spin component in 2D, 3 in 3D.

    Between two steps positions and forces belong to the step, velocities and spins to half a step
    before it: the state of the central differences (3)-(7).
    """

    id: Ints
    """(n,) int64."""
    position: Floats
    """(n, d) float64, m."""
    velocity: Floats
    """(n, d) float64, m/s, half a step ago."""
    spin: Floats
    """(n, s) float64, rad/s, half a step ago."""
    radius: Floats
    """(n,) float64, m."""
    mass: Floats
    """(n,) float64, kg."""
    inertia: Floats
    """(n,) float64, kg m2."""
    force: Floats
    """(n, d) float64, N: of contacts alone."""
    moment: Floats
    """(n, s) float64, N m: of contacts alone."""

    @classmethod
    def none(cls, dimension: int) -> Grains:
        """No grain yet."""
        spins = 1 if dimension == 2 else 3
        line, vector, spin = np.zeros(0), np.zeros((0, dimension)), np.zeros((0, spins))
        ids = np.zeros(0, dtype=np.int64)
        return cls(ids, vector, vector, spin, line, line, line, vector, spin)

    def joined(self, more: Grains) -> Grains:
        """These grains and more of them."""
        both = zip(self._fields, self, more, strict=True)
        return self._replace(**{name: np.concatenate([a, b]) for name, a, b in both})

    def ordered(self, order: Ints) -> Grains:
        """The same grains in another order of storage."""
        return self._replace(**{name: array[order] for name, array in self._asdict().items()})
