"""The grains of the reference solver as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandmould.arrays import Floats, Ints, Places
from sandmould.compiled import njit
from sandmould.dem.vectors import OPTIONS

MOST_KINDS = 256
"""Kinds that one byte tells apart."""
_TOO_MANY = f"grains of more than {MOST_KINDS} radii and masses; use size classes"
_OF_KINDS = ("radius_of", "mass_of", "inertia_of")


@njit(**OPTIONS)
def _tell_apart(radius: Floats, mass: Floats, inertia: Floats) -> tuple[NDArray[np.uint8], Ints]:
    """Kind of each grain, in the order they first appear, and the first grain of each kind."""
    of_grain = np.zeros(len(radius), dtype=np.uint8)
    example = np.empty(MOST_KINDS, dtype=np.int64)
    kinds = 0
    for i in range(len(radius)):
        kind = 0
        while kind < kinds and (
            radius[example[kind]] != radius[i]
            or mass[example[kind]] != mass[i]
            or inertia[example[kind]] != inertia[i]
        ):
            kind += 1
        if kind == MOST_KINDS:
            return of_grain, example[:0]
        if kind == kinds:
            example[kind] = i
            kinds += 1
        of_grain[i] = kind
    return of_grain, example[:kinds]


@njit(**OPTIONS)
def _rows_in_order(rows: Floats, order: Ints) -> Floats:
    """Rows of an array in another order: several times as fast as numpy's for so short ones."""
    taken = np.empty_like(rows)
    for i in range(len(order)):
        row = order[i]
        for k in range(rows.shape[1]):
            taken[i, k] = rows[row, k]
    return taken


class Grains(NamedTuple):
    """State and properties of n grains; d components, s = 1 spin component in 2D, 3 in 3D.

    Between two steps positions and forces belong to the step, velocities and spins to half a step
    before it: the state of the central differences (3)-(7). Grains of one radius, mass and inertia
    are of one kind, such as a sieve class.
    """

    id: Places
    """(n,) uint32."""
    position: Floats
    """(n, d) float64, m."""
    velocity: Floats
    """(n, d) float64, m/s, half a step ago."""
    spin: Floats
    """(n, s) float64, rad/s, half a step ago."""
    kind: NDArray[np.uint8]
    """(n,) uint8: place of its properties in the next three."""
    radius_of: Floats
    """(k,) float64, m."""
    mass_of: Floats
    """(k,) float64, kg."""
    inertia_of: Floats
    """(k,) float64, kg m2."""
    force: Floats
    """(n, d) float64, N: of contacts alone."""
    moment: Floats
    """(n, s) float64, N m: of contacts alone."""

    @classmethod
    def of(
        cls,
        id: Ints | Places,
        position: Floats,
        velocity: Floats,
        spin: Floats,
        radius: Floats,
        mass: Floats,
        inertia: Floats,
    ) -> Grains:
        """Grains that touch nothing, their kinds told apart; arrays as those of the class.

        Raises
        ------
        ValueError
            Of more than ``MOST_KINDS`` kinds.
        """
        kind, example = _tell_apart(radius, mass, inertia)
        if len(id) and not len(example):
            raise ValueError(_TOO_MANY)
        return cls(
            id.astype(np.uint32), position, velocity, spin, kind,
            radius[example], mass[example], inertia[example],
            np.zeros_like(position), np.zeros_like(spin),
        )  # fmt: skip

    @classmethod
    def none(cls, dimension: int) -> Grains:
        """No grain yet."""
        spins = 1 if dimension == 2 else 3
        line, vector, spin = np.zeros(0), np.zeros((0, dimension)), np.zeros((0, spins))
        return cls.of(np.zeros(0, dtype=np.int64), vector, vector, spin, line, line, line)

    @property
    def radius(self) -> Floats:
        """(n,) float64, m, a copy."""
        return self.radius_of[self.kind]

    @property
    def mass(self) -> Floats:
        """(n,) float64, kg, a copy."""
        return self.mass_of[self.kind]

    @property
    def inertia(self) -> Floats:
        """(n,) float64, kg m2, a copy."""
        return self.inertia_of[self.kind]

    def joined(self, more: Grains) -> Grains:
        """These grains and more of them."""
        tables = [np.column_stack([g.radius_of, g.mass_of, g.inertia_of]) for g in (self, more)]
        table, place = np.unique(np.concatenate(tables), axis=0, return_inverse=True)
        if len(table) > MOST_KINDS:
            raise ValueError(_TOO_MANY)
        radius_of, mass_of, inertia_of = np.ascontiguousarray(table.T)
        mine, theirs = np.split(place.ravel().astype(np.uint8), [len(self.radius_of)])
        both = zip(self._fields, self, more, strict=True)
        joined = {k: np.concatenate([a, b]) for k, a, b in both if k not in (*_OF_KINDS, "kind")}
        return Grains(
            kind=np.concatenate([mine[self.kind], theirs[more.kind]]),
            radius_of=radius_of, mass_of=mass_of, inertia_of=inertia_of, **joined,
        )  # fmt: skip

    def ordered(self, order: Ints) -> Grains:
        """The same grains in another order of storage."""
        fields = ("position", "velocity", "spin", "force", "moment")
        rows = {k: _rows_in_order(getattr(self, k), order) for k in fields}
        return self._replace(id=self.id[order], kind=self.kind[order], **rows)
