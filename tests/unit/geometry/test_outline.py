"""Outlines of 2D: distances against winding numbers and samples, what is refused, measures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandmould.analysis.free_space import free_measure_between, free_part
from sandmould.analysis.intersections import disc_outline_m2, disc_polygon_m2
from sandmould.geometry.geometry import Block
from sandmould.geometry.outline import Outline, outline_fault, signed_area_m2
from sandmould.scenario.box import Box, Polygon, build_scene
from sandmould.scenario.placement import predicted_bed_height_m
from sandmould.scenario.scenario import Scenario

NOTCHED = np.array([[0, 0], [6, 0], [6, 4], [4, 4], [4, 1], [2, 1], [2, 4], [0, 4]]) * 1e-2
"""A U open at the top: legs 20 mm wide and 40 mm high, the notch 20 mm wide and 30 mm deep."""
RNG = np.random.default_rng(3)


def star(radii: list[float]) -> np.ndarray:
    """Polygon with a vertex at each of equal angles: it never meets itself."""
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    return np.array(radii)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def winding_number(point: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Turns of the outline round each point."""
    a = vertices - point[:, None]
    b = np.roll(a, -1, axis=1)
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.arctan2(cross, np.sum(a * b, axis=2)).sum(axis=1) / (2 * np.pi)


def sampled_distance(point: np.ndarray, vertices: np.ndarray, number: int = 4001) -> np.ndarray:
    """Distance from the nearest of many places on the edges."""
    share = np.linspace(0.0, 1.0, number)[:, None, None]
    places = (vertices + share * (np.roll(vertices, -1, axis=0) - vertices)).reshape(-1, 2)
    return np.array([np.linalg.norm(places - p, axis=1).min() for p in point])


@given(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=12))
@settings(max_examples=40, deadline=None)
def test_distance_against_winding_number_and_samples(radii: list[float]) -> None:
    vertices, rng = star(radii), np.random.default_rng(4)
    assert outline_fault(vertices) is None
    point = rng.uniform(-1.2, 1.2, (60, 2))
    found = Outline("star", vertices).distance_m(point)
    np.testing.assert_allclose(np.abs(found), sampled_distance(point, vertices), atol=1e-3)
    np.testing.assert_array_equal(found < 0, np.abs(winding_number(point, vertices)) > 0.5)


def test_distance_is_exact_within_a_reach_and_never_too_large_beyond() -> None:
    outline, point = Outline("u", NOTCHED), np.random.default_rng(5).uniform(-0.1, 0.15, (400, 2))
    exact, found = outline.distance_m(point), outline.distance_m(point, 0.02)
    near = exact <= 0.02
    np.testing.assert_array_equal(found[near], exact[near])
    assert (found[~near] > 0.02).all()
    assert (found <= exact + 1e-15).all()  # round-off: the box may touch at the nearest edge
    assert (found < exact - 1e-3).any()


def test_distance_in_a_notch() -> None:
    outline = Outline("u", NOTCHED)
    point = np.array([[0.03, 0.03], [0.03, 0.015], [0.01, 0.03], [0.03, 0.005], [-0.03, -0.04]])
    np.testing.assert_allclose(
        outline.distance_m(point), [0.01, 0.005, -0.01, -0.005, 0.05], atol=1e-15
    )
    assert outline.measure == pytest.approx(0.06 * 0.04 - 0.02 * 0.03)
    assert len(outline.distance_m(np.zeros((0, 2)))) == 0


@pytest.mark.parametrize(
    ("vertices", "fault"),
    [
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "cross"),
        ([[0, 0], [2, 0], [2, 2], [1, 0], [0, 2]], "touch"),
        ([[0, 0], [2, 0], [1, 0], [1, 1]], "touch"),
        ([[0, 0], [1, 0], [2, 1e-10]], "area"),
        ([[0, 0], [1, 0], [2, 0]], "touch"),
        ([[0, 0], [1, 0], [1, 0], [0, 1]], "repeats"),
        ([[0, 0], [1, 0], [0, 1], [0, 0]], "repeats"),
    ],
)
def test_faults(vertices: list[list[float]], fault: str) -> None:
    assert fault in (outline_fault(np.array(vertices, dtype=float)) or "")


def test_scene_turns_polygons_counter_clockwise_and_keeps_clear_of_them() -> None:
    turned = Polygon(kind="polygon", vertices_m=tuple(map(tuple, NOTCHED[::-1])))
    scene = build_scene(Box(width_m=0.1, height_m=0.1), (turned,), 2)
    assert signed_area_m2(scene.outlines[0].vertices_m) > 0
    clearance = scene.clearance_m(np.array([[0.03, 0.03], [0.01, 0.02], [0.095, 0.05]]))
    np.testing.assert_allclose(clearance, [0.01, -0.01, 0.005], atol=1e-15)


@given(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=10))
@settings(max_examples=25, deadline=None)
def test_disc_and_outline_against_the_sum_of_its_triangles(radii: list[float]) -> None:
    vertices, rng = star(radii), np.random.default_rng(4)
    centre, radius = rng.uniform(-1.2, 1.2, (50, 2)), rng.uniform(0.05, 1.5, 50)
    fan = [
        np.array([[0.0, 0.0], a, b])
        for a, b in zip(vertices, np.roll(vertices, -1, 0), strict=True)
    ]
    expected = sum(disc_polygon_m2(centre, radius, triangle) for triangle in fan)
    for polygon in (vertices, vertices[::-1]):
        found = disc_outline_m2(centre, radius, polygon)
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_free_space_round_an_outline_is_that_round_its_blocks() -> None:
    box = Box(width_m=0.1, height_m=0.1)
    lies = tuple((x + 0.02, y + 0.01) for x, y in NOTCHED)
    whole = build_scene(box, (Polygon(kind="polygon", vertices_m=lies),), 2)
    parts = [[[0.05, 0.015], [0.03, 0.005]], *([[x, 0.035], [0.01, 0.015]] for x in (0.03, 0.07))]
    blocks = tuple(Block("b", np.array(c), np.array(h), np.eye(2)) for c, h in parts)
    cut = type(whole)(2, whole.walls, blocks, ())
    centre, radius = RNG.uniform(0, 0.1, (300, 2)), RNG.uniform(0.001, 0.03, 300)
    np.testing.assert_allclose(
        free_part(centre, radius, whole), free_part(centre, radius, cut), atol=1e-15
    )
    edges = np.array([0.0, 0.013, 0.02, 0.031, 0.08])
    np.testing.assert_allclose(
        free_measure_between(whole, edges), free_measure_between(cut, edges), atol=1e-15
    )


def test_bed_is_predicted_over_the_area_of_an_outline() -> None:
    polygon = {"kind": "polygon", "vertices_m": [[x + 0.02, y] for x, y in NOTCHED.tolist()]}
    box = {"width_m": 0.1, "height_m": 0.2}
    bare = Scenario.model_validate({"box": box})
    full = Scenario.model_validate({"box": box, "obstacles": [polygon]})
    risen = predicted_bed_height_m(full, [500]) - predicted_bed_height_m(bare, [500])
    assert risen == pytest.approx((0.06 * 0.04 - 0.02 * 0.03) / 0.1)


def test_of_an_outline_through_the_wall_only_the_part_inside_counts() -> None:
    scene = build_scene(Box(width_m=0.1, height_m=0.1), (), 2)
    # the floor parts the two legs of the U
    sunk = Outline("u", NOTCHED + np.array([0.02, -0.02]))
    scene = type(scene)(2, scene.walls, (), (), (sunk,))
    (area,) = free_measure_between(scene, np.array([0.0, 0.1]))
    assert area == pytest.approx(0.01 - 2 * 0.02 * 0.02)
    parts = disc_outline_m2(np.array([[0.05, 0.0]]), np.array([0.2]), sunk.vertices_m)
    assert parts[0] == pytest.approx(sunk.measure)
