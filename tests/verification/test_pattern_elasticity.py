"""Linear elasticity of the pattern against exact states, beam theory and made-up solutions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from skfem import Basis, ElementVector, Functional, LinearForm

from sandmould.pattern_fe.elasticity import internal_force_n
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.supports import Supports
from tests.patterns import (
    FOOT,
    KINDS,
    THICKNESS_M,
    _one_thread,  # noqa: F401
    bent_far,
    cantilever,
    distorted,
    end_load,
    mesh_of_kind,
    pattern_of_kind,
)

Array = NDArray[np.float64]
SIZE_M = 0.02
AMPLITUDE_M = 0.02 * SIZE_M


def _distorted_pattern(kind: str, order: int) -> Pattern:
    mesh = distorted(mesh_of_kind(kind, SIZE_M / 3, SIZE_M))
    return Pattern(mesh, FOOT, order=order, thickness_m=THICKNESS_M if mesh.dim() == 2 else None)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [1, 2])
def test_patch_of_distorted_elements_holds_a_constant_strain(kind: str, order: int) -> None:
    pattern = _distorted_pattern(kind, order)
    d = pattern.space.dimension
    slope = 1e-3 * np.random.default_rng(2).standard_normal((d, d))
    exact = pattern.space.node_m @ slope.T
    outer = np.zeros(exact.shape, dtype=bool)
    outer[pattern.surface.nodes] = True
    outer, found = outer.ravel(), exact.ravel().copy()
    inner = pattern.stiffness[~outer]
    found[~outer] = np.linalg.solve(inner[:, ~outer].toarray(), -(inner[:, outer] @ found[outer]))
    # round-off of a system of a hundred unknowns
    assert np.allclose(found, exact.ravel(), rtol=0.0, atol=1e-12 * np.abs(exact).max())
    stress = pattern.foam.stress_pa(0.5 * (slope + slope.T))
    assert np.allclose(
        pattern.stress_pa(found.reshape(-1, d)), stress, rtol=0.0, atol=1e-9 * np.abs(stress).max()
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [1, 2])
def test_patch_is_in_equilibrium_under_a_large_constant_strain(kind: str, order: int) -> None:
    pattern = _distorted_pattern(kind, order)
    d = pattern.space.dimension
    slope = 0.1 * np.random.default_rng(2).standard_normal((d, d))
    force = internal_force_n(pattern.space, pattern.foam, pattern.space.node_m @ slope.T)
    held = np.abs(force).max()
    force[pattern.surface.nodes] = 0.0
    assert np.abs(force).max() < 1e-12 * held


def test_stress_across_the_plane_counts_in_the_equivalent_stress() -> None:
    # held sideways on both sides: nu enters twice, once across the plane
    pattern = pattern_of_kind("quadrilaterals", 1, Supports(resting=("left", "right", "bottom")))
    strain = 1e-3
    stretched = pattern.space.node_m * np.array([0.0, strain])
    lam, mu = pattern.foam.lame_pa
    # uniaxial strain: sideways stresses are both lambda e, so the difference alone is left
    assert pattern.von_mises_pa(stretched) == pytest.approx(2.0 * mu * strain)
    assert pattern.stress_pa(stretched)[..., 0, 0] == pytest.approx(lam * strain)


def _beam_tip_m(pattern: Pattern, length_m: float, height_m: float, force_n: float) -> float:
    """Timoshenko's cantilever of a wide strip, shear factor 5/6."""
    inertia = THICKNESS_M * height_m**3 / 12.0
    shear = pattern.foam.lame_pa[1] * THICKNESS_M * height_m * 5.0 / 6.0
    young_pa = pattern.foam.young_pa / (1.0 - pattern.foam.poisson**2)
    bending = force_n * length_m**3 / (3.0 * young_pa * inertia)
    return bending + force_n * length_m / shear


def _tip_m(pattern: Pattern, force_n: float) -> float:
    displacement = pattern.solve_linear(end_load(pattern, force_n))
    right = np.isclose(pattern.space.node_m[:, 0], pattern.space.node_m[:, 0].max())
    return float(displacement[right, 1].mean())


@pytest.mark.parametrize(
    ("poisson", "slenderness", "rel"),
    [
        (0.0, 10, 1e-3),
        # the clamp keeps the section from widening: as if 2.4 % of the height were cut off the
        # length, 0.24 % of the deflection at this slenderness
        (0.35, 30, 4e-3),
    ],
)
def test_cantilever_bends_as_timoshenko_says(poisson: float, slenderness: int, rel: float) -> None:
    length_m = 0.01 * slenderness
    pattern = cantilever(length_m, 0.01, through=2, along=3 * slenderness, order=2, poisson=poisson)
    assert _tip_m(pattern, 1.0) == pytest.approx(_beam_tip_m(pattern, length_m, 0.01, 1.0), rel=rel)


def test_elements_of_first_order_lock_in_bending() -> None:
    exact = _beam_tip_m(cantilever(0.1, 0.01, 2, 20, 1), 0.1, 0.01, 1.0)
    share = [_tip_m(cantilever(0.1, 0.01, n, 10 * n, 1), 1.0) / exact for n in (1, 2, 4, 8)]
    assert share == sorted(share)
    # one square element through the thickness misses two fifths, eight two percent
    assert 0.5 < share[0] < 0.65
    assert 0.98 < share[-1] < 1.0


def test_pattern_twice_as_thick_is_twice_as_stiff() -> None:
    mesh = mesh_of_kind("quadrilaterals")
    one, two = (Pattern(mesh, FOOT, thickness_m=b).stiffness for b in (0.1, 0.2))
    assert abs(2.0 * one - two).max() < 1e-12 * abs(two).max()


def _waves(x: Any, d: int) -> tuple[Array, Array]:
    """Displacement that vanishes all round a square or cube, and its gradient."""
    k = np.pi / SIZE_M
    sines = [np.sin(k * x[i]) for i in range(d)]
    cosines = [k * np.cos(k * x[i]) for i in range(d)]
    value = np.prod(sines, axis=0)
    slope = np.array([np.prod([*sines[:i], cosines[i], *sines[i + 1 :]], axis=0) for i in range(d)])
    weight = np.array([1.0, -0.7, 0.4][:d])
    many = (slice(None), *[None] * value.ndim)
    return weight[many] * value, weight[(slice(None), None, *[None] * value.ndim)] * slope


def _errors(
    kind: str, order: int, element_m: float, solve: Callable[[Pattern, Any], Array]
) -> tuple[float, float]:
    """L2 and H1 error of a solution, both relative."""
    sides = tuple(mesh_of_kind(kind).boundaries)
    mesh = mesh_of_kind(kind, element_m, SIZE_M)
    supports = Supports(clamped=sides)
    pattern = Pattern(
        mesh, supports, order=order, thickness_m=THICKNESS_M if mesh.dim() == 2 else None
    )
    # an integration finer than the pattern's own, with the pattern's order of components
    basis = Basis(mesh, ElementVector(pattern.space.basis(1).elem), intorder=2 * order + 3)
    found = basis.interpolate(solve(pattern, basis).ravel())
    place = basis.global_coordinates()
    value, slope = (AMPLITUDE_M * part for part in _waves(place, mesh.dim()))

    @Functional
    def square(w: Any) -> Any:
        return np.sum(w["of"] ** 2, axis=tuple(range(w["of"].ndim - 2)))

    def norm(of: Array) -> float:
        return float(np.sqrt(square.assemble(basis, of=of)))

    return norm(found - value) / norm(value), norm(found.grad - slope) / norm(slope)


def _linear(pattern: Pattern, basis: Any) -> Array:
    return _solved(pattern, basis, large=False)


def _nonlinear(pattern: Pattern, basis: Any) -> Array:
    return _solved(pattern, basis, large=True)


def _solved(pattern: Pattern, basis: Any, large: bool) -> Array:
    """Solution under the body force of the waves, taken in its weak form."""
    d = pattern.space.dimension

    @LinearForm
    def body(v: Any, w: Any) -> Any:
        slope = np.moveaxis(AMPLITUDE_M * _waves(w["x"], d)[1], (0, 1), (-2, -1))
        if large:
            deformation = slope + np.eye(d)
            strain = 0.5 * (np.swapaxes(deformation, -1, -2) @ deformation - np.eye(d))
            stress = deformation @ pattern.foam.stress_pa(strain)
        else:
            stress = pattern.foam.stress_pa(0.5 * (slope + np.swapaxes(slope, -1, -2)))
        return np.sum(np.moveaxis(stress, (-2, -1), (0, 1)) * v.grad, axis=(0, 1))

    load = pattern.space.thickness_m * body.assemble(basis).reshape(-1, d)
    load[pattern.fixed] = 0.0
    return bent_far(pattern, load) if large else pattern.solve_linear(load)


@pytest.mark.parametrize(
    ("kind", "order", "solve", "cells"),
    [
        ("quadrilaterals", 1, _linear, (8, 16)),
        ("quadrilaterals", 2, _linear, (4, 8)),
        ("triangles", 1, _linear, (8, 16)),
        ("triangles", 2, _linear, (4, 8)),
        ("hexahedra", 1, _linear, (4, 8)),
        ("hexahedra", 2, _linear, (2, 4)),
        ("tetrahedra", 2, _linear, (2, 4)),
        ("quadrilaterals", 1, _nonlinear, (8, 16)),
        ("quadrilaterals", 2, _nonlinear, (4, 8)),
        ("triangles", 2, _nonlinear, (4, 8)),
        ("hexahedra", 1, _nonlinear, (2, 4)),
    ],
)
def test_errors_fall_with_the_element_size_at_the_rate_of_the_order(
    kind: str, order: int, solve: Any, cells: tuple[int, int]
) -> None:
    coarse, fine = (_errors(kind, order, SIZE_M / n, solve) for n in cells)
    rates = np.log(np.array(coarse) / fine) / np.log(cells[1] / cells[0])
    # h^(p+1) in L2, h^p in H1; on meshes this coarse the rates are met within a quarter
    assert np.abs(rates - [order + 1, order]).max() < 0.35
