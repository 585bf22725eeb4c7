"""Density and loose sand at walls and solids beside a count of points that shares no code with it.

Grains lie at random and touch nothing. What counts is done by plain inequalities: which points of a
fine grid round a place lie in a grain, and which in a wall or in the solid.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from sandmould.analysis.density import apparent_density
from sandmould.analysis.loose_zones import BALL_GRAINS, LOOSE, find_loose_sand
from sandmould.geometry.geometry import Block, Scene, Wall
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from tests.unit.meshes import CORNERS, FACETS

WIDE, HIGH = 9.0, 11.0
"""Of the box, in median grains: one is 1 long here."""
BALL = 0.5 * BALL_GRAINS
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


@dataclass(frozen=True)
class Place:
    """A box of sand round one solid: cuboids, each turned about its middle."""

    scene: Scene
    cuboids: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]
    """Middle, half size and axes in rows."""

    def from_solid(self, points: np.ndarray) -> np.ndarray:
        """Distance of points from the solid, 0 within."""
        away = [
            np.linalg.norm(np.maximum(np.abs((points - middle) @ axes.T) - half, 0.0), axis=-1)
            for middle, half, axes in self.cuboids
        ]
        return np.min(away, axis=0)

    def from_surface(self, points: np.ndarray) -> np.ndarray:
        sides = np.min([points, WIDE - points], axis=0)[..., :-1].min(axis=-1)
        return np.minimum(np.minimum(sides, points[..., -1]), self.from_solid(points))


def walls(d: int) -> Iterator[Wall]:
    for axis in range(d):
        normal, zero = np.eye(d)[axis], np.zeros(d)
        names = (("left", "right"), ("front", "back"))[axis] if axis < d - 1 else ("floor", "")
        yield Wall(names[0], zero, normal)
        if names[1]:
            yield Wall(names[1], WIDE * normal, -normal)


def places() -> dict[str, Place]:
    middle, half = np.array([4.5, 4.5, 5.0]), np.array([2.0, 2.5, 0.8])
    block = Block("part", middle, half, np.eye(3))
    turned = TriangleMesh("part", middle + (2.0 * (CORNERS - 0.5) * half) @ TURN, FACETS)
    corners = [(3.0, 2.0), (4.0, 2.0), (4.0, 5.0), (7.0, 5.0), (7.0, 6.0), (3.0, 6.0)]
    legs = (([3.5, 4.0], [0.5, 2.0]), ([5.0, 5.5], [2.0, 0.5]))
    return {
        "block": Place(Scene(3, (*walls(3),), (block,), ()), ((middle, half, np.eye(3)),)),
        "turned": Place(
            Scene(3, (*walls(3),), (), (), meshes=(turned,)), ((middle, half, TURN),)
        ),
        "l": Place(
            Scene(2, (*walls(2),), (), (), outlines=(Outline("part", np.array(corners)),)),
            tuple((np.array(a), np.array(b), np.eye(2)) for a, b in legs),
        ),
    }  # fmt: skip


def scattered(place: Place) -> tuple[np.ndarray, np.ndarray]:
    """Grains of two sizes laid down at random, the larger first, where there is room."""
    d, draw = place.scene.dimension, np.random.default_rng(3)
    size = np.array([*[WIDE] * (d - 1), HIGH])
    centres, radii = np.zeros((0, d)), np.zeros(0)
    for radius in (0.55, 0.45):
        for point in draw.uniform(0.0, size, (12_000, d)):
            if place.from_surface(point) < radius or point[-1] > HIGH - radius:
                continue
            if (np.linalg.norm(centres - point, axis=1) >= radii + radius).all():
                centres, radii = np.vstack([centres, point]), np.append(radii, radius)
    return centres, radii


def counted(
    place: Place, at: np.ndarray, reach: float, centres: np.ndarray, radii: np.ndarray, cells: int
) -> np.ndarray:
    """Sand over free space in a ball round each point, by points of a grid."""
    d = place.scene.dimension
    axis = (np.arange(2 * cells) + 0.5) / cells - 1.0
    grid = reach * np.stack(np.meshgrid(*[axis] * d, indexing="ij"), axis=-1).reshape(-1, d)
    grid = grid[np.linalg.norm(grid, axis=1) < reach]
    found = []
    for point in at:
        near = np.linalg.norm(centres - point, axis=1) < reach + radii
        points, sand = grid + point, 0
        for centre, radius in zip(centres[near], radii[near], strict=True):
            sand += int((((points - centre) ** 2).sum(axis=1) < radius**2).sum())
        found.append(sand / (place.from_surface(points) > 0.0).sum())
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["block", "turned", "l"])
def test_density_and_loose_sand_are_those_of_a_count(name: str) -> None:
    place = places()[name]
    centres, radii = scattered(place)
    cells = 80 if place.scene.dimension == 2 else 24
    deep = np.flatnonzero(centres[:, -1] < HIGH - 2.0)
    cut = deep[place.from_surface(centres[deep]) < 0.7][:20]
    dense = apparent_density(centres, radii, 1.0, place.scene, 1.1)
    by_count = counted(place, centres[cut], 1.1, centres, radii, cells)
    np.testing.assert_allclose(dense.corrected_kg_m3[cut], by_count, rtol=0.02)

    loose = find_loose_sand(centres, radii, place.scene, 1.0)
    field = loose.field
    index = np.argwhere(np.isfinite(field.share))
    points = field.low_m + field.cell_m * index
    # all places by a coarser count: single ones are off by more, the shares of all are not
    local = counted(place, points, BALL, centres, radii, cells // 3)
    shell = np.minimum(place.from_surface(points), BALL) // field.cell_m
    usual = np.array([np.median(local[shell == number]) for number in shell])
    assert loose.loose_fraction == pytest.approx((local < LOOSE * usual).mean(), abs=0.02)
    told = field.share[tuple(index.T)]
    middling = usual > 0.1
    np.testing.assert_allclose(np.median(told[middling] * usual[middling] / local[middling]), 1.0,
                               rtol=0.02)  # fmt: skip
    assert 0.05 < loose.loose_fraction < 0.6
    assert len(cut) > 10
