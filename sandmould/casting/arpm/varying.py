"""Conductances that follow temperature or time: of faces where a property has a curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numba import prange
from scipy.sparse import csr_array

from sandmould.arrays import Floats, Ints
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.compiled import njit
from sandmould.scenario.casting.curves import Curve, along, ends

PLACES = 1024
"""Temperatures of a table."""
CHANGED = 0.01
"""Share by which a conductivity or resistance may have changed before all are found anew."""


@dataclass(frozen=True)
class Transfer:
    """Heat that passes where two materials meet."""

    h_w_m2_k: Curve | None = None
    """Over the temperature of the hotter surface, or over time; None for perfect contact."""
    over_time: bool = False
    coating_m2k_w: float = 0.0
    """In series with it: thickness over conductivity."""

    @property
    def varies(self) -> bool:
        """Whether it is not always the same."""
        return isinstance(self.h_w_m2_k, tuple)

    @property
    def least_m2k_w(self) -> float:
        """Least resistance, m2 K/W."""
        bare = 0.0 if self.h_w_m2_k is None else 1.0 / ends(self.h_w_m2_k)[1]
        return bare + self.coating_m2k_w

    def resistance_m2k_w(self, temperature_k: Floats, time_s: float) -> Floats:
        """Resistance at temperatures, (n,) float64, m2 K/W."""
        if self.h_w_m2_k is None:
            return np.full(len(temperature_k), self.coating_m2k_w)
        place = np.full(len(temperature_k), time_s) if self.over_time else temperature_k
        return 1.0 / along(self.h_w_m2_k, place) + self.coating_m2k_w


class Curves(NamedTuple):
    """What conductances follow."""

    materials: Sequence[ThermalMaterial]
    transfers: Mapping[tuple[int, int], Transfer]
    """By the numbers of two materials, the smaller one first."""
    low_k: float
    high_k: float


class MetFaces(NamedTuple):
    """Faces as compiled code takes them."""

    first: Ints
    second: Ints
    """(f,) int64: elements."""
    length_m: Floats
    """(2, f) float64, m: from each of the two to the surface between them."""
    area_m2: Floats
    """(f,) float64: of the grid."""
    share: Floats
    """(f,) float64: of it that lies in the drawn surface."""
    transfer: Ints
    """(f,) int64: number of the transfer that acts on it, or -1."""
    material: Ints
    """(n,) int64: of each element."""


@dataclass(frozen=True)
class VaryingFaces:
    """Faces, what they follow, and how their conductances make rates."""

    faces: MetFaces
    into: csr_array
    """(p, f) sparse, 1/m3: from conductances to the rates of an exchange."""
    curves: Curves
    conductivity_w_m_k: Floats
    """(m, PLACES) float64."""

    @property
    def over_time(self) -> bool:
        """Whether something changes with time alone."""
        return any(it.over_time and it.varies for it in self.curves.transfers.values())

    @property
    def changed_k(self) -> float:
        """Least change of temperature with which one of them may have changed so much, K."""
        transfers = self.curves.transfers.values()
        at = np.linspace(self.curves.low_k, self.curves.high_k, PLACES)
        resistance = [it.resistance_m2k_w(at, 0.0) for it in transfers if it.varies]
        steepest = np.abs(np.diff(np.log([*self.conductivity_w_m_k, *resistance]))).max()
        return float(CHANGED * (at[1] - at[0]) / max(steepest, 1e-12))

    def sorted(self, back: Ints, material: Ints, entry: Ints) -> VaryingFaces:
        """The same for elements in another order.

        Parameters
        ----------
        back : (n,) int64
            New number of each element.
        material : (n,) int64
            In the new order.
        entry : (p,) int64
            Which rate comes where.
        """
        faces = self.faces._replace(
            first=back[self.faces.first], second=back[self.faces.second], material=material
        )
        return replace(self, faces=faces, into=self.into[entry])

    def rates_w_m3_k(self, temperature_k: Floats, time_s: float) -> Floats:
        """Rates of the exchange at temperatures of the elements, (n,) float64, K, and a time."""
        at = np.linspace(self.curves.low_k, self.curves.high_k, PLACES)
        transfers = self.curves.transfers.values()
        resistance = np.array([it.resistance_m2k_w(at, time_s) for it in transfers])
        conductance = _conductances(
            self.faces, self.conductivity_w_m_k, resistance.reshape(-1, PLACES), at[0],
            at[1] - at[0], temperature_k,
        )  # fmt: skip
        return np.asarray(self.into @ conductance)


def varying_faces(faces: MetFaces, into: csr_array, curves: Curves) -> VaryingFaces:
    """Tabulate what faces follow."""
    at = np.linspace(curves.low_k, curves.high_k, PLACES)
    conductivity = [along(it.conductivity_w_m_k, at) for it in curves.materials]
    return VaryingFaces(faces, into, curves, np.array(conductivity))


@njit(inline="always")
def _at(rows: Any, row: int, place: float) -> Any:
    """Value of a table at a place counted in its steps."""
    node = min(max(int(place), 0), PLACES - 2)
    share = min(max(place - node, 0.0), 1.0)
    return rows[row, node] + share * (rows[row, node + 1] - rows[row, node])


@njit(parallel=True)
def _conductances(
    faces: MetFaces, conductivity: Floats, resistance: Floats, low_k: float, step_k: float,
    temperature_k: Floats,
) -> Floats:  # fmt: skip
    """Conductance of each face, (f,) float64, W/K."""
    found = np.empty(len(faces.first))
    for f in prange(len(found)):
        i, j = faces.first[f], faces.second[f]
        place = (temperature_k[i] - low_k) / step_k, (temperature_k[j] - low_k) / step_k
        near = faces.length_m[0, f] / _at(conductivity, faces.material[i], place[0])
        far = faces.length_m[1, f] / _at(conductivity, faces.material[j], place[1])
        share, transfer, resists = faces.share[f], faces.transfer[f], 0.0
        if transfer >= 0:
            hot = near if place[0] > place[1] else far
            surface = max(place)
            # the surface is colder than its element by what drives the heat through that
            for _ in range(3):
                resists = _at(resistance, transfer, surface)
                part = hot * share / ((near + far) * share + resists)
                surface = max(place) - abs(place[0] - place[1]) * part
        found[f] = faces.area_m2[f] * share / ((near + far) * share + resists)
    return found
