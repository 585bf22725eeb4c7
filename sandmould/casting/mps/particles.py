"""Particles of fluid and of mould."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sandmould.arrays import Flags, Floats

Kinds = NDArray[np.int8]

FLUID, WALL, DUMMY = 0, 1, 2
"""Fluid; the mould's innermost layer, which has a pressure; the layers behind it, which only add
to the number density of what is near."""
WALL_LAYERS = 3
"""One of wall and two of dummies fill the kernel of the outermost fluid up to c_k = 3."""


@dataclass
class Particles:
    """State of all particles; fluid moves, the mould keeps its place and velocity."""

    position_m: Floats
    """(n, 3) float64, m."""
    velocity_m_s: Floats
    """(n, 3) float64, m/s; of the mould: what fluid sticks to."""
    kind: Kinds
    """(n,) int8: FLUID, WALL or DUMMY."""

    @property
    def fluid(self) -> Flags:
        """(n,) bool."""
        return self.kind == FLUID

    def joined(self, other: Particles) -> Particles:
        """Both, these first."""
        return Particles(
            np.concatenate((self.position_m, other.position_m)),
            np.concatenate((self.velocity_m_s, other.velocity_m_s)),
            np.concatenate((self.kind, other.kind)),
        )


def at_rest(position_m: Floats, kind: Kinds | int) -> Particles:
    """Particles without velocity; positions may have two or three components."""
    place = np.zeros((len(position_m), 3))
    place[:, : position_m.shape[1]] = position_m
    kinds = np.broadcast_to(np.asarray(kind, dtype=np.int8), len(place)).copy()
    return Particles(place, np.zeros_like(place), kinds)


def lattice(low: tuple[int, ...], high: tuple[int, ...], spacing_m: float) -> Floats:
    """Points of a lattice, half a spacing off the origin, (n, d) float64, m.

    ``low``, ``high``, tuple of d ints: sites run from low to high, high left out.
    """
    axes = [np.arange(a, b) + 0.5 for a, b in zip(low, high, strict=True)]
    return spacing_m * np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(low))


def mould_around(
    site_m: Floats, is_cavity: Callable[[Floats], Flags], spacing_m: float
) -> Particles:
    """Mould particles behind the surface of a cavity.

    Sites outside the cavity within the mould's layers of it (in the largest component of their
    distance); those touching it, diagonals included, are walls, the rest dummies. ``site_m``,
    (n, d) float64, m: lattice of candidates; it must reach the mould's layers beyond the cavity.
    ``is_cavity``: function of (n, d) float64, m, to (n,) bool.
    """
    inside = is_cavity(site_m)
    outer = site_m[~inside]
    far, _ = cKDTree(site_m[inside]).query(outer, p=np.inf)
    layer = np.round(far / spacing_m)
    within = layer <= WALL_LAYERS
    return at_rest(outer[within], np.where(layer[within] == 1, WALL, DUMMY).astype(np.int8))
