"""Conductances that follow temperature or time: of faces where a property has a curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray
from scipy.sparse import csr_array

from sandmould.arrays import Floats, Ints
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.compiled import njit
from sandmould.scenario.casting.curves import Curve, along, ends

AnyInts = NDArray[np.integer[Any]]
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

    def resistances_m2k_w(self, at_k: Floats, time_s: float) -> Floats:
        """Of each transfer at temperatures, (t, n) float64."""
        found = [it.resistance_m2k_w(at_k, time_s) for it in self.transfers.values()]
        return np.array(found).reshape(-1, len(at_k))


class Tables(NamedTuple):
    """What faces follow, over evenly spaced temperatures; compiled code takes it."""

    at_k: Floats
    """(PLACES,) float64."""
    step_k: float
    conductivity_w_m_k: Floats
    """(m, PLACES) float64."""
    resistance_m2k_w: Floats
    """(t, PLACES) float64: of each transfer, at the start."""


class MetFaces(NamedTuple):
    """Faces as compiled code takes them, those between two materials first."""

    first: AnyInts
    second: AnyInts
    """(f,) int32: elements; short numbers, as most of the time goes to memory."""
    length_m: Floats
    """(2, f) float64, m: from each of the two to the surface between them."""
    area_m2: Floats
    """(f,) float64: of the grid."""
    share: Floats
    """(t,) float64: of it that lies in the drawn surface."""
    transfer: Ints
    """(t,) int64: number of the transfer that acts on it."""
    material: Ints
    """(n,) int64: of each element."""


@dataclass(frozen=True)
class VaryingFaces:
    """Faces, what they follow, and how their conductances make rates."""

    faces: MetFaces
    into: csr_array
    """(p, f) sparse, 1/m3: from conductances to the rates of an exchange."""
    curves: Curves
    tables: Tables

    @property
    def over_time(self) -> bool:
        """Whether something changes with time alone."""
        return any(it.over_time and it.varies for it in self.curves.transfers.values())

    @property
    def changed_k(self) -> float:
        """Least change of temperature with which one of them may have changed so much, K."""
        varies = [it.varies for it in self.curves.transfers.values()]
        of_all = [*self.tables.conductivity_w_m_k, *self.tables.resistance_m2k_w[varies]]
        steepest = np.abs(np.diff(np.log(of_all))).max()
        return float(CHANGED * self.tables.step_k / max(steepest, 1e-12))

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
        first, second = (back[it].astype(np.int32) for it in self.faces[:2])
        faces = self.faces._replace(first=first, second=second, material=material)
        into = self.into[entry]
        begin, of = (it.astype(np.int32) for it in (into.indptr, into.indices))
        return replace(self, faces=faces, into=csr_array((into.data, of, begin), into.shape))

    def find_rates(self, temperature_k: Floats, time_s: float, rate_w_m3_k: Floats) -> None:
        """Find the exchange's rates, (p,) float64, at the elements' temperatures and a time."""
        tables = self.tables
        if self.over_time:
            resistance = self.curves.resistances_m2k_w(tables.at_k, time_s)
            tables = tables._replace(resistance_m2k_w=resistance)
        into = self.into
        _find_rates(self.faces, tables, into.indptr, into.indices, into.data, temperature_k,
                    rate_w_m3_k)  # fmt: skip


def varying_faces(faces: MetFaces, into: csr_array, curves: Curves) -> VaryingFaces:
    """Tabulate what faces follow; here all have a transfer, -1 within a material."""
    at = np.linspace(curves.low_k, curves.high_k, PLACES)
    conductivity = np.array([along(it.conductivity_w_m_k, at) for it in curves.materials])
    tables = Tables(at, at[1] - at[0], conductivity, curves.resistances_m2k_w(at, 0.0))
    order = np.argsort(faces.transfer < 0, kind="stable")
    met = order[: int((faces.transfer >= 0).sum())]
    faces = faces._replace(
        first=faces.first[order], second=faces.second[order],
        length_m=np.ascontiguousarray(faces.length_m[:, order]), area_m2=faces.area_m2[order],
        share=faces.share[met], transfer=faces.transfer[met],
    )  # fmt: skip
    return VaryingFaces(faces, into[:, order], curves, tables)


@njit()
def changed(now: Floats, then: Floats, least: float) -> bool:
    """Whether one of some numbers has changed so much, or was none."""
    at = 0
    while at < len(now) and abs(now[at] - then[at]) < least:
        at += 1
    return at < len(now)


@njit(inline="always")
def _at(rows: Any, row: int, place: float) -> Any:
    """Value of a table at a place counted in its steps."""
    node = min(max(int(place), 0), PLACES - 2)
    share = min(max(place - node, 0.0), 1.0)
    return rows[row, node] + share * (rows[row, node + 1] - rows[row, node])


@njit(parallel=True, error_model="numpy")
def _find_rates(
    faces: MetFaces, tables: Tables, begin: AnyInts, of: AnyInts, into: Floats,
    temperature_k: Floats, rate: Floats,
) -> None:  # fmt: skip
    """Conductance of each face, W/K, and of these the rates."""
    n, found, meet = len(temperature_k), np.empty(len(faces.first)), len(faces.transfer)
    conducts, place = np.empty(n), np.empty(n)
    for i in prange(n):
        place[i] = (temperature_k[i] - tables.at_k[0]) / tables.step_k
        conducts[i] = _at(tables.conductivity_w_m_k, faces.material[i], place[i])
    for f in prange(meet):
        i, j, share = faces.first[f], faces.second[f], faces.share[f]
        near, far = faces.length_m[0, f] / conducts[i], faces.length_m[1, f] / conducts[j]
        hot = near if place[i] > place[j] else far
        hottest, apart = max(place[i], place[j]), abs(place[i] - place[j])
        surface, resists = hottest, 0.0
        # the surface is colder than its element by what drives the heat through that
        for _ in range(3):
            resists = _at(tables.resistance_m2k_w, faces.transfer[f], surface)
            part = hot * share / ((near + far) * share + resists)
            surface = hottest - apart * part
        found[f] = faces.area_m2[f] * share / ((near + far) * share + resists)
    for f in prange(meet, len(found)):
        near = faces.length_m[0, f] / conducts[faces.first[f]]
        found[f] = faces.area_m2[f] / (near + faces.length_m[1, f] / conducts[faces.second[f]])
    if len(of) == len(rate):
        for p in prange(len(rate)):
            rate[p] = into[p] * found[of[p]]
        return
    for p in prange(len(rate)):
        total = 0.0
        for k in range(begin[p], begin[p + 1]):
            total += into[k] * found[of[k]]
        rate[p] = total
