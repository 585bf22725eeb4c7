"""A pattern's contact with floor, walls and obstacles against closed forms, without sand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from skfem import MeshQuad

from sandmould.pattern_fe.contact import _least_squares, reactions_n
from sandmould.pattern_fe.coupling.body import StaticSolution
from sandmould.pattern_fe.coupling.contact_rows import ContactRows
from sandmould.pattern_fe.coupling.explicit_foam import ContactBound, ExplicitFoam
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.foam_step import step_foam
from sandmould.pattern_fe.coupling.in_step_foam import InStepFoam
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.shapes import bar, mesh_of, with_sides
from sandmould.pattern_fe.supports import Supports
from sandmould.pattern_fe.surroundings import Surroundings
from sandmould.scenario.box import AnyObstacle, Box, Plate, Polygon, build_scene
from sandmould.scenario.solids import Cylinder
from tests.patterns import THICKNESS_M, _one_thread  # noqa: F401

Array = NDArray[np.float64]
YOUNG_PA = 6.4e6
SIDE_M = 0.02
LENGTH_M, HEIGHT_M = 0.1, 0.005
INERTIA_M4 = THICKNESS_M * HEIGHT_M**3 / 12.0
STIFFNESS_N_M2 = YOUNG_PA * INERTIA_M4
GAP_M = 0.002


def surroundings(pattern: Pattern, box: Box, *obstacles: AnyObstacle) -> Surroundings:
    return pattern.surrounded(build_scene(box, obstacles, pattern.space.dimension))


def square(*clamped: str, gap_m: float, poisson: float = 0.0, **supports: Any) -> Pattern:
    """A square or cube of foam over the floor; elements of first order take even loads evenly."""
    depth_m = supports.pop("depth_m", None)
    up = np.eye(2 if depth_m is None else 3)[-1]
    mesh = mesh_of(bar(SIDE_M, SIDE_M), SIDE_M / 4, depth_m).translated(gap_m * up)
    foam = Foam(YOUNG_PA, poisson)
    thickness_m = THICKNESS_M if depth_m is None else None
    return Pattern(mesh, Supports(clamped=clamped, **supports), foam, 1, thickness_m)


def cantilever(along: int = 40, through: int = 2) -> Pattern:
    """A slender plank clamped at its left end, a gap over the floor; without Poisson's effect."""
    mesh = MeshQuad.init_tensor(
        np.linspace(0.0, LENGTH_M, along + 1), GAP_M + np.linspace(0.0, HEIGHT_M, through + 1)
    )
    foam = Foam(YOUNG_PA, 0.0)
    return Pattern(with_sides(mesh), Supports(("left",)), foam, 2, THICKNESS_M)


def end_force(body: FoamBody, force_n: float) -> Array:
    """Down on the two corners of the right end."""
    load = np.zeros_like(body.vertices_m)
    far = np.isclose(body.vertices_m[:, 0], LENGTH_M)
    load[far, 1] = -force_n / far.sum()
    return load


def even_load(pattern: Pattern, force_n: float) -> Array:
    """Down on the upper side, by the areas of its vertices."""
    outer = pattern.surface.outer
    area = outer.vertex_area_vector_m2[:, -1]
    top = np.isclose(outer.vertices_m[:, -1], outer.vertices_m[:, -1].max())
    load = np.zeros_like(outer.vertices_m)
    load[top, -1] = -force_n * area[top] / area[top].sum()
    return load


def lowest_m(body: FoamBody, solution: StaticSolution) -> float:
    return float((body.vertices_m + solution.displacement_m)[:, -1].min())


def pressed_n(solution: StaticSolution) -> float:
    """Force of contact upwards."""
    assert solution.contact_n is not None
    return float(solution.contact_n[:, -1].sum())


def test_signorini_s_bar_is_exact() -> None:
    # A bar hung from its top, pulled down at its foot over a gap g: at rest the floor carries
    # F - E A g / L, and the pull that just closes the gap none.
    pattern = square("top", gap_m=1e-3)
    body = FoamBody(pattern, surroundings=surroundings(pattern, Box(width_m=0.1)))
    closing_n = YOUNG_PA * SIDE_M * THICKNESS_M * 1e-3 / SIDE_M
    foot = np.isclose(body.vertices_m[:, 1], 1e-3)
    area = pattern.surface.outer.vertex_area_m2
    load = np.zeros_like(body.vertices_m)
    load[foot, 1] = -np.abs(pattern.surface.outer.vertex_area_vector_m2[foot, 1])
    load /= np.abs(load).sum()
    assert area.sum() == pytest.approx(4 * SIDE_M * THICKNESS_M)
    open_still = body.solve(0.9 * closing_n * load)
    assert open_still.contact_n is None
    closed = body.solve(3.0 * closing_n * load)
    # No Poisson's effect: each vertex bears the floor as its share of the load, to round-off.
    assert pressed_n(closed) == pytest.approx(2.0 * closing_n, rel=1e-9)
    assert lowest_m(body, closed) == pytest.approx(0.0, abs=1e-12)
    assert closed.energy_j == pytest.approx(0.5 * closing_n * 1e-3, rel=1e-9)
    np.testing.assert_allclose(closed.reaction_n, [0.0, 3.0 * closing_n], atol=1e-9 * closing_n)
    assert closed.moment_left_n_m < 1e-9 * closing_n * SIDE_M


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_floor_bears_a_pressed_block(large: bool, dimension: int) -> None:
    # Its sides may slide up and down but not spread (they are the walls'), and nothing else holds
    # it below: the floor bears the whole load, and the block is shorter by F L / (M A).
    depth_m = None if dimension == 2 else SIDE_M
    sides = ("left", "right") if dimension == 2 else ("left", "right", "front", "back")
    pattern = square(gap_m=0.0, poisson=0.35, resting=sides, depth_m=depth_m, bedding_n_m3=1.0)
    body = FoamBody(pattern, large, surroundings(pattern, Box(width_m=SIDE_M, depth_m=SIDE_M)))
    force_n = 1.0
    found = body.solve(even_load(pattern, force_n))
    assert pressed_n(found) == pytest.approx(force_n, rel=1e-6)
    assert lowest_m(body, found) == pytest.approx(0.0, abs=1e-9)
    constrained_pa = YOUNG_PA * (1 - 0.35) / (1 + 0.35) / (1 - 2 * 0.35)
    width_m = THICKNESS_M if dimension == 2 else SIDE_M
    shorter_m = force_n * SIDE_M / (constrained_pa * SIDE_M * width_m)
    # Twice the energy over the load is the way of its mean. Large displacements differ by 3/2 of
    # the strain, 1e-4.
    assert 2.0 * found.energy_j / force_n == pytest.approx(shorter_m, rel=1e-3)


@pytest.mark.parametrize("large", [False, True])
def test_a_cantilever_that_lands_is_a_propped_one(large: bool) -> None:
    pattern = cantilever()
    body = FoamBody(pattern, large, surroundings(pattern, Box(width_m=0.2)))
    closing_n = 3.0 * STIFFNESS_N_M2 * GAP_M / LENGTH_M**3
    free = body.solve(end_force(body, 0.5 * closing_n))
    assert free.contact_n is None
    found = body.solve(end_force(body, 1.4 * closing_n))
    # The tip alone touches until P = 1.5 P0, when the moment there would turn: R = P - P0.
    touching = np.flatnonzero(found.contact_n.any(axis=1))  # type: ignore[union-attr]
    assert body.vertices_m[touching, 0].min() > 0.9 * LENGTH_M
    # Shear adds about (h/L)^2 to the compliance, 0.25 %; large slopes (0.03)^2.
    assert pressed_n(found) == pytest.approx(0.4 * closing_n, rel=0.02)
    assert lowest_m(body, found) == pytest.approx(0.0, abs=1e-9)


def test_an_evenly_loaded_cantilever_lies_down_as_far_as_its_theory_says() -> None:
    # Where a beam under a line load q lifts off the floor it has neither slope nor moment: with
    # w = g there q a^4 = 72 E I g for the length a that hangs, and the clamp bears 2/3 q a of it.
    pattern = cantilever(along=80)
    body = FoamBody(pattern, surroundings=surroundings(pattern, Box(width_m=0.2)))
    line_n_m = 72.0 * STIFFNESS_N_M2 * GAP_M / (0.6 * LENGTH_M) ** 4
    found = body.solve(even_load(pattern, line_n_m * LENGTH_M))
    touching = np.flatnonzero(found.contact_n.any(axis=1))  # type: ignore[union-attr]
    lands_m = body.vertices_m[touching, 0].min()
    # Shear lets it land earlier, by some sqrt(E I / (k G A)) = 2.2 mm, and a beam is a line where
    # this one is 5 mm high: four times as many elements land at 56.4 mm. Vertices are 0.6 mm apart.
    assert lands_m == pytest.approx(0.6 * LENGTH_M - 0.0022, abs=0.0020)
    clamp_n = 2.0 / 3.0 * line_n_m * 0.6 * LENGTH_M
    assert pressed_n(found) == pytest.approx(line_n_m * LENGTH_M - clamp_n, rel=0.02)


def test_a_post_narrower_than_an_element_holds_a_plank() -> None:
    pattern = cantilever(along=10)
    apart_m = LENGTH_M / 20
    post = Plate(kind="plate", centre_m=(0.65 * apart_m + 0.08, GAP_M / 4),
                 size_m=(apart_m / 4, GAP_M / 2))  # fmt: skip
    body = FoamBody(pattern, surroundings=surroundings(pattern, Box(width_m=0.2), post))
    found = body.solve(end_force(body, 1.0))
    around = surroundings(pattern, Box(width_m=0.2), post)
    assert around.deepest_m(found.displacement_m) < 1e-9
    without = FoamBody(pattern, surroundings=surroundings(pattern, Box(width_m=0.2)))
    # Without the post its place is entered: the post is what holds.
    free = without.solve(end_force(body, 1.0))
    assert around.deepest_m(free.displacement_m) > 1e-4
    np.testing.assert_allclose(found.reaction_n, [0.0, 1.0], atol=1e-9)


def test_a_wedge_is_met_at_right_angles_to_its_side() -> None:
    pattern = cantilever(along=20)
    wedge = Polygon(kind="polygon", vertices_m=((0.099, 0.0), (0.14, 0.0), (0.14, 0.041)))
    body = FoamBody(pattern, surroundings=surroundings(pattern, Box(width_m=0.2), wedge))
    found = body.solve(end_force(body, 2.0))
    force = found.contact_n.sum(axis=0)  # type: ignore[union-attr]
    assert -force[0] == pytest.approx(force[1], rel=1e-3)


@pytest.mark.parametrize("large", [False, True])
def test_in_space_a_plank_comes_to_rest_on_a_rod(large: bool) -> None:
    mesh = mesh_of(bar(LENGTH_M, HEIGHT_M), 0.01, 0.02).translated(np.array([0.0, 0.0, 0.02]))
    pattern = Pattern(mesh, Supports(("left",)), Foam(YOUNG_PA, 0.0), 2)
    rod = Cylinder(kind="cylinder", centre_m=(0.0837, 0.02, 0.016), axis="y", diameter_m=0.004,
                   length_m=0.04)  # fmt: skip
    box = Box(width_m=0.2, depth_m=0.05)
    around = surroundings(pattern, box, rod)
    body = FoamBody(pattern, large, around)
    found = body.solve(even_load(pattern, 0.2))
    assert FoamBody(pattern, large).solve(even_load(pattern, 0.2)).contact_n is None
    assert around.deepest_m(found.displacement_m) < 2e-6 * LENGTH_M
    # A beam propped at b under an even load: with the prop as high as the gap is deep, by the
    # unit-load method; the reaction of the rod is some 0.4 of the load here.
    b, width_m, gap_m = 0.0837, 0.02, 0.002
    bending = YOUNG_PA * width_m * HEIGHT_M**3 / 12.0
    q = 0.2 / LENGTH_M
    sinks = q * b**2 * (6 * LENGTH_M**2 - 4 * LENGTH_M * b + b**2) / (24.0 * bending)
    exact_n = (sinks - gap_m) * 3.0 * bending / b**3
    # Shear 0.3 %, the rod's roundness and the facets 1 %, large slopes 1 %.
    assert pressed_n(found) == pytest.approx(exact_n, rel=0.03)


def test_reactions_press_only_where_gaps_close() -> None:
    rng = np.random.default_rng(2)
    root = rng.standard_normal((30, 30))
    matrix, gap = root @ root.T, rng.standard_normal(30)
    found = reactions_n(matrix, gap)
    left = matrix @ found + gap
    assert (found >= 0.0).all()
    assert left.min() > -1e-8
    assert found @ left == pytest.approx(0.0, abs=1e-8)
    # The way that is sure to end, for where the active set does not, finds the same.
    np.testing.assert_allclose(_least_squares(matrix, gap), found, atol=1e-6 * found.max())


def test_a_pattern_without_stiffness_against_its_contacts_is_told() -> None:
    with pytest.raises(RuntimeError, match="no stiffness against reactions"):
        reactions_n(np.array([[-1.0]]), np.array([-1.0]))


def test_places_that_coincide_share_one_reaction() -> None:
    twice = np.array([[2.0, 2.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 0.0]])
    found = reactions_n(twice, np.array([-1.0, -1.0, -1.0]))
    assert found == pytest.approx([0.25, 0.25, 0.0], rel=1e-6)


def test_a_dropped_end_stops_without_rebound_and_its_energy_is_counted() -> None:
    pattern = cantilever(along=8, through=1)
    around = surroundings(pattern, Box(width_m=0.2))
    foam = ExplicitFoam(pattern, 1e-5, ContactBound(1.0, 0.0), damping_ratio=1.0,
                        surroundings=around)  # fmt: skip
    closing_n = 3.0 * STIFFNESS_N_M2 * GAP_M / LENGTH_M**3
    load = end_force(FoamBody(pattern), 1.4 * closing_n)
    lowest, pressed = 0.0, []
    for _ in range(12000):
        foam.advance(load)
        lowest = min(lowest, (foam.vertices_m + foam.displacement_m)[:, 1].min())
        pressed.append(foam.contact_n[:, 1].sum())
    assert lowest > -1e-9
    assert np.mean(pressed[-2000:]) == pytest.approx(0.4 * closing_n, rel=0.03)
    left_j = foam.work_j - foam.elastic_j - foam.kinetic_j - foam.damped_j - foam.contact_j
    assert left_j == pytest.approx(0.0, abs=1e-9 * foam.work_j)
    assert 0.0 < foam.contact_j < foam.work_j
    assert foam.kinetic_j < 1e-6 * foam.work_j


def test_steps_come_to_the_rest_of_the_static_solution_on_a_post() -> None:
    pattern = cantilever(along=8, through=1)
    post = Plate(kind="plate", centre_m=(0.072, GAP_M / 4), size_m=(0.002, GAP_M / 2))
    around = surroundings(pattern, Box(width_m=0.2), post)
    body = FoamBody(pattern, surroundings=around)
    load = end_force(body, 0.25)
    exact = body.solve(load)
    row = ContactRows((np.zeros((pattern.condensed.mass_kg.size,) * 2),), 0.0)
    in_step, again = (
        InStepFoam(pattern, 1e-5, row, 0.1, damping_ratio=1.0, surroundings=around)
        for _ in range(2)
    )
    for steps in (4000, 12000):
        for _ in range(steps):
            in_step._arrays.load[:] = load
            step_foam(in_step._arrays)
        if steps == 4000:
            again.restore(in_step.state())
    for _ in range(12000):
        step_foam(again._arrays)
    # Taken up while it touches, it goes on bit for bit.
    np.testing.assert_array_equal(again.displacement_m, in_step.displacement_m)
    assert again.contact_j == in_step.contact_j
    np.testing.assert_allclose(in_step.displacement_m, exact.displacement_m, atol=1e-6)
    left_j = in_step.work_j - in_step.elastic_j - in_step.kinetic_j - in_step.damped_j
    assert left_j == pytest.approx(in_step.contact_j, abs=1e-9 * in_step.work_j)
    assert in_step.contact_j > 0.0


def test_a_plank_stepped_beside_the_grains_stays_off_a_post() -> None:
    pattern = cantilever(along=8, through=1)
    post = Plate(kind="plate", centre_m=(0.072, GAP_M / 4), size_m=(0.002, GAP_M / 2))
    around = surroundings(pattern, Box(width_m=0.2), post)
    foam = ExplicitFoam(pattern, 1e-5, ContactBound(1.0, 0.0), surroundings=around)
    load = end_force(FoamBody(pattern), 2.0)
    for _ in range(600):
        foam.advance(load)
    assert foam.contact_j > 0.0
    # Gaps are linearised at the start of a step of 1e-5 m.
    assert around.deepest_m(foam.displacement_m) < 1e-8
    left_j = foam.work_j - foam.elastic_j - foam.kinetic_j - foam.damped_j - foam.contact_j
    assert left_j == pytest.approx(0.0, abs=1e-9 * foam.work_j)
