"""Where the grains of a layer start: at random, without overlap, in a loose column.

A layer is planned before the run in its own frame, height 0 at its lowest point. The deck lifts
it to the drop height over the bed that it finds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.geometry import Array
from sandmould.scenario.scenario import Scenario
from sandmould.sums import added

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

LOOSE_FRACTION = {2: 0.45, 3: 0.25}
"""Solid fraction of the falling column: random sequential addition jams at 0.547 in 2D (Feder
1980) and 0.38 in 3D, and becomes slow well before."""
NOMINAL_FRACTION = {2: 0.80, 3: 0.58}
"""Solid fraction of a filled bed that turns heights into grains; argued in docs/choices.md."""
WALL_GAP = 0.05
"""Gap kept from side walls, over the radius."""


@dataclass(frozen=True)
class PlannedLayer:
    """Grains of one layer before it is dropped."""

    class_number: NDArray[np.int64]
    """(n,) int64: size class, starting at 1."""
    radius_m: Array
    """(n,) float64, m."""
    position_m: Array
    """(n, d) float64, m; the vertical counts from the layer's own lowest point, or from the floor
    where the grains are placed by hand."""
    velocity_m_s: Array | None = None
    """(n, d) float64, m/s, of grains placed by hand; all others are dropped over the bed."""

    @property
    def height_m(self) -> float:
        """Height of the loose column."""
        return float((self.position_m[:, -1] + self.radius_m).max())

    def rise_m(self, gravity_m_s2: float) -> float:
        """How far a grain that is placed with a velocity can fly up, 0 without gravity."""
        if self.velocity_m_s is None or gravity_m_s2 == 0.0:
            return 0.0
        return float(np.maximum(self.velocity_m_s[:, -1], 0.0).max()) ** 2 / (2 * gravity_m_s2)


def nominal_fraction(s: Scenario) -> float:
    """Solid fraction that turns the height of a layer into grains."""
    return NOMINAL_FRACTION[s.dimension]


def _mean_grain_measure(s: Scenario) -> float:
    return added(
        c.count_fraction * s.sand.grain_measure(c.diameter_m, s.dimension)
        for c in s.sand.classes(s.dimension)
    )


def plan_counts(s: Scenario) -> list[int]:
    """Number of grains of each layer, from its height, mass or count.

    Grains placed by hand are the first layer; each portion of a spout counts by itself. A height
    counts over the whole floor: obstacles only lift the bed.
    """
    mean_measure = _mean_grain_measure(s)
    mean_mass = added(
        c.count_fraction * s.sand.grain_mass_kg(c.diameter_m, s.dimension)
        for c in s.sand.classes(s.dimension)
    )
    counts: list[int] = []
    for layer in s.fill.each_layer():
        if layer.count is not None:
            counts.append(layer.count)
        elif layer.mass_kg is not None:
            counts.append(round(layer.mass_kg / mean_mass))
        else:
            solid = (layer.height_m or 0.0) * s.floor_measure * nominal_fraction(s)
            counts.append(round(solid / mean_measure))
    if s.fill.spout is not None:
        counts = [n for count in counts for n in _portions(count, s.fill.spout.portions)]
    return [len(s.fill.grains), *counts] if s.fill.grains else counts


def _portions(count: int, portions: int) -> list[int]:
    """Grains of each portion of a layer, which differ by one at most."""
    return [count * (i + 1) // portions - count * i // portions for i in range(portions)]


def portion_of(s: Scenario, number: int) -> tuple[int, int]:
    """Layer, from 1, and portion of it, from 0, that is the one of a number to be dropped."""
    by_hand, spout = int(bool(s.fill.grains)), s.fill.spout
    if spout is None or number <= by_hand:
        return number, 0
    layer, portion = divmod(number - 1 - by_hand, spout.portions)
    return by_hand + 1 + layer, portion


def filled_measure(s: Scenario, counts: list[int] | None = None) -> float:
    """Area (m2) of all discs or volume (m3) of all spheres of the fill."""
    return sum(plan_counts(s) if counts is None else counts) * _mean_grain_measure(s)


def predicted_bed_height_m(s: Scenario, counts: list[int]) -> float:
    """Height of the filled bed over the floor.

    Sand that stands on a gate, or is poured over a part of the box, displaces no obstacles; all
    other sand has obstacles and empty bores in it.
    """
    sand = filled_measure(s, counts) / nominal_fraction(s)
    gate_m = _gate_under_sand_m(s)
    if gate_m > 0.0 or s.fill.over_x_m or s.fill.over_y_m:
        return gate_m + sand / s.floor_measure
    displaced = added(solid.measure for solid in s.scene.solids)
    displaced += added(bore.measure for bore in s.scene.bores)
    return (sand + displaced) / s.floor_measure


def predicted_bed_depth_m(s: Scenario, counts: list[int]) -> float:
    """Depth of the filled bed over the floor, or over the gate that it stands on."""
    return predicted_bed_height_m(s, counts) - _gate_under_sand_m(s)


def _gate_under_sand_m(s: Scenario) -> float:
    """Height of the top of a level gate that the sand stands on, 0 without one."""
    gate = s.gate
    if gate is None or not gate.is_level:
        return 0.0
    over = zip(gate.centre_m, s.pouring_m, strict=False)
    under = all(low < centre < high for centre, (low, high) in over)
    return gate.centre_m[-1] + gate.size_m[-1] / 2 if under else 0.0


def loose_height_m(s: Scenario, count: int) -> float:
    """Height of the falling column of a layer, before it is placed."""
    over = s.floor_measure
    if s.fill.spout is not None:
        over = s.fill.spout.width_m ** (s.dimension - 1)
    return count * _mean_grain_measure(s) / over / LOOSE_FRACTION[s.dimension]


def fall_s(s: Scenario, count: int) -> float:
    """Time that the highest grain of a layer falls, at most; infinite without gravity."""
    fall_m = loose_height_m(s, count) + s.fill.drop_height_m
    return math.sqrt(2 * fall_m / s.gravity_m_s2) if s.gravity_m_s2 > 0 else math.inf


def _draw_classes(s: Scenario, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw size classes so that each has its exact share, rounded, in random order."""
    classes = s.sand.classes(s.dimension)
    share = np.cumsum([c.count_fraction for c in classes])
    # Stratified: the k-th grain takes the class at quantile (k + u) / n.
    quantile = (np.arange(count) + rng.random(count)) / count
    return rng.permutation(1 + np.searchsorted(share[:-1], quantile, side="right")).astype(np.int64)


def placed_grains(s: Scenario) -> PlannedLayer:
    """Grains placed by hand, each in the class whose diameter is nearest to its own."""
    classes = s.sand.classes(s.dimension)
    diameters_m = np.array([c.diameter_m for c in classes])
    given_m = np.array([grain.diameter_m for grain in s.fill.grains])
    nearest = np.abs(given_m[:, None] - diameters_m).argmin(axis=1)
    at_rest = (0.0,) * s.dimension
    return PlannedLayer(
        nearest + 1,
        diameters_m[nearest] / 2,
        np.array([grain.position_m for grain in s.fill.grains]),
        np.array([grain.velocity_m_s or at_rest for grain in s.fill.grains]),
    )


def layer_classes(s: Scenario, number: int, count: int) -> NDArray[np.int64]:
    """Classes of the grains that ``plan_layer`` places, found without their places."""
    if s.fill.grains and number == 1:
        return placed_grains(s).class_number
    return _draw_classes(s, count, _layer_rng(s, number))


def _layer_rng(s: Scenario, number: int) -> np.random.Generator:
    """Random numbers of a layer: its classes are drawn first, then its places."""
    return np.random.default_rng([s.seed, number])


def plan_layer(s: Scenario, number: int, count: int) -> PlannedLayer:
    """Place one layer's grains by random sequential addition, largest first.

    ``number``: number of the layer, or of the portion of one, from 1; with the seed it fixes the
    draw.
    """
    if s.fill.grains and number == 1:
        return placed_grains(s)
    rng = _layer_rng(s, number)
    drawn = np.sort(_draw_classes(s, count, rng))[::-1]
    diameters = {c.number: c.diameter_m for c in s.sand.classes(s.dimension)}
    radius = np.array([diameters[c] for c in drawn]) / 2
    spout = s.fill.spout
    over = s.pouring_m if spout is None else spout.window_m(portion_of(s, number)[1])
    low, high = np.array(over).T
    height = max(loose_height_m(s, count), 2.2 * radius[0])
    while (position := _add_sequentially(radius, high - low, height, rng)) is None:
        height *= 1.15
    order = np.argsort(position[:, -1], kind="stable")
    position[:, -1] -= (position[:, -1] - radius).min()
    position[:, :-1] += low
    return PlannedLayer(drawn[order], radius[order], position[order])


def _add_sequentially(
    radius: Array, size_m: Array, height_m: float, rng: np.random.Generator
) -> Array | None:
    """Add grains in batches of one radius; None when a batch finds no room."""
    from scipy.spatial import cKDTree  # no plan needs it: it counts grains and places none

    d = len(size_m) + 1
    placed = np.empty((0, d))
    for r in np.unique(radius)[::-1]:
        placed_radius = radius[: len(placed)]
        tree = cKDTree(placed) if len(placed) else None
        wanted = int((radius == r).sum())
        own = np.empty((0, d))
        low = np.append(np.full(d - 1, r * (1 + WALL_GAP)), r)
        high = np.append(size_m - r * (1 + WALL_GAP), height_m - r)
        for _ in range(400):
            missing = wanted - len(own)
            if missing == 0:
                break
            tried = rng.uniform(low, high, size=(2 * missing + 8, d))
            if tree is not None:
                tried = tried[_free_of(tree, placed_radius, tried, r)]
            own = _free_of_each_other(np.vstack([own, tried]), 2 * r, len(own))[:wanted]
        if len(own) < wanted:
            return None
        placed = np.vstack([placed, own])
    return placed


def _free_of(tree: cKDTree, placed_radius: Array, tried: Array, radius: float) -> NDArray[np.bool_]:
    """Which trial grains touch none of the placed ones."""
    from scipy.spatial import cKDTree

    free = np.ones(len(tried), dtype=bool)
    pairs = cKDTree(tried).sparse_distance_matrix(
        tree, placed_radius.max() + radius, output_type="coo_matrix"
    )
    hit = pairs.data < placed_radius[pairs.col] + radius
    free[pairs.row[hit]] = False
    return free


def _free_of_each_other(points: Array, distance_m: float, keep_first: int) -> Array:
    """Drop, of points nearer than a distance, the later one."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(distance_m, output_type="ndarray")
    later = np.unique(pairs.max(axis=1)) if len(pairs) else np.empty(0, dtype=int)
    keep = np.ones(len(points), dtype=bool)
    keep[later] = False
    keep[:keep_first] = True
    return points[keep]
