"""Castings whose surface is off the grid: freezing times, volumes, areas, conservation, steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from sandmould.arrays import Floats
from sandmould.casting.arpm.computation import middle_frozen_s
from sandmould.casting.arpm.cut import with_cut
from sandmould.casting.arpm.cut_volume import LEAST_SHARE, held_of
from sandmould.casting.arpm.elements import placed
from sandmould.casting.arpm.exchange import face_exchange
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.casting.arpm.method import HeatMethod
from sandmould.casting.arpm.raster import Cut, Raster, painted
from sandmould.casting.arpm.solidification import SolidificationResult, solidify
from sandmould.geometry.geometry import Block
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.scenario.casting.shapes import Body, Pixels
from tests.radial_casting import lumped_s, radial_frozen_s
from tests.verification.castings.exact import stefan_front

STEEL = ThermalMaterial("steel", 7200.0, 711.0, 29.3, 272e3, 1713.0, 1773.0)
SAND = ThermalMaterial("sand", 1600.0, 1130.0, 1.255)
ALUMINIUM = ThermalMaterial("aluminium", 2500.0, 1000.0, 120.0, 390e3, 830.0, 880.0)
DIE = ThermalMaterial("die", 7800.0, 500.0, 40.0)
CASES = {
    "steel in sand": Filling((SAND, STEEL), (293.0, 1823.0), 1 / 837.0),
    "aluminium in a die": Filling((DIE, ALUMINIUM), (500.0, 950.0), 1 / 1000.0),
}
R = 0.01
SHIFTS = (0.0, 0.25, 0.5)
"""Places on the grid, in elements."""
HALF = {2: 0.04, 3: 0.025}
"""Half the box's side; the mould of the radial solution has as much volume."""


def turned(degrees: float) -> Outline:
    """A square bar."""
    angle = np.radians(degrees + 45.0 + 90.0 * np.arange(4))
    return Outline("the bar", R * math.sqrt(2) * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def disc(sides: int = 100) -> Outline:
    """A round bar, as a polygon of its area."""
    angle = 2 * np.pi * np.arange(sides) / sides
    reach = R * math.sqrt(2 * np.pi / sides / math.sin(2 * np.pi / sides))
    return Outline("the disc", reach * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def ball(points: int = 1500) -> TriangleMesh:
    """A ball, as a polyhedron of its volume with even corners."""
    k = np.arange(points) + 0.5
    z, angle = 1 - 2 * k / points, np.pi * (1 + math.sqrt(5)) * k
    rim = np.sqrt(1 - z**2)
    corner = np.stack([rim * np.cos(angle), rim * np.sin(angle), z], axis=1)
    side = ConvexHull(corner).simplices.astype(np.int64)
    normal = np.cross(
        corner[side[:, 1]] - corner[side[:, 0]], corner[side[:, 2]] - corner[side[:, 0]]
    )
    inward = np.sum(normal * corner[side[:, 0]], axis=1) < 0
    side[inward] = side[inward][:, ::-1]
    grow = (4 * np.pi / 3 / TriangleMesh("one", corner, side).measure) ** (1 / 3)
    return TriangleMesh("the ball", R * grow * corner, side)


def cube(*degrees: float) -> Block:
    """A cube, turned about z and then about x."""
    (c, a), (s, b) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    first = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    then = np.array([[1, 0, 0], [0, a, -b], [0, b, a]])
    return Block("the cube", np.zeros(3), np.full(3, R), (first @ then).T)


def drawn(bodies: Sequence[Body], cells: float, shift: float = 0.0) -> Raster:
    """Cut cells round the origin, so many on ``R``."""
    d = bodies[0].corners().shape[1]
    cell = R / cells
    half = round(HALF[d] / cell) * cell * np.ones(d)
    parts = painted(shift * cell - half, shift * cell + half, cell, dict(enumerate(bodies, 1)))
    one = Raster(np.minimum(parts.material, 1), cell, parts.low_m)
    return with_cut(one, bodies)


@lru_cache
def disc_on(cells: int, shift: float = 0.0) -> Raster:
    return drawn([disc()], cells, shift)


@lru_cache
def turned_on(degrees: float, shift: float = 0.0) -> Raster:
    return drawn([turned(degrees)], 8, shift)


@lru_cache
def ball_on(cells: int, shift: float) -> Raster:
    return drawn([ball()], cells, shift)


def cut_of(raster: Raster) -> Cut:
    """What the surface cuts."""
    assert raster.cut is not None
    return raster.cut


def volume_of(raster: Raster) -> float:
    """Of the casting."""
    casting = (raster.material == 1).ravel().astype(np.float64)
    casting[cut_of(raster).cell] *= cut_of(raster).volume_share
    return float(casting.sum()) * raster.cell_m**raster.material.ndim


def area_of(raster: Raster) -> float:
    """Of the casting's surface."""
    return float(cut_of(raster).area_share.sum()) * raster.cell_m ** (raster.material.ndim - 1)


def frozen(raster: Raster, case: str, way: str = "difference", layers: tuple[int, ...] = ()
           ) -> SolidificationResult:  # fmt: skip
    """How a casting freezes."""
    elements = placed(raster, layers)
    marching = HeatMethod(way).marching(elements, CASES[case], raster)  # type: ignore[arg-type]
    return solidify(elements, CASES[case], marching, record_s=4.0)


@lru_cache
def radial(case: str, dimensions: int, shells: int) -> float:
    outer = 2 * HALF[dimensions] * (1 / math.pi if dimensions == 2 else 3 / (4 * math.pi)) ** (
        1 / dimensions)  # fmt: skip
    return float(radial_frozen_s(CASES[case], R, outer, dimensions, shells)[1].max())


def exact(case: str, dimensions: int) -> float:
    """Radial solution, continued to no shell width with its second order."""
    return (4 * radial(case, dimensions, 80) - radial(case, dimensions, 40)) / 3


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("case", list(CASES))
def test_the_radial_solution_converges(case: str, dimensions: int) -> None:
    coarse, middle, fine = (radial(case, dimensions, shells) for shells in (20, 40, 80))
    # steps go with the square of the width, so that all errors are of second order
    assert math.log2((coarse - middle) / (middle - fine)) == pytest.approx(2.0, abs=0.25)
    # what is left after continuing is far below the 1 % that elements are held to
    assert (4 * middle - coarse) / 3 == pytest.approx(exact(case, dimensions), rel=3e-4)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_the_radial_solution_of_a_thin_casting_is_the_lumped_one(dimensions: int) -> None:
    cold = ThermalMaterial("cold", 1e9, 1e3, 1e9)
    filling = Filling((cold, ALUMINIUM), (500.0, 950.0), 1 / 40.0)
    assert R / filling.resistance_m2k_w / ALUMINIUM.conductivity_w_m_k < 0.02
    found = radial_frozen_s(filling, R, 2 * R, dimensions, 20)[1].max()
    # gradients inside count with a share of Bi, 0.003
    assert found == pytest.approx(lumped_s(filling, R / dimensions), rel=3e-3)


@pytest.mark.parametrize(("way", "layers"), [("difference", ()), ("faces", ()), ("faces", (4,))])
@pytest.mark.parametrize("case", list(CASES))
def test_a_disc_freezes_as_the_radial_solution(
    case: str, way: str, layers: tuple[int, ...]
) -> None:
    for shift in SHIFTS:
        found = frozen(disc_on(8, shift), case, way, layers)
        # 0.18 % measured in sand, 0.08 % in a die; -3.5 and -15 % with a
        # staircase's area
        assert found.solidification_time_s == pytest.approx(exact(case, 2), rel=0.01)
        assert np.abs(found.drift_percent).max() < 1e-10


@pytest.mark.parametrize("case", list(CASES))
def test_a_disc_converges(case: str) -> None:
    # at the worst of three positions on the grid
    off = [max(abs(frozen(disc_on(n, shift), case).solidification_time_s / exact(case, 2)
                   - 1) for shift in SHIFTS) for n in (3, 6, 12)]  # fmt: skip
    # 1.0 and 0.27 % with 6 and 12 in sand; in a die what the polygon is off the circle
    assert off[2] < max(0.35 * off[1], 5e-4)
    assert off[1] < max(0.5 * off[0], 1e-3)


@pytest.mark.parametrize("cells", [8.0, 8.5])
def test_where_the_surface_lies_between_middles_counts_little(cells: float) -> None:
    found = [frozen(drawn([turned(0.0)], cells, shift), "steel in sand").solidification_time_s
             for shift in SHIFTS]  # fmt: skip
    # 0.36 % measured; 0.5 % at 8 where what a cell holds counts at its middle
    assert np.ptp(found) / found[0] < 0.004


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0])
@pytest.mark.parametrize("shift", SHIFTS)
def test_sloping_temperatures_hold_the_drawings_heat(degrees: float, shift: float) -> None:
    raster = drawn([turned(degrees)], 8.4, shift)
    volume = np.ones(raster.material.size)
    volume[cut_of(raster).cell] = cut_of(raster).volume_share
    volume = np.where(raster.material.ravel() == 1, volume, 0.0) * raster.cell_m**2
    # of a square about its middle; a plain grid's squares leave out their own
    expected = (2 * R) ** 4 / 6 - (2 * R) ** 2 * raster.cell_m**2 / 6
    found = float((volume * np.sum(raster.centre_m**2, axis=1)).sum())
    # 0.24 % measured: squares of places in cells half cut; 2.2 % upright, 1.1 % at 45 degrees
    # where all that a cell holds counts at its middle
    assert found == pytest.approx(expected, rel=3e-3)


@pytest.mark.parametrize("case", list(CASES))
@pytest.mark.parametrize("way", ["difference", "faces"])
def test_a_turned_bar_freezes_as_the_bar_upright(case: str, way: str) -> None:
    upright = painted(np.full(2, -0.04), np.full(2, 0.04), R / 8, {1: turned(0.0)})
    expected = frozen(upright, case, way).solidification_time_s
    for degrees in (45.0, 20.0, 7.0):
        for shift in SHIFTS:
            found = frozen(turned_on(degrees, shift), case, way)
            # 0.68 % measured at 20 degrees in sand
            assert found.solidification_time_s == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("case", "cells"), list(zip(CASES, (8, 6), strict=True)), ids=CASES)
def test_a_ball_freezes_as_the_radial_solution(case: str, cells: int) -> None:
    plain, ways = (), ("difference", "faces")
    for shift, way, layers in (*((x, way, plain) for x in (0.0, 0.5) for way in ways),
                               (0.0, "faces", (2,))):  # fmt: skip
        raster = ball_on(cells, shift)
        assert volume_of(raster) == pytest.approx(4 / 3 * math.pi * R**3, rel=2e-3)
        assert area_of(raster) == pytest.approx(4 * math.pi * R**2, rel=2e-3)
        found = frozen(raster, case, way, layers)
        # 0.35 % measured in sand, 0.09 % in a die; -12 and -30 % with a staircase's area
        assert found.solidification_time_s == pytest.approx(exact(case, 3), rel=0.01)
        assert np.abs(found.drift_percent).max() < 1e-10


def test_a_turned_cube_freezes_as_the_cube_upright() -> None:
    case, cells = "aluminium in a die", 6
    half = np.full(3, round(HALF[3] / R * cells) * R / cells)
    upright = painted(-half, half, R / cells, {1: cube(0.0, 0.0)})
    raster = drawn([cube(20.0, 30.0)], cells)
    assert volume_of(raster) == pytest.approx(8 * R**3, rel=2e-3)
    assert area_of(raster) == pytest.approx(24 * R**2, rel=1e-3)
    expected = frozen(upright, case).solidification_time_s
    # 0.36 % measured, 0.26 % with 8 elements
    assert frozen(raster, case).solidification_time_s == pytest.approx(expected, rel=0.01)


WALLS = {
    "T": [(-30, 0), (-5, 0), (-5, -25), (5, -25), (5, 0), (30, 0), (30, 10), (-30, 10)],
    "L": [(-10, -10), (30, -10), (30, 0), (0, 0), (0, 30), (-10, 30)],
}
"""Walls of 10 mm that meet, in mm."""


def walls(name: str, degrees: float) -> Outline:
    angle = math.radians(degrees)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    off = np.array([3e-4, 2e-4]) if degrees else np.zeros(2)
    return Outline(name, 1e-3 * np.array(WALLS[name]) @ turn.T + off)


@lru_cache
def walls_frozen_s(name: str, degrees: float, cells: int, way: str = "faces") -> float:
    """When walls are solid that are so many elements thick."""
    half, cell, body = np.full(2, 0.06), 0.01 / cells, walls(name, degrees)
    raster = with_cut(painted(-half, half, cell, {1: body}), [body])
    return frozen(raster, "steel in sand", way).solidification_time_s


@pytest.mark.parametrize("name", list(WALLS))
@pytest.mark.parametrize("degrees", [7.0, 20.0, 30.0, 45.0])
def test_walls_that_meet_freeze_alike_at_any_angle(name: str, degrees: float) -> None:
    upright, exact = (walls_frozen_s(name, 0.0, cells) for cells in (8, 16))
    exact += (exact - upright) / 3
    off = [walls_frozen_s(name, degrees, cells) / exact - 1 for cells in (4, 8)]
    # 0.30 % measured with 8 elements a wall, 2.6 % where steps hinder heat along the surface
    assert abs(off[1]) < 0.01
    assert abs(walls_frozen_s(name, degrees, 8) / upright - 1) < 0.01
    # 2.9 % measured for the L at 7 degrees, 1.6 % upright; with 8 all turned ones are nearer than
    # upright, with 16 some keep 0.2 % where upright has 0.1 %
    assert abs(off[0]) < 0.035
    assert walls_frozen_s(name, degrees, 8, "difference") == pytest.approx(
        walls_frozen_s(name, degrees, 8), rel=2e-3
    )


def test_heat_along_a_turned_wall_finds_no_steps() -> None:
    # a temperature that slopes along a wall leaves every cell of it in balance
    for degrees in (20.0, 30.0, 45.0):
        angle = math.radians(degrees)
        along, across = np.array([math.cos(angle), math.sin(angle)]), np.array(
            [-math.sin(angle), math.cos(angle)])  # fmt: skip
        corners = [s * 0.2 * along + t * 0.005 * across for s, t in
                   ((-1, -1), (1, -1), (1, 1), (-1, 1))]  # fmt: skip
        body, half, cell = Outline("wall", np.array(corners)), np.full(2, 0.04), 0.00125
        raster = with_cut(painted(-half, half, cell, {1: body}), [body])
        elements = placed(raster)
        only = face_exchange(elements, np.array([1e-12, 1.0]), 0.0)
        slope = elements.position_m @ along
        row = np.repeat(np.arange(len(slope)), np.diff(only.start))
        flow = np.bincount(row, only.rate_w_m3_k * (slope[only.neighbour] - slope[row]), len(slope))
        inner = (elements.material == 1) & (np.abs(elements.position_m).max(axis=1) < 0.03)
        # of the heat that one face passes; 0.5 where steps hinder it
        assert np.abs(flow[inner]).max() * cell < 0.05


@pytest.mark.slow
def test_walls_that_meet_in_space_freeze_as_upright() -> None:
    case, cell = "aluminium in a die", 0.00125
    times = []
    for degrees in ((0.0, 0.0), (30.0, 20.0)):
        flat = 1e-3 * np.array(WALLS["L"], dtype=np.float64) * 0.6 + np.array([-5e-3, -5e-3])
        flat[[2, 3, 4]] = np.array([[18e-3, 5e-3], [5e-3, 5e-3], [5e-3, 18e-3]]) - 5e-3
        flat[[0, 1, 5]] = np.array([[-5e-3, -5e-3], [18e-3, -5e-3], [-5e-3, 18e-3]]) - 5e-3
        n = len(flat)
        place = np.concatenate([np.column_stack([flat, np.full(n, z)]) for z in (-0.01, 0.01)])
        (c, a), (s, b) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        place = place @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
        place = place @ np.array([[1, 0, 0], [0, a, -b], [0, b, a]]).T
        caps = [(0, 3, 1), (1, 3, 2), (0, 5, 3), (3, 5, 4)]
        sides = [f for k in range(n) for f in ((k, (k + 1) % n, n + k),
                                               ((k + 1) % n, n + (k + 1) % n, n + k))]  # fmt: skip
        tops = [(n + i, n + k, n + j) for i, j, k in caps]
        body = TriangleMesh("the L", place, np.array([*caps, *sides, *tops]))
        assert body.measure == pytest.approx(2e-2 * (23 * 10 + 13 * 10) * 1e-6)
        half = np.full(3, 0.03)
        raster = with_cut(painted(-half, half, cell, {1: body}), [body])
        times.append(frozen(raster, case, "faces").solidification_time_s)
    # 0.3 % measured
    assert times[1] == pytest.approx(times[0], rel=0.01)


@pytest.mark.parametrize("degrees", [45.0, 20.0, 3.0])
def test_volume_and_area_are_those_of_the_drawing(degrees: float) -> None:
    raster = drawn([turned(degrees)], 8.3)
    # 256 points in each of some 70 cells
    assert volume_of(raster) == pytest.approx(4 * R**2, rel=1e-3)
    assert area_of(raster) == pytest.approx(8 * R, rel=1e-9)
    cut = cut_of(raster)
    assert cut.volume_share.sum() == pytest.approx(len(cut.cell), rel=1e-12)


def picture(dark: Floats, pixel_m: float) -> Pixels:
    """Dark pixels round the origin; distances of whole pixels are enough here."""
    low = -0.5 * pixel_m * np.array(dark.shape)
    return Pixels("the picture", np.where(dark, -0.5, 0.5), pixel_m, low)


def test_a_painted_disc_has_the_slope_that_its_steps_stand_for() -> None:
    n = 4 * 8
    place = np.arange(-n - 2, n + 2) + 0.5
    painting = picture(np.hypot(*np.meshgrid(place, place)) < n, R / n)
    raster = drawn([painting], 8)
    assert volume_of(raster) == pytest.approx(math.pi * R**2, rel=5e-3)
    # the steps themselves are 27 % longer
    assert area_of(raster) == pytest.approx(2 * math.pi * R, rel=0.01)


def test_large_pixels_are_taken_as_drawn() -> None:
    # off the grid by 0.3 of an element, and 1.5 elements wide
    painting = picture(np.ones((4, 3)) > 0, 1.5 * R / 8)
    raster = drawn([painting], 8, 0.3)
    assert area_of(raster) == pytest.approx(2 * (4 + 3) * painting.pixel_m, rel=1e-9)
    assert volume_of(raster) == pytest.approx(12 * painting.pixel_m**2, rel=5e-3)
    assert cut_of(raster).area_share.max() < 1.7  # beside a corner that holds no middle


@pytest.mark.parametrize("way", ["difference", "faces"])
def test_drawings_on_the_grid_stay_as_they_were(way: str) -> None:
    half = np.full(2, HALF[2])
    for body in (turned(0.0), Block("bar", np.zeros(2), np.full(2, R), np.eye(2)),
                 picture(np.ones((4, 4)) > 0, R / 2)):  # fmt: skip
        plain = painted(-half, half, R / 4, {1: body})
        # the very same cells, so the same computation bit for bit
        assert with_cut(plain, [body]) is plain
    # beside a slope elsewhere, the faces on the grid are whole
    raster = drawn([Outline("ramp", R * np.array([[-1, -1], [1, -1], [1, 0.3], [-1, 1]]))], 8)
    cut, flat = cut_of(raster), raster.material.ravel()
    low = np.stack(np.unravel_index(cut.low, raster.material.shape), axis=1)
    below = (cut.axis == 1) & (flat[cut.low] == 0)
    assert np.unique(low[below, 1]).tolist() == [round(HALF[2] / R * 8) - 8 - 1]
    assert (cut.area_share[below] == 1.0).all()
    assert (cut.low_part[below] == 0.5).all()


def test_both_ways_exchange_the_same_heat() -> None:
    raster = turned_on(20.0)
    case = "steel in sand"
    found = [
        solidify(placed(raster), CASES[case], HeatMethod(way, "explicit").marching(  # type: ignore[arg-type]
            placed(raster), CASES[case], raster), record_s=4.0).solidification_time_s
        for way in ("difference", "faces")
    ]  # fmt: skip
    assert found[0] == pytest.approx(found[1], rel=1e-9)


def test_parts_that_touch_off_the_grid_have_no_surface_between_them() -> None:
    whole = turned(20.0)
    a, b, c, d = whole.vertices_m
    m, n = 0.5 * (a + b), 0.5 * (c + d)
    halves = [Outline("one", np.array([a, m, n, d])), Outline("two", np.array([m, b, c, n]))]
    assert area_of(drawn(halves, 8)) == pytest.approx(8 * R, rel=1e-9)
    one, two = (held_of(drawn(bodies, 8), bodies).share for bodies in ([whole], halves))
    np.testing.assert_allclose(two, one, atol=1 / 256)


def test_no_surface_lies_on_the_box() -> None:
    cell = R / 8
    body = disc()
    quarter = painted(np.zeros(2), np.full(2, 32 * cell), cell, {1: body})
    raster = with_cut(quarter, [body])
    assert area_of(raster) == pytest.approx(0.5 * math.pi * R, rel=1e-3)
    case = "aluminium in a die"
    whole = frozen(disc_on(8), case).solidification_time_s
    assert frozen(raster, case).solidification_time_s == pytest.approx(whole, rel=1e-3)


@pytest.mark.parametrize("stepping", ["explicit", "local", "super"])
def test_slivers_neither_lose_heat_nor_stability(stepping: str) -> None:
    # a wall of a twentieth of a cell that holds a row of centres, on a block
    cell = R / 8
    wall = Outline("wall", np.array([[-R, 0.47 * cell], [R, 0.47 * cell], [R, 0.53 * cell],
                                     [-R, 0.53 * cell]]))  # fmt: skip
    bodies = [wall, Outline("block", turned(20.0).vertices_m - np.array([0.0, 2 * R]))]
    raster = drawn(bodies, 8)
    share = cut_of(raster).volume_share
    assert share.min() == pytest.approx(LEAST_SHARE)
    elements, filling = placed(raster), CASES["steel in sand"]
    marching = HeatMethod("faces", stepping).marching(elements, filling, raster)  # type: ignore[arg-type]
    found = solidify(elements, filling, marching, record_s=4.0, until_s=80.0)
    assert math.isfinite(found.solidification_time_s)
    # super steps add and take away the enthalpy of some stages, so they round more
    assert np.abs(found.drift_percent).max() < 1e-9
    plain = HeatMethod("faces", "explicit").marching(
        placed(drawn([turned(0.0)], 8)), filling, raster
    )
    if stepping == "explicit":
        assert marching.step_s > 0.5 * LEAST_SHARE * plain.step_s


def test_elements_of_an_alloy_freeze_when_the_drawing_does_there() -> None:
    case = "steel in sand"
    outer = 2 * HALF[2] / math.sqrt(math.pi)
    place, when = radial_frozen_s(CASES[case], R, outer, 2, 80)
    mean = []
    for n in (8, 16):
        raster = disc_on(n)
        found, elements = frozen(raster, case), placed(raster)
        metal = elements.material == 1
        expected = np.interp(np.linalg.norm(elements.position_m[metal], axis=1), place, when)
        mean.append(np.abs(found.heat.frozen_s[metal] - expected).mean() / when.max())
    # 0.95 and 0.34 % measured; 1.5 and 0.36 % where steps hinder heat along the surface
    assert mean[0] < 0.012
    assert mean[1] < 0.4 * mean[0]


def test_a_front_passes_the_middles_of_elements_as_neumann_says() -> None:
    metal = ThermalMaterial("metal", 7000.0, 700.0, 30.0, 250e3, 1700.0, 1700.0)
    chill = ThermalMaterial("chill", 1e9, 700.0, 30.0 * 1e9 / 7000.0)
    cell, cells, duration = 0.001, 60, 200.0
    material = np.ones((cells + 1, 1), dtype=np.int64)
    material[0] = 0
    elements = placed(Raster(material, cell, np.array([-cell, 0.0])))
    filling = Filling((chill, metal), (1200.0, 1700.0))
    marching = HeatMethod("faces", "explicit").stepping_of(elements, filling)
    found = solidify(elements, filling, marching, record_s=duration, until_s=duration)
    middle = middle_frozen_s(elements, filling, found.heat.frozen_s)
    speed = 2 * stefan_front(metal, 1700.0, 1200.0)
    diffusivity = metal.conductivity_w_m_k / metal.capacity_j_m3_k
    inner = np.flatnonzero(np.isfinite(middle))[5:-2]
    expected = (elements.position_m[inner, 0] / speed) ** 2 / diffusivity
    # with whole elements the front seems half an element late, at 10 elements 10 %
    late = found.heat.frozen_s[inner] / expected - 1
    off = middle[inner] / expected - 1
    assert late.mean() > 0.04
    assert abs(off.mean()) < 0.01
