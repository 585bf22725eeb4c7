"""Even loads on a pattern against exact results: the patch test, and Lamé's ring and tube."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from skfem import FacetBasis, LinearForm, MeshHex, MeshQuad

from sandmould.pattern_fe.coupling.foam_body import FoamBody, cross
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.supports import Supports
from tests.patterns import (
    KINDS,
    _one_thread,  # noqa: F401
    distorted,
    mesh_of_kind,
    pattern_of_kind,
)

Array = NDArray[np.float64]
PRESSURE_PA = 1000.0
INNER_M, OUTER_M = 0.03, 0.05
"""Radii of ring and tube."""
DEPTH_M = 0.02
ORDERS = pytest.mark.parametrize("order", [1, 2])
EVERY_KIND = pytest.mark.parametrize("kind", KINDS)


def even_pressure_n(pattern: Pattern, pressed: Any) -> Array:
    """Force of an even pressure on each vertex, of facets whose corners (nf, d, d) are chosen."""
    surface = pattern.surface
    area = np.where(
        pressed(surface.vertices_m[surface.facets])[:, None], surface.facet_area_vector_m2, 0.0
    )
    load = np.zeros_like(surface.vertices_m)
    for corner in surface.facets.T:
        np.add.at(load, corner, -PRESSURE_PA * area / surface.facets.shape[1])
    return load


@ORDERS
@EVERY_KIND
def test_an_even_pressure_loads_nodes_by_integrals_of_their_shape_functions(
    kind: str, order: int
) -> None:
    mesh = mesh_of_kind(kind)
    # sides of all lengths and angles; faces of hexahedra are twisted
    mesh = type(mesh)(mesh.p + np.random.default_rng(2).uniform(-2e-3, 2e-3, mesh.p.shape), mesh.t)
    pattern = Pattern(mesh, Supports(), Foam(), order, 1.0 if mesh.dim() == 2 else None)
    found_n = pattern.on_nodes(even_pressure_n(pattern, lambda corners: corners[:, 0, 0] > -1.0))
    # products of a shape function and the area are of degree 4 at most
    basis = FacetBasis(mesh, pattern.space.basis(1).elem, intorder=4)
    exact_n = [
        LinearForm(lambda v, w, axis=axis: -PRESSURE_PA * v * w.n[axis]).assemble(basis)
        for axis in range(mesh.dim())
    ]
    np.testing.assert_allclose(found_n, np.stack(exact_n, axis=1), atol=1e-12 * PRESSURE_PA * 4e-4)


@ORDERS
@EVERY_KIND
def test_an_even_pressure_on_a_block_between_rollers_gives_one_stress(
    kind: str, order: int
) -> None:
    mesh = distorted(mesh_of_kind(kind, 0.005 if kind in KINDS[:2] else 0.01))
    rollers = Supports(resting=tuple(name for name in mesh.boundaries if name != "top"))
    foam = Foam(1e5, 0.35, 12.0)
    pattern = Pattern(mesh, rollers, foam, order, 0.25 if mesh.dim() == 2 else None)
    height_m = float(mesh.p.max())
    load = even_pressure_n(pattern, lambda at: (at[..., -1] > height_m - 1e-9).all(axis=1))
    moved = pattern.solve_linear(pattern.on_nodes(load))
    lam, mu = foam.lame_pa
    exact = -PRESSURE_PA / (lam + 2.0 * mu) * pattern.surface.vertices_m[:, -1]
    # the solution loses some four of its sixteen digits
    np.testing.assert_allclose(
        pattern.on_surface(moved)[:, -1], exact, rtol=0.0, atol=1e-10 * np.abs(exact).max()
    )
    np.testing.assert_allclose(pattern.stress_pa(moved)[..., -1, -1], -PRESSURE_PA, rtol=1e-10)


@ORDERS
@EVERY_KIND
def test_forces_of_grains_anywhere_are_in_balance_with_the_supports(kind: str, order: int) -> None:
    pattern = pattern_of_kind(kind, order)
    surface, random = pattern.surface, np.random.default_rng(7)
    d = pattern.space.dimension
    # on every vertex, in the middle of every edge of a facet, and inside it
    shares = np.vstack([np.eye(d), (1.0 - np.eye(d)) / (d - 1), random.dirichlet(np.ones(d), 3)])
    point = np.einsum("sk,fkd->fsd", shares, surface.vertices_m[surface.facets])
    force = random.standard_normal(point.shape)
    load = np.zeros_like(surface.vertices_m)
    np.add.at(load, surface.facets, np.einsum("sk,fsd->fkd", shares, force))
    on_nodes = pattern.on_nodes(load)
    point, force = point.reshape(-1, d), force.reshape(-1, d)
    size_n = np.abs(force).sum()
    np.testing.assert_allclose(on_nodes.sum(axis=0), force.sum(axis=0), atol=1e-12 * size_n)
    moment_n_m = cross(point, force).sum(axis=0)
    of_nodes_n_m = cross(pattern.space.node_m, on_nodes).sum(axis=0)
    np.testing.assert_allclose(of_nodes_n_m, moment_n_m, atol=1e-12 * 0.02 * size_n)
    # the work of the forces is that of the nodes, whatever the motion
    motion = random.standard_normal(on_nodes.shape)
    work = np.vdot(load, pattern.on_surface(motion))
    assert work == pytest.approx(np.vdot(on_nodes, motion), abs=1e-12 * size_n)
    solution = FoamBody(pattern).solve(load)
    # reactions come out of a solution
    np.testing.assert_allclose(solution.reaction_n, -force.sum(axis=0), atol=1e-10 * size_n)
    assert solution.moment_left_n_m < 1e-10 * 0.02 * size_n


def ring(through: int, depth_m: float | None) -> Any:
    """Quarter of a ring or tube with straight sides, its flat sides named."""
    radii = np.linspace(INNER_M, OUTER_M, through + 1)
    angles = np.linspace(0.0, np.pi / 2, 3 * through + 1)
    if depth_m is None:
        mesh = MeshQuad.init_tensor(radii, angles)
    else:
        mesh = MeshHex.init_tensor(radii, np.array([0.0, depth_m]), angles)
    radius, angle = mesh.p[0], mesh.p[-1]
    places = mesh.p.copy()
    places[0], places[-1] = radius * np.cos(angle), radius * np.sin(angle)
    flat = {"left": (angle, np.pi / 2), "bottom": (angle, 0.0)}
    if depth_m is not None:
        flat |= {"front": (mesh.p[1], 0.0), "back": (mesh.p[1], depth_m)}
    sides = {
        name: np.flatnonzero((abs(of[mesh.facets] - value) < 1e-9).all(axis=0))
        for name, (of, value) in flat.items()
    }
    return type(mesh)(places, mesh.t).with_boundaries(sides)


def ring_errors(through: int, depth_m: float | None = None) -> tuple[float, float, float]:
    """Errors of the displacement, of the hoop stress in the mean square and at its worst point.

    All as parts of the exact ones, plane strain (Timoshenko and Goodier, Theory of Elasticity, 3rd
    ed., section 28), in elements of second order under a pressure on the outside.
    """
    mesh = ring(through, depth_m)
    foam = Foam(1e5, 0.35, 12.0)
    thickness_m = 0.1 if depth_m is None else None
    pattern = Pattern(mesh, Supports(resting=tuple(mesh.boundaries)), foam, 2, thickness_m)
    plane = [0, mesh.dim() - 1]

    def outside(corners: Array) -> Any:
        return np.linalg.norm(corners[..., plane], axis=2).min(axis=1) > OUTER_M * 0.99

    moved = pattern.solve_linear(pattern.on_nodes(even_pressure_n(pattern, outside)))
    mean_pa = -PRESSURE_PA * OUTER_M**2 / (OUTER_M**2 - INNER_M**2)
    radius_m = np.linalg.norm(pattern.space.node_m[:, plane], axis=1)
    across = (1.0 + foam.poisson) / foam.young_pa * mean_pa
    exact_m = across * ((1.0 - 2.0 * foam.poisson) * radius_m + INNER_M**2 / radius_m)
    outward_m = np.sum(moved[:, plane] * pattern.space.node_m[:, plane], axis=1) / radius_m
    basis = pattern.space.basis(pattern.space.slope_degree)
    place_m = np.moveaxis(np.asarray(basis.global_coordinates())[plane], 0, -1)
    radius2 = np.sum(place_m**2, axis=-1)
    around = np.stack([-place_m[..., 1], place_m[..., 0]], axis=-1)
    stress = pattern.stress_pa(moved)[..., plane, :][..., plane]
    hoop_pa = np.einsum("eqi,eqij,eqj->eq", around, stress, around) / radius2
    exact_pa = mean_pa * (1.0 + INNER_M**2 / radius2)
    weight = pattern.space.weight
    square = np.average((hoop_pa - exact_pa) ** 2, weights=weight)
    return (
        float(np.abs(outward_m - exact_m).max() / np.abs(exact_m).max()),
        float(np.sqrt(square / np.average(exact_pa**2, weights=weight))),
        float(np.abs(hoop_pa / exact_pa - 1.0).max()),
    )


def test_a_ring_under_even_pressure_has_the_stress_of_lame() -> None:
    coarse, middle, fine = (np.array(ring_errors(through)) for through in (2, 4, 8))
    # sides are straight: the polygon differs from the circle with the square of their length
    assert fine[0] < 1e-3
    assert (np.log2(coarse[0] / middle[0]), np.log2(middle[0] / fine[0])) == pytest.approx(
        (2.0, 2.0), abs=0.1
    )
    assert fine[2] < 3e-3
    # Kinks between sides would keep it to 1.5 near them, a small part of the ring.
    assert np.log2(middle[1] / fine[1]) > 1.9


def test_a_tube_between_rollers_is_the_ring() -> None:
    np.testing.assert_allclose(ring_errors(4, DEPTH_M), ring_errors(4), rtol=1e-6)
