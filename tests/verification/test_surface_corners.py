"""Grains at edges and corners: one contact for each side, and loads that the vertices take."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.dem.surfaces import Surfaces
from tests.verification.probe import RADIUS_M, SMOOTH, Probe


def block(d: int, size: float) -> Surfaces:
    """A square or a cube about the origin, each side of several facets."""
    surfaces = Surfaces(d)
    if d == 2:
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * size / 2
        surfaces.add_facets("block", corners, [(0, 1), (1, 2), (2, 3), (3, 0)])
        return surfaces
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size / 2
    quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    triangles = [t for a, b, c, e in quads for t in ((a, b, c), (a, c, e))]
    surfaces.add_facets("block", corners, triangles)
    return surfaces


@pytest.mark.parametrize("d", [2, 3])
def test_contact_goes_smoothly_round_a_convex_edge(d: int) -> None:
    surfaces = block(d, 4e-3)
    probe = Probe(surfaces, SMOOTH)
    h, reach = 2e-3, 0.95 * RADIUS_M
    # Along the top, round the edge by a quarter of a turn, down the side, at one distance.
    flat = [(x, h + reach, 0.0) for x in np.linspace(1e-3, h, 200)]
    edge = [
        (h + reach * math.sin(a), h + reach * math.cos(a), a)
        for a in np.linspace(0, math.pi / 2, 400)
    ]
    side = [(h + reach, y, math.pi / 2) for y in np.linspace(h, 1e-3, 200)]
    for x, y, angle in [*flat, *edge, *side]:
        center = np.zeros(d)
        center[0], center[-1] = x, y
        t = probe.touch(center, np.zeros(d), np.zeros(1 if d == 2 else 3))
        expected = np.zeros(d)
        push = SMOOTH.k_n * 0.05 * RADIUS_M
        expected[0], expected[-1] = push * math.sin(angle), push * math.cos(angle)
        assert t.contacts == 1
        np.testing.assert_allclose(t.force, expected, atol=1e-12 * push)


def test_cube_is_touched_once_from_every_side() -> None:
    h, rng = 2e-3, np.random.default_rng(5)
    probe = Probe(block(3, 2 * h), SMOOTH)
    for _ in range(2000):
        # A point at 0.97 radii from the cube: any point outside, drawn towards its nearest one.
        outside = rng.normal(size=3) * 2 * h
        nearest = np.clip(outside, -h, h)
        if np.array_equal(outside, nearest):
            continue
        n = (outside - nearest) / np.linalg.norm(outside - nearest)
        t = probe.touch(nearest + 0.97 * RADIUS_M * n, np.zeros(3), np.zeros(3))
        assert t.contacts == 1
        push = SMOOTH.k_n * 0.03 * RADIUS_M
        np.testing.assert_allclose(t.force, push * n, atol=1e-9 * push)


@pytest.mark.parametrize("angle_deg", [20.0, 45.0, 90.0, 130.0])
def test_concave_corner_has_two_contacts(angle_deg: float) -> None:
    surfaces = Surfaces(2)
    a = math.radians(angle_deg)
    rise = np.array([math.cos(a), math.sin(a)])
    corners = np.array([(-5e-3, 0.0), (0.0, 0.0), 5e-3 * rise])
    surfaces.add_facets("corner", corners, [(0, 1), (1, 2)])
    n = np.array([[0.0, 1.0], [-math.sin(a), math.cos(a)]])
    # Into the first side by 1 % of the radius, into the second by 2 %.
    center = np.linalg.solve(n, RADIUS_M * np.array([0.99, 0.98]))
    t = Probe(surfaces, SMOOTH).touch(center, np.zeros(2), np.zeros(1))
    assert t.contacts == 2
    expected = SMOOTH.k_n * RADIUS_M * (0.01 * n[0] + 0.02 * n[1])
    np.testing.assert_allclose(t.force, expected, rtol=1e-11)


def test_concave_corner_of_three_sides_has_three_contacts() -> None:
    surfaces = block(3, 4e-3)
    depth = np.array([0.01, 0.02, 0.015]) * RADIUS_M
    t = Probe(surfaces, SMOOTH).touch(2e-3 - RADIUS_M + depth, np.zeros(3), np.zeros(3))
    assert t.contacts == 3
    np.testing.assert_allclose(t.force, -SMOOTH.k_n * depth, rtol=1e-11)


@pytest.mark.parametrize("d", [2, 3])
def test_loads_on_vertices_do_the_work_of_the_contacts(d: int) -> None:
    surfaces = block(d, 4e-3)
    rng = np.random.default_rng(7)
    for _ in range(100):
        probe = Probe(surfaces)
        x = rng.uniform(-1, 1, d)
        x *= (2e-3 + 0.98 * RADIUS_M) / np.abs(x).max()
        t = probe.touch(x, rng.normal(size=d), rng.normal(size=1 if d == 2 else 3))
        if t.contacts == 0:
            continue
        size = float(np.linalg.norm(t.force))
        np.testing.assert_allclose(t.loads.sum(axis=0), -t.force, atol=1e-12 * size)
        on_point = np.clip(x, -2e-3, 2e-3)
        # One contact: sum x_j (x) f_j = p (x) f.
        first = np.einsum("ni,nj->ij", surfaces.arrays.vertices, t.loads)
        np.testing.assert_allclose(first, -np.outer(on_point, t.force), atol=1e-12 * size * 2e-3)
        np.testing.assert_allclose(surfaces.forces(t.loads)["block"], -t.force, atol=1e-12 * size)
