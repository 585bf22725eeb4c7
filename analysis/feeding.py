"""Which liquid of a casting is cut off from what feeds it, from how long each element flows.

As a casting freezes its liquid falls apart. What is cut off from the risers shrinks without being
fed. Without risers the place that flows last stands for them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAST_SHARE = 0.01
"""Of the time that the casting takes: liquid cut off for less is not told."""
LEAST_ELEMENTS = 2
"""Fewer are not told either: single elements freeze early or late by their steps."""
NIYAMA_LOW = 775.0
"""(K s)^0.5/m: 1 (K min)^0.5/cm, below which Niyama et al. (1982) found shrinkage in steel; from
memory, and other alloys have other limits."""


@dataclass(frozen=True)
class Region:
    """Part of a casting."""

    low_m: Array
    """(d,) float64, m: corners of the box round it."""
    high_m: Array
    volume_m3: float
    """m2 in 2D."""


@dataclass(frozen=True)
class CutOff:
    """Liquid that is cut off from what feeds it."""

    region: Region
    """When it is cut off."""
    cut_off_s: float
    solid_s: float
    """When the last of it no longer flows; infinite where it still does."""
    throat_m: Array
    """(d,) float64, m: where its path to the nearest riser closed; NaN where there was none."""
    path_m: float
    """Length of that path from its middle; NaN where there was none."""


@dataclass(frozen=True)
class Feeding:
    """What a foundry reads of the fields of a casting."""

    cut_off: tuple[CutOff, ...]
    """The largest first."""
    cut_off_fraction: float
    """Of the casting without risers; NaN where some of that still flows."""
    low: Region | None
    """The largest region with a Niyama value below ``NIYAMA_LOW``, risers apart."""
    low_fraction: float
    """Of the casting without risers, in all such regions; NaN where the metal has no range."""
    lowest_m: Array
    """(d,) float64, m: the place in it where that value is least."""
    least_niyama: float
    """There, (K s)^0.5/m: where metal flows last it goes to nothing with smaller elements."""


def feeding(fields: Mapping[str, Any]) -> Feeding | None:
    """Read fields, the arrays of ``fields.npz``; None where an older version wrote them."""
    if "flows_s" not in fields:
        return None
    melts = fields["melts"]
    names = ("position_m", "size_m", "volume_m3", "flows_s", "riser", "niyama_sqrt_ks_m")
    place_m, size_m, volume_m3, flows_s, riser, niyama = (fields[name][melts] for name in names)
    parts = cut_off(place_m, size_m, volume_m3, flows_s, riser)
    whole_m3 = float(volume_m3[~riser].sum())
    lost = sum(part.region.volume_m3 for part in parts) / whole_m3
    if np.isnan(flows_s[~riser]).any():
        lost = math.nan
    low = np.flatnonzero((niyama < NIYAMA_LOW) & ~riser)
    if not len(low):
        share = 0.0 if np.isfinite(niyama).any() else math.nan
        return Feeding(parts, lost, None, share, np.full(place_m.shape[1], math.nan), math.nan)
    first, second = neighbours(place_m[low], size_m[low])
    graph = coo_array((np.ones(len(first)), (first, second)), (len(low),) * 2)
    held_by = connected_components(graph, directed=False)[1]
    held_m3 = np.bincount(held_by, volume_m3[low])
    own = low[held_by == np.argmax(held_m3)]
    region = region_of(place_m[own], size_m[own], volume_m3[own])
    least = own[np.argmin(niyama[own])]
    share = float(held_m3.sum() / whole_m3)
    return Feeding(parts, lost, region, share, place_m[least], float(niyama[least]))


def owner_grid(position_m: Array, size_m: Array) -> tuple[Ints, Array]:
    """Number of the element that covers each cell of the smallest size, -1 for none.

    ``position_m``: (n, d) float64, m; ``size_m``: (n,) float64, m.

    Returns
    -------
    owner : (nx, ny) or (nx, ny, nz) int64
    low_m : (d,) float64, m
        Corner of the grid.
    """
    cell_m = float(size_m.min())
    corner_m = position_m - 0.5 * size_m[:, None]
    low_m = corner_m.min(axis=0)
    shape = np.round(((corner_m + size_m[:, None]).max(axis=0) - low_m) / cell_m).astype(int)
    owner = np.full(shape, -1, dtype=np.int64)
    corner = np.round((corner_m - low_m) / cell_m).astype(np.int64)
    span = np.round(size_m / cell_m).astype(np.int64)
    for cells in np.unique(span):
        own = np.flatnonzero(span == cells)
        for offset in np.ndindex(*[int(cells)] * len(shape)):
            owner[tuple((corner[own] + np.array(offset)).T)] = own
    return owner, low_m


def neighbours(position_m: Array, size_m: Array) -> tuple[Ints, Ints]:
    """Elements that touch by a face: the first and the second of each pair, (p,) int64."""
    owner, pairs = owner_grid(position_m, size_m)[0], []
    for axis in range(owner.ndim):
        along = np.moveaxis(owner, axis, 0)
        touch = np.stack([along[:-1].ravel(), along[1:].ravel()])
        pairs.append(touch[:, (touch >= 0).all(axis=0) & (touch[0] != touch[1])])
    touching, n = np.concatenate(pairs, axis=1), len(size_m)
    first, second = np.divmod(np.unique(touching.min(axis=0) * n + touching.max(axis=0)), n)
    return first, second


def region_of(position_m: Array, size_m: Array, volume_m3: Array) -> Region:
    """The region that some elements make."""
    half_m = 0.5 * size_m[:, None]
    low_m, high_m = (position_m - half_m).min(axis=0), (position_m + half_m).max(axis=0)
    # to a nanometre: corners at 0 are
    return Region(low_m.round(9) + 0.0, high_m.round(9) + 0.0, float(volume_m3.sum()))


def cut_off(
    position_m: Array, size_m: Array, volume_m3: Array, flows_s: Array, riser: NDArray[np.bool_]
) -> tuple[CutOff, ...]:
    """All liquid that is cut off, the largest first.

    Parameters
    ----------
    position_m : (n, d) float64, m
        Of the casting's elements, risers among them.
    size_m : (n,) float64, m
    volume_m3 : (n,) float64, m3
    flows_s : (n,) float64, s
        How long each one flows; NaN where it still does.
    riser : (n,) bool
    """
    end_s = np.where(np.isnan(flows_s), np.inf, flows_s)
    first, second = neighbours(position_m, size_m)
    basin, peak = _basins(end_s, first, second)
    within = coo_array((np.ones(len(first)), (first, second)), (len(end_s),) * 2).tocsr()
    feeds = riser
    if not riser.any():
        body = connected_components(within, directed=False)[1]
        latest = np.lexsort((-end_s, body))
        feeds = np.isin(np.arange(len(body)), latest[np.unique(body[latest], return_index=True)[1]])
    known_s = end_s[np.isfinite(end_s)]
    least_s = LEAST_SHARE * float(known_s.max(initial=0.0))
    found = []
    for members, at_s, throat in _partings(end_s, first, second, basin, peak, feeds):
        own = np.flatnonzero(np.isin(basin, members) & (end_s > at_s))
        last_s = float(end_s[own].max(initial=-math.inf))
        if len(own) < LEAST_ELEMENTS or last_s - at_s < least_s:
            continue
        path_m, throat_m = math.nan, np.full(position_m.shape[1], math.nan)
        if throat is not None:
            throat_m = position_m[list(throat)].mean(axis=0)
            start = own[np.argmax(end_s[own])]
            path_m = _path_m(position_m, within, end_s >= at_s, int(start), feeds)
        region = region_of(position_m[own], size_m[own], volume_m3[own])
        found.append(CutOff(region, at_s, last_s, throat_m, path_m))
    return tuple(sorted(found, key=lambda it: -it.region.volume_m3))


def _basins(end_s: Array, first: Ints, second: Ints) -> tuple[Ints, Ints]:
    """Which peak each element climbs to, (n,) int64, and the element at each peak, (k,) int64."""
    n = len(end_s)
    rank = np.empty(n, dtype=np.int64)
    rank[np.lexsort((np.arange(n), end_s))] = np.arange(n)  # no two are equal
    highest = rank.copy()
    np.maximum.at(highest, first, rank[second])
    np.maximum.at(highest, second, rank[first])
    up = np.argsort(rank)[highest]
    while (up != up[up]).any():
        up = up[up]
    peak, basin = np.unique(up, return_inverse=True)
    return basin, peak


def _partings(
    end_s: Array, first: Ints, second: Ints, basin: Ints, peak: Ints, feeds: NDArray[np.bool_]
) -> Iterator[tuple[list[int], float, tuple[int, int] | None]]:
    """Basins that part from what feeds them, when, and the two elements between them."""
    # Backwards in time liquid grows together; what meets a source late was cut off from there on.
    source, fed = len(peak), np.flatnonzero(feeds)
    pairs = np.hstack([[first, second], [fed, fed]])
    one, other = (
        np.hstack([basin[first], basin[fed]]),
        np.hstack([basin[second], np.full(len(fed), source)]),
    )
    closes_s = end_s[pairs].min(axis=0)
    group, of = {k: [k] for k in range(source + 1)}, list(range(source + 1))
    apart = np.flatnonzero(one != other)
    for pair in apart[np.argsort(-closes_s[apart], kind="stable")]:
        kept, met = of[one[pair]], of[other[pair]]
        if kept == met:
            continue
        if of[source] in (kept, met):
            lost = met if of[source] == kept else kept
            yield group[lost], float(closes_s[pair]), (int(pairs[0, pair]), int(pairs[1, pair]))
        for k in group[met]:
            of[k] = kept
        group[kept] = group[kept] + group.pop(met)
    for root, members in group.items():
        if root != of[source]:
            yield members, 0.0, None


def _path_m(
    position_m: Array,
    within: csr_array,
    flows: NDArray[np.bool_],
    start: int,
    feeds: NDArray[np.bool_],
) -> float:
    """Length of the shortest way through what flows from an element to one that feeds."""
    kept = np.flatnonzero(flows)
    graph = within[kept][:, kept].tocoo()
    ends = kept[graph.row], kept[graph.col]
    length_m = np.linalg.norm(position_m[ends[0]] - position_m[ends[1]], axis=1)
    way: Any = coo_array((length_m, (graph.row, graph.col)), graph.shape).tocsr()
    far_m = dijkstra(way, directed=False, indices=np.searchsorted(kept, [start]))[0]
    return float(far_m[feeds[kept]].min(initial=math.inf))
