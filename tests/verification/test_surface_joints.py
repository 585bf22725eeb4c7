"""Grains on floors and round walls of many facets: no bump, no double contact, no lost friction."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.dem.surfaces import Surfaces, move_vertices
from tests.verification.probe import LAW, MASS_KG, RADIUS_M, SMOOTH, STEP_S, Array, Probe


def turn(d: int, angle: float) -> Array:
    """Some rotation."""
    c, s = math.cos(angle), math.sin(angle)
    flat = np.array([[c, -s], [s, c]])
    if d == 2:
        return flat
    about_z, about_x = np.eye(3), np.eye(3)
    about_z[:2, :2], about_x[1:, 1:] = flat, flat
    return about_x @ about_z


def floors(d: int, tilt: float = 0.0) -> tuple[Surfaces, Surfaces, Array]:
    """One plane, the same plane as uneven facets of two surfaces, and the axes of both."""
    axes = turn(d, tilt)
    plane = Surfaces(d)
    plane.add_plane("floor", np.zeros(d), axes[:, -1])
    pieces = Surfaces(d)
    grid = np.array([-4e-3, -2e-3, -1.5e-3, 0.0, 0.25e-3, 1e-3, 4e-3])
    n = len(grid)
    if d == 2:
        points = np.column_stack([grid, np.zeros(n)]) @ axes.T
        facets = np.column_stack([np.arange(n - 1), np.arange(1, n)])
        facets[::2] = facets[::2, ::-1]
    else:
        first, second = np.meshgrid(grid, grid, indexing="ij")
        flat = np.column_stack([first.ravel(), second.ravel(), np.zeros(n * n)])
        points = flat @ axes.T
        at = np.arange(n * n).reshape(n, n)
        lower = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:]], axis=-1).reshape(-1, 3)
        upper = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:]], axis=-1).reshape(-1, 3)
        facets = np.concatenate([lower, upper])
    # A joint of two surfaces is as good as one of facets.
    pieces.add_facets("one", points, facets[::2])
    pieces.add_facets("other", points, facets[1::2])
    return plane, pieces, axes


DIRECTIONS = [0.0, 0.3, math.pi / 4, math.pi / 2, 2.0]


@pytest.mark.parametrize("tilt", [0.0, 0.7])
@pytest.mark.parametrize(
    ("d", "direction"), [(2, 0.0), (2, math.pi), *((3, a) for a in DIRECTIONS)]
)
def test_joints_of_a_flat_floor_are_not_felt(d: int, direction: float, tilt: float) -> None:
    plane, pieces, axes = floors(d, tilt)
    one, many = Probe(plane), Probe(pieces)
    along = np.zeros(d)
    along[0] = math.cos(direction)
    if d == 3:
        along[1] = math.sin(direction)
    spin = np.array([30.0]) if d == 2 else np.array([30.0, -20.0, 10.0])
    worst, scale = 0.0, 0.35 * LAW.k_n * 0.02 * RADIUS_M
    place = -2.5e-3 * along
    for step in range(2000):
        # To and fro, so that friction turns round; in the middle it passes exactly over vertices.
        speed = 4.0 * math.sin(step / 2000 * 3 * math.pi) * along
        place = place + STEP_S * speed
        if step == 1000:
            place = np.zeros(d)
        center = place.copy()
        center[-1] = RADIUS_M * 0.98
        a = one.touch(axes @ center, axes @ speed, spin)
        b = many.touch(axes @ center, axes @ speed, spin)
        assert b.contacts == a.contacts == 1
        worst = max(worst, float(np.abs(a.force - b.force).max()) / scale)
        worst = max(worst, float(np.abs(a.moment - b.moment).max()) / scale / RADIUS_M)
    assert worst < 1e-12


@pytest.mark.parametrize("d", [2, 3])
def test_grain_dragged_by_a_constant_force_moves_alike_on_plane_and_facets(d: int) -> None:
    plane, pieces, _ = floors(d)
    tracks = []
    for surfaces in (plane, pieces):
        probe = Probe(surfaces)
        x, v = np.zeros(d), np.zeros(d)
        x[0], x[-1] = -2.5e-3, RADIUS_M
        w = np.zeros(1 if d == 2 else 3)
        pull = np.zeros(d)
        pull[0], pull[-1] = 0.05, -0.1
        track = []
        for _ in range(2000):
            t = probe.touch(x, v, w)
            v = v + (t.force + pull) / MASS_KG * STEP_S
            w = w + t.moment / (0.4 * MASS_KG * RADIUS_M**2) * STEP_S
            x = x + v * STEP_S
            track.append([*x, *v * 1e-3, *w * 1e-6])
        tracks.append(track)
    assert tracks[0][-1][0] > 3e-3  # it has crossed most joints
    np.testing.assert_allclose(tracks[1], tracks[0], rtol=0, atol=1e-12 * 4e-3)


def test_obtuse_joints_of_a_round_wall_count_once_and_keep_friction() -> None:
    # A bore of 72 sides, 5 degrees each: a grain slides round the inside, always against one.
    surfaces = Surfaces(2)
    angles = np.radians(np.arange(72) * 5.0)
    corners = 0.01 * np.column_stack([np.cos(angles), np.sin(angles)])
    surfaces.add_facets(
        "bore", corners, np.column_stack([np.arange(72), np.roll(np.arange(72), -1)])
    )
    probe = Probe(surfaces)
    orbit = 0.01 - 0.98 * RADIUS_M
    ratios = []
    for a in np.linspace(0.0, 1.0, 4000):
        out = np.array([math.cos(a), math.sin(a)])
        around = np.array([-out[1], out[0]])
        t = probe.touch(orbit * out, 0.1 * around, np.zeros(1))
        assert t.contacts == 1
        ratios.append(-float(t.force @ around) / -float(t.force @ out))
    # Sliding all the way: friction never starts anew; normals turn by 2.5 degrees about the exact.
    assert min(ratios[200:]) > math.tan(math.atan(0.35) - math.radians(2.6))
    assert max(ratios[200:]) < math.tan(math.atan(0.35) + math.radians(2.6))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_facets_finer_than_the_contact_make_one_contact(side: float) -> None:
    # Some 150 edges lie within the grain, more than it keeps; it touches a ring from either side.
    count, ring = 3000, 5e-3
    angles = 2 * math.pi * np.arange(count) / count
    surfaces = Surfaces(2)
    corners = ring * np.column_stack([np.cos(angles), np.sin(angles)])
    first = np.arange(count)
    surfaces.add_facets("ring", corners, np.column_stack([first, np.roll(first, -1)]))
    probe = Probe(surfaces, SMOOTH)
    push = SMOOTH.k_n * 0.05 * RADIUS_M
    for a in np.linspace(0.0, 0.1, 500):
        out = np.array([math.cos(a), math.sin(a)])
        t = probe.touch((ring + side * 0.95 * RADIUS_M) * out, np.zeros(2), np.zeros(1))
        assert t.contacts == 1
        np.testing.assert_allclose(t.force, side * push * out, atol=4e-3 * push)


def test_revolved_tube_is_the_limit_of_many_facets() -> None:
    profile = [(0.0, 4e-3), (10e-3, 4e-3), (10e-3, 5e-3), (0.0, 5e-3)]
    axis = np.array([0.3, 0.5, 0.8])
    exact = Surfaces(3)
    exact.add_revolved("tube", (1e-3, 0, 0), axis, profile, closed=True)
    unit = axis / np.linalg.norm(axis)
    first = np.cross(unit, [1.0, 0, 0])
    first /= np.linalg.norm(first)
    second = np.cross(unit, first)
    rng = np.random.default_rng(2)
    places = []
    for _ in range(100):
        a, kind = rng.uniform(0, 2 * math.pi), rng.integers(4)
        axial, radial = {
            0: (rng.uniform(0, 10e-3), 4e-3 - 0.97 * RADIUS_M),
            1: (rng.uniform(0, 10e-3), 5e-3 + 0.97 * RADIUS_M),
            2: (10e-3 + 0.97 * RADIUS_M, rng.uniform(4e-3, 5e-3)),
            3: (-0.6 * RADIUS_M, 5e-3 + 0.75 * RADIUS_M),
        }[int(kind)]
        out = math.cos(a) * first + math.sin(a) * second
        places.append(np.array([1e-3, 0, 0]) + axial * unit + radial * out)
    errors = []
    for count in (48, 96, 192):
        angles = 2 * math.pi * np.arange(count) / count
        out = np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second)
        rings = [np.array([1e-3, 0, 0]) + ax * unit + rad * out for ax, rad in profile]
        at = np.arange(4 * count).reshape(4, count)
        triangles = []
        for k in range(4):
            p, q = at[k], at[(k + 1) % 4]
            p_next, q_next = np.roll(p, -1), np.roll(q, -1)
            triangles += [np.column_stack([p, q, q_next]), np.column_stack([p, q_next, p_next])]
        facets = Surfaces(3)
        facets.add_facets("tube", np.concatenate(rings), np.concatenate(triangles))
        one, many = Probe(exact, SMOOTH), Probe(facets, SMOOTH)
        worst = 0.0
        for x in places:
            a_touch = one.touch(x, np.zeros(3), np.zeros(3))
            b_touch = many.touch(x, np.zeros(3), np.zeros(3))
            assert a_touch.contacts == b_touch.contacts == 1
            worst = max(worst, float(np.linalg.norm(a_touch.force - b_touch.force)))
        errors.append(worst / (SMOOTH.k_n * 0.03 * RADIUS_M))
    assert errors[-1] < 0.05
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < 0.6 * errors[1]


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("moved_by", ["belt", "vertices", "box"])
def test_moving_floor_drags_a_grain_to_its_speed_at_mu_g(d: int, moved_by: str) -> None:
    surfaces = Surfaces(d)
    low, high = -0.1, 0.1
    if d == 2:
        surfaces.add_facets("floor", [(low, 0), (0, 0), (high, 0)], [(0, 1), (1, 2)])
    else:
        ring = [(low, low, 0), (high, low, 0), (high, high, 0), (low, high, 0)]
        surfaces.add_facets("floor", ring, [(0, 1, 2), (0, 2, 3)])
    belt = np.zeros(d)
    belt[0] = 0.02
    if moved_by == "belt":
        surfaces.arrays.vertex_velocity[:] = belt
    elif moved_by == "vertices":
        target = surfaces.arrays.vertices + belt * 1.0
        surfaces.set_motion("floor", target, 1.0, STEP_S)
    probe = Probe(surfaces, LAW._replace(rolling_arm=0.0))
    weight = np.zeros(d)
    weight[-1] = -9.81
    x, v = np.zeros(d), np.zeros(d)
    x[-1] = RADIUS_M - 9.81 * MASS_KG / LAW.k_n
    speeds = []
    for _ in range(8000):
        move_vertices(surfaces.arrays, STEP_S)
        # The spin is held, as by a second wall: a free grain would roll instead.
        t = probe.touch(x, v, np.zeros(1 if d == 2 else 3), belt if moved_by == "box" else None)
        v = v + (t.force / MASS_KG + weight) * STEP_S
        x = x + v * STEP_S
        speeds.append(v[0])
    slipping = np.array(speeds[500:4500])
    gain = (slipping[-1] - slipping[0]) / ((len(slipping) - 1) * STEP_S)
    assert gain == pytest.approx(0.35 * 9.81, rel=1e-6)
    assert speeds[-1] == pytest.approx(0.02, rel=2e-2)
