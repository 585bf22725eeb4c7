"""Surfaces of the reference solver: building, motion, memory, and the search for candidates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sandmould.compiled import njit
from sandmould.dem.broad_phase import find_candidates
from sandmould.dem.nearest_point import nearest
from sandmould.dem.surfaces import Surfaces, farthest_moved, move_vertices
from sandmould.dem.vectors import OPTIONS, dim_of, load, plus
from sandmould.dem.wall_history import carry_history, new_history

Array = NDArray[np.float64]
TRIANGLE = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
RING = [(0.0, 0.1), (0.3, 0.1), (0.3, 0.12), (0.0, 0.12)]


@njit(**OPTIONS)
def every_pair(dim: Any, position: Any, radius: Any, skin: float, arrays: Any, shift: Any) -> Any:
    """Compare every grain with every part."""
    found = []
    for i in range(len(radius)):
        x = plus(load(dim, position, i), -1.0, shift)
        for p in range(len(arrays.corner)):
            distance = nearest(
                dim, arrays.vertices, arrays.planes[0], arrays.shape, arrays.corner, p, x, 1e9
            )[0]
            if distance <= radius[i] + skin:
                found.append((i, p))
    return found


@pytest.mark.parametrize("columns", ["own", "three"])
@pytest.mark.parametrize("d", [2, 3])
def test_candidates_are_those_of_comparing_everything(d: int, columns: str) -> None:
    rng = np.random.default_rng(1)
    for _ in range(40):
        surfaces = Surfaces(d)
        surfaces.add_plane("floor", np.zeros(d), np.eye(d)[-1])
        if d == 3:
            surfaces.add_revolved("tube", (0.5, 0.5, 0.5), rng.normal(size=3), RING, closed=True)
        size = 10 ** rng.uniform(-2, 0)
        middles = rng.uniform(0, 1, (rng.integers(1, 60), 1, d))
        vertices = (middles + rng.normal(size=(len(middles), d, d)) * size).reshape(-1, d)
        surfaces.add_facets("pieces", vertices, np.arange(len(vertices)).reshape(-1, d))
        n = 300
        position = rng.uniform(-0.2, 1.2, (n, d if columns == "own" else 3))
        radius = rng.uniform(0.003, 0.02, n)
        shift = tuple(rng.normal(size=d) * 0.05)
        dim = dim_of(d)
        c = find_candidates(dim, position, radius, 0.004, surfaces.arrays, shift)
        found = [
            (int(i), int(p))
            for i, a, b in zip(c.rows, c.start[:-1], c.start[1:], strict=True)
            for p in c.part[a:b]
        ]
        assert found == every_pair(dim, position, radius, 0.004, surfaces.arrays, shift)
        assert found


@pytest.mark.parametrize("d", [2, 3])
def test_there_are_no_candidates_without_grains_or_surfaces(d: int) -> None:
    surfaces = Surfaces(d)
    dim, still = dim_of(d), (0.0,) * d
    grains = (np.zeros((1, d)), np.ones(1))
    nothing = find_candidates(dim, *grains, 0.1, surfaces.arrays, still)
    assert len(nothing.rows) == 0
    surfaces.add_facets("one", np.eye(d), [list(range(d))])
    assert len(find_candidates(dim, *grains, 0.1, surfaces.arrays, still).rows) == 1
    none = find_candidates(dim, np.zeros((0, d)), np.zeros(0), 0.1, surfaces.arrays, still)
    assert len(none.rows) == 0
    lost = find_candidates(dim, np.full((1, d), np.nan), np.ones(1), 0.1, surfaces.arrays, still)
    assert len(lost.rows) == 0


def test_parts_are_numbered_by_kind_and_vertices_by_surface() -> None:
    surfaces = Surfaces(3)
    surfaces.add_facets("mesh", TRIANGLE, [(0, 1, 2)])
    surfaces.add_revolved("tube", (0, 0, 1), (0, 0, 2), [(0, 0), (0, 1), (2, 1), (2, 0)], True)
    surfaces.add_plane("floor", (0, 0, -1), (0, 0, 5))
    arrays = surfaces.arrays
    assert surfaces.names == ("mesh", "tube", "floor")
    assert arrays.planes.tolist() == [1]
    # The piece on the axis has no surface: three lines are left.
    assert len(arrays.shape) == 4
    assert arrays.corner.tolist() == [[4] * 3, [3] * 3, [3] * 3, [3] * 3, [0, 1, 2]]
    np.testing.assert_array_equal(arrays.shape[0, :3], [0, 0, 1])
    loads = np.arange(15.0).reshape(5, 3)
    forces = surfaces.forces(loads)
    np.testing.assert_array_equal(forces["mesh"], loads[:3].sum(axis=0))
    np.testing.assert_array_equal(forces["floor"], loads[4])


def three_surfaces(names: tuple[str, ...]) -> Surfaces:
    surfaces = Surfaces(3)
    for name in names:
        if name == "mesh":
            surfaces.add_facets(name, TRIANGLE, [(0, 1, 2)])
        elif name == "tube":
            surfaces.add_revolved(name, (0, 0, 1), (0, 0, 2), [(0, 1), (2, 1), (2, 0)], False)
        else:
            surfaces.add_plane(name, (0, 0, -1), (0, 0, 5))
    return surfaces


@pytest.mark.parametrize("gone", ["mesh", "tube", "floor", "lid"])
def test_what_is_left_after_a_removal_is_as_if_it_had_never_been_there(gone: str) -> None:
    names = ("mesh", "tube", "lid", "floor")
    surfaces = three_surfaces(names)
    surfaces.remove(gone)
    without = three_surfaces(tuple(name for name in names if name != gone))
    assert surfaces.names == without.names
    for left, never in zip(surfaces.arrays, without.arrays, strict=True):
        np.testing.assert_array_equal(left, never)
    surfaces.add_plane("last", (0, 0, 0), (0, 0, 1))
    assert surfaces.vertices_of("last").start == len(without.arrays.vertices)


@pytest.mark.parametrize(
    ("add", "message"),
    [
        (lambda s: s.add_facets("a", TRIANGLE, [(0, 1, 3)]), "names a vertex that is not there"),
        (lambda s: s.add_facets("a", TRIANGLE, [(0, 1, 1)]), "facet 0 of surface a has no extent"),
        (lambda s: s.add_facets("a", TRIANGLE, [(0, 1)]), r"shape \(1, 2\), valid: \(n, 3\)"),
        (lambda s: s.add_facets("a", [(0.0, 1.0)], [(0, 0, 0)]), r"\(1, 2\), valid is \(n, 3\)"),
        (lambda s: s.add_plane("a", (0, 0, np.inf), (0, 0, 1)), "point of surface a .* not finite"),
        (lambda s: s.add_plane("a", (0, 0, 0), (0, 0, 0)), "normal of surface a has no direction"),
        (lambda s: s.add_plane("there", (0, 0, 0), (0, 0, 1)), "surface there is there twice"),
        (lambda s: s.add_revolved("a", (0, 0, 0), (0, 0, 1), [(0, -1), (1, 1)], False), "negative"),
        (lambda s: s.add_revolved("a", (0, 0, 0), (0, 0, 1), [(0, 1), (0, 1)], False), "no length"),
        (lambda s: s.set_motion("there", [(0, 0, 0)], 1.0, 0.1), "1 vertices, not 3"),
    ],
)
def test_bad_surfaces_are_refused_in_one_sentence(add: Any, message: str) -> None:
    surfaces = Surfaces(3)
    surfaces.add_facets("there", TRIANGLE, [(0, 1, 2)])
    with pytest.raises(ValueError, match=message):
        add(surfaces)


def test_surface_of_revolution_is_refused_in_2d() -> None:
    with pytest.raises(ValueError, match="valid in 3D alone"):
        Surfaces(2).add_revolved("tube", (0, 0), (1, 0), RING, closed=True)


def test_vertices_reach_their_target_and_stay() -> None:
    surfaces = Surfaces(2)
    surfaces.add_facets("line", [(0, 0), (1, 0)], [(0, 1)])
    surfaces.add_facets("belt", [(0, 5), (1, 5)], [(0, 1)])
    surfaces.arrays.vertex_velocity[2:] = (3.0, 0.0)
    arrays, before = surfaces.arrays, surfaces.arrays.vertices.copy()
    surfaces.set_motion("line", [(0, 0.3), (1, 0.6)], window_s=1.0, step_s=0.25)
    for _ in range(4):
        move_vertices(arrays, 0.25)
    # The velocity is felt in the contacts of the last step.
    np.testing.assert_allclose(arrays.vertex_velocity[:2], [(0, 0.3), (0, 0.6)])
    np.testing.assert_allclose(arrays.vertices[:2], [(0, 0.3), (1, 0.6)], rtol=1e-15)
    assert farthest_moved(arrays, before) == pytest.approx(0.6)
    for _ in range(2):
        move_vertices(arrays, 0.25)
    np.testing.assert_allclose(arrays.vertices[:2], [(0, 0.3), (1, 0.6)], rtol=1e-15)
    np.testing.assert_array_equal(arrays.vertex_velocity, [(0, 0), (0, 0), (3, 0), (3, 0)])
    np.testing.assert_array_equal(arrays.vertices[2:], before[2:])


@pytest.mark.parametrize("d", [2, 3])
def test_memory_follows_the_grain_not_the_row(d: int) -> None:
    rng, dim = np.random.default_rng(3), dim_of(d)
    ids = rng.permutation(40)[:10]
    old = new_history(dim, 10)
    old.used[:] = rng.integers(0, 2 * d + 1, 10)
    for array in (old.normal, old.friction, old.rolling):
        array[:] = rng.normal(size=array.shape)
    new_ids = np.concatenate([ids[[7, 2, 9, 0]], [39_000, 41]])
    parts = np.array([1, 2, 1, 9, 1, 2])
    start = np.concatenate([[0], np.cumsum(parts)])
    new = carry_history(dim, ids, old, new_ids, start)
    used = [*old.used[[7, 2, 9, 0]], 0, 0]
    assert new.used.tolist() == used
    room = [
        max(1, u) if p == 1 else min(2 * d, p + max(p, u)) for p, u in zip(parts, used, strict=True)
    ]
    assert np.diff(new.first_slot).tolist() == room
    assert len(new.normal) == sum(room)
    for row, was in enumerate((7, 2, 9, 0)):
        for a, b in ((new.normal, old.normal), (new.friction, old.friction)):
            np.testing.assert_array_equal(
                a[new.first_slot[row] :][: used[row]], b[old.first_slot[was] :][: used[row]]
            )
    empty = carry_history(dim, ids[:0], new_history(dim, 0), new_ids, start)
    assert not empty.used.any()
