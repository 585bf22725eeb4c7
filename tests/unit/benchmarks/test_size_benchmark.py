"""The benchmark of size: its beds, its pattern and the committed page."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.engines.beds import Bed
from benchmarks.engines.timing import median_interval
from benchmarks.size.__main__ import copied, page
from benchmarks.size.mesh import ellipsoid, round_pattern


@pytest.fixture
def bed() -> Bed:
    """Spheres on a lattice in a box of 20 by 20 by 8 mm."""
    axes = (np.arange(0.5e-3, 20e-3, 1e-3), np.arange(0.5e-3, 20e-3, 1e-3))
    places = np.meshgrid(*axes, np.arange(0.5e-3, 8e-3, 1e-3), indexing="ij")
    position = np.stack(places, axis=-1).reshape(-1, 3)
    still = np.zeros_like(position)
    return Bed(3, 0.02, 0.02, position, still, still, np.full(len(position), 0.5e-3))


def test_copies_fill_the_box_in_both_directions(bed: Bed) -> None:
    four = copied(bed, 2)
    assert (four.grains, four.width_m, four.depth_m) == (4 * bed.grains, 0.04, 0.04)
    places = {tuple(p) for p in np.round(four.position_m * 1e4).astype(int).tolist()}
    assert len(places) == four.grains
    for axis, size_m in ((0, 0.04), (1, 0.04), (2, 0.008)):
        assert four.position_m[:, axis].max() == pytest.approx(size_m - 0.5e-3)


def test_the_pattern_is_a_closed_surface() -> None:
    half = np.array([3.0, 2.0, 1.0])
    mesh = ellipsoid(np.ones(3), half, 5)
    assert len(mesh.facets) == 12 * 5**2
    np.testing.assert_allclose((((mesh.vertices_m - 1.0) / half) ** 2).sum(axis=1), 1.0)
    edges = np.sort(mesh.facets[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, times = np.unique(edges, axis=0, return_counts=True)
    assert (times == 2).all()


def test_no_sphere_cuts_the_pattern(bed: Bed) -> None:
    rest, mesh = round_pattern(bed, 12)
    assert 0.5 * bed.grains < rest.grains < bed.grains
    apart = np.linalg.norm(rest.position_m[:, None] - mesh.vertices_m[None], axis=2)
    assert (apart.min(axis=1) > rest.radius_m).all()
    middle = mesh.vertices_m.mean(axis=0)
    assert (np.linalg.norm(rest.position_m - middle, axis=1) > 1e-3).all()


def test_the_interval_of_a_median_goes_by_ranks() -> None:
    # Of 12 tosses of a coin, 2 or fewer are heads with 1.9 %: the interval holds 96.1 %.
    found = median_interval(list(range(12, 0, -1)))
    assert found == {"median": 6.5, "low": 3.0, "high": 10.0}
    assert math.isnan(median_interval([1.0, 2.0])["high"])


def test_what_is_not_measured_is_told() -> None:
    empty = page({"measured": {}, "turns": 5})
    assert "Not measured yet" in empty
    assert "## Memory" not in empty
