"""A bed as it may lie once filled, for drawings: nothing of it is computed by contact laws.

Grains of the sieve's sizes start on a jittered lattice, layer over layer, wherever sand can come to
from above but in cavities, and are then pushed apart until hardly any overlap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.geometry import Array, distance_within
from sandmould.scenario.placement import filled_measure, nominal_fraction, plan_counts, portion_of
from sandmould.scenario.scenario import Scenario

MOST_DRAWN = {2: 80_000, 3: 30_000}
"""Grains that are placed; of more only a slice of the box is filled, dense and to scale."""
_PASSES, _LISTED = 80, 8
"""Rounds of pushing, and for how many a list of neighbours holds."""
_PUSH = 0.45
"""Share of an overlap that a round takes away: more makes grains of many neighbours swing."""
_SKIN = 0.4
"""Gap up to which grains are listed, over the largest radius."""


@dataclass(frozen=True)
class LikelyBed:
    """Grains of a filled box that was never computed, or those of a slice of it."""

    position_m: Array
    """(n, d) float64, m."""
    radius_m: Array
    """(n,) float64, m."""
    layer: NDArray[np.int64]
    """(n,) int64: layer of fill, starting at 1."""
    of_grains: int
    """Grains of the whole box."""
    slice_m: tuple[float, float] | None
    """Ends of the slice along y, in 2D along x; None where the box is whole."""


def likely_bed(s: Scenario, cut_m: float | None = None) -> LikelyBed:
    """Fill the box of a scenario with as many grains of each size as are planned.

    ``cut_m``: y at which the slice begins of a box with too many grains; it lies in the middle
    unless given.
    """
    counts, d = plan_counts(s), s.dimension
    total, rng = sum(counts), np.random.default_rng([s.seed, 0])
    low, high = np.array(s.pouring_m).T
    low, high = low.copy(), high.copy()
    slice_m = None
    if total > MOST_DRAWN[d]:
        across = d - 2
        width = (high[across] - low[across]) * MOST_DRAWN[d] / total
        begin = 0.5 * (low[across] + high[across] - width) if cut_m is None else cut_m
        low[across] = min(max(begin, low[across]), high[across] - width)
        high[across] = low[across] + width
        counts = [max(1, round(n * MOST_DRAWN[d] / total)) for n in counts]
        slice_m = (float(low[across]), float(high[across]))
    classes = s.sand.classes(d)
    diameter_m = np.array([c.diameter_m for c in classes])
    share = np.array([c.count_fraction for c in classes])
    upto = np.cumsum(share / share.sum())[:-1]
    drawn_m = [
        rng.permutation(diameter_m[np.searchsorted(upto, (np.arange(n) + 0.5) / n)]) for n in counts
    ]
    space = filled_measure(s) / nominal_fraction(s) / total
    start_m, room_m = _lattice(s, low, high, space ** (1.0 / d), sum(counts), rng)
    ends = np.cumsum(counts)
    radius_m = np.concatenate(
        [
            _sized(diameters_m / 2.0, room_m[end - n : end], rng)
            for diameters_m, n, end in zip(drawn_m, counts, ends.tolist(), strict=True)
        ]
    )
    numbers = [portion_of(s, number)[0] for number in range(1, len(counts) + 1)]
    layer = np.repeat(numbers, counts)
    return LikelyBed(_apart(s, start_m, radius_m, low, high), radius_m, layer, total, slice_m)


def _lattice(
    s: Scenario, low: Array, high: Array, spacing_m: float, count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """The lowest points of a jittered lattice that sand can come to, and the room at each."""
    from scipy import ndimage  # slow to import, and few commands need it

    steps = np.maximum(1, np.rint((high - low) / spacing_m)).astype(int)
    levels = int(s.scene.top_m / spacing_m) + -(-count // int(steps.prod())) + 2
    numbers = np.meshgrid(np.arange(levels), *map(np.arange, steps), indexing="ij")
    cells = np.stack(numbers, -1).reshape(-1, len(steps) + 1) + 0.5
    point_m = np.column_stack([low + (high - low) * cells[:, 1:] / steps, spacing_m * cells[:, 0]])
    room_m = _room_m(s, point_m, s.largest_diameter_m)
    free = room_m > 0.25 * spacing_m
    # sand comes from above: not under a closed gate, nor under a plank as wide as the box
    parts, _ = ndimage.label(free.reshape(levels, *steps))
    reached = np.isin(parts, np.unique(parts[-1][parts[-1] > 0])).ravel()
    chosen = np.flatnonzero(reached)[:count]
    jitter_m = rng.uniform(-0.3, 0.3, (len(chosen), len(steps) + 1)) * spacing_m
    return point_m[chosen] + jitter_m, room_m[chosen]


def _room_m(s: Scenario, position_m: Array, reach_m: float) -> Array:
    """Distance of points from solids and from cavities, (n,) float64, m; below 0 inside."""
    # Cavities are still empty when the box has been filled, so they hold grains off as solids do.
    room_m = s.scene.clearance_m(position_m, reach_m)
    for bore in s.scene.bores:
        depth_m, across_m = bore.local(position_m)
        beside_m = np.linalg.norm(across_m, axis=1) - np.linalg.norm(bore.section_m, axis=1).max()
        along_m = np.maximum(-depth_m, depth_m - bore.length_m)
        room_m = np.minimum(room_m, np.maximum(beside_m, along_m))
    for cavity in s.scene.cavities:
        room_m = np.minimum(room_m, distance_within(cavity.space, position_m, reach_m))
    return room_m


def _sized(radius_m: Array, room_m: Array, rng: np.random.Generator) -> Array:
    """Radii dealt out so that grains fit between solids: no large one starts in a thin wall."""
    dealt = np.zeros(len(room_m))
    left = rng.permutation(len(room_m))
    for size_m, count in zip(
        *(a[::-1] for a in np.unique(radius_m, return_counts=True)), strict=True
    ):
        # in random order those with room enough, then the roomiest
        left = left[np.argsort(-np.minimum(room_m[left], size_m), kind="stable")]
        dealt[left[:count]] = size_m
        left = rng.permutation(left[count:])
    return dealt


def _apart(s: Scenario, position_m: Array, radius_m: Array, low: Array, high: Array) -> Array:
    """Places after overlapping grains have pushed each other, and solids them, apart."""
    from scipy.spatial import cKDTree  # slow to import, and few commands need it

    position_m, skin_m = position_m.copy(), _SKIN * float(radius_m.max())
    for turn in range(_PASSES):
        if turn % _LISTED == 0:
            reach_m = 2.0 * float(radius_m.max()) + skin_m
            pairs = cKDTree(position_m).query_pairs(reach_m, output_type="ndarray")
            gap_m = np.linalg.norm(position_m[pairs[:, 0]] - position_m[pairs[:, 1]], axis=1)
            near = gap_m < radius_m[pairs].sum(axis=1) + skin_m
            a, b = pairs[near].T
            room_m = _room_m(s, position_m, reach_m)
            beside = np.flatnonzero(room_m < radius_m + skin_m)
        apart_m = position_m[a] - position_m[b]
        distance_m = np.linalg.norm(apart_m, axis=1)
        overlap_m = radius_m[a] + radius_m[b] - distance_m
        push = np.flatnonzero(overlap_m > 0.0)
        share = _PUSH * overlap_m[push] / np.maximum(distance_m[push], 1e-12)
        for axis in range(position_m.shape[1]):
            step = share * apart_m[push, axis]
            position_m[:, axis] += np.bincount(a[push], step, len(radius_m))
            position_m[:, axis] -= np.bincount(b[push], step, len(radius_m))
        position_m[beside] += _out_of_solids(s, position_m[beside], radius_m[beside])
        sides = radius_m[:, None]
        position_m[:, :-1] = np.clip(position_m[:, :-1], low + sides, high - sides)
    return position_m


def _out_of_solids(s: Scenario, position_m: Array, radius_m: Array) -> Array:
    """Moves, (n, d) float64, m, that take grains to the surface of the solids they overlap."""
    reach_m = 2.0 * float(radius_m.max(initial=0.0))
    moves = np.zeros_like(position_m)
    deep_m = radius_m - _room_m(s, position_m, reach_m)
    inside = np.flatnonzero(deep_m > 0.0)
    step_m = 0.02 * radius_m[inside]
    slope = np.zeros((len(inside), position_m.shape[1]))
    for axis in range(position_m.shape[1]):
        shifted = position_m[inside].copy()
        shifted[:, axis] += step_m
        slope[:, axis] = (radius_m - deep_m)[inside] - _room_m(s, shifted, reach_m)
    length = np.maximum(np.linalg.norm(slope, axis=1), 1e-12)
    moves[inside] = -slope / length[:, None] * deep_m[inside, None]
    return moves
