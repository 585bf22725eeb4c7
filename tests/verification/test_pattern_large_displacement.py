"""Large displacements of the pattern: rotation, the elastica, the limit of the elastic law."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from sandmould.pattern_fe.elasticity import element_tangent_n_m, internal_force_n
from sandmould.pattern_fe.large_displacement import LoadNotReachedError, NewtonSettings
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.shapes import bar, mesh_of
from sandmould.pattern_fe.supports import Supports
from tests.patterns import (
    KINDS,
    THICKNESS_M,
    _one_thread,  # noqa: F401
    bent_far,
    cantilever,
    end_load,
    l_pattern,
    pattern_of_kind,
)

Array = NDArray[np.float64]


def _turned(node_m: Array, angle_deg: float) -> Array:
    """Displacement of a rotation about the origin, in the plane of the first two axes."""
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    turn = np.eye(node_m.shape[1])
    turn[:2, :2] = [[c, -s], [s, c]]
    return node_m @ (turn - np.eye(len(turn))).T


@pytest.mark.parametrize("kind", KINDS)
def test_rotation_by_30_degrees_leaves_no_stress_in_the_nonlinear_form(kind: str) -> None:
    pattern = pattern_of_kind(kind, 2)
    moved = _turned(pattern.space.node_m, 30.0)
    young_pa = pattern.foam.young_pa
    assert np.abs(pattern.stress_pa(moved, large=True)).max() < 1e-12 * young_pa
    force = internal_force_n(pattern.space, pattern.foam, moved)
    assert np.abs(force).max() < 1e-12 * young_pa * 0.02**2
    # the linear form takes cos(30) - 1 = -0.13 for a strain
    assert pattern.von_mises_pa(moved, large=False).min() > 0.1 * young_pa * 0.13
    assert np.abs(pattern.stiffness @ moved.ravel()).max() > 1e-3 * young_pa * 0.02**2


@pytest.mark.parametrize("kind", KINDS)
def test_tangent_is_the_slope_of_the_force(kind: str) -> None:
    pattern = pattern_of_kind(kind, 2)
    random = np.random.default_rng(4)
    place, way = (1e-3 * random.standard_normal(pattern.space.node_m.shape) for _ in range(2))
    tangent = pattern.space.assembled(element_tangent_n_m(pattern.space, pattern.foam, place))
    force = [internal_force_n(pattern.space, pattern.foam, place + s * way) for s in (-1e-4, 1e-4)]
    slope = (force[1] - force[0]) / 2e-4
    change = (tangent @ way.ravel()).reshape(slope.shape)
    # central difference of a cubic: error 1e-8 of the third part, round-off 1e-11
    assert np.allclose(change, slope, rtol=0.0, atol=1e-7 * np.abs(slope).max())


def _elastica(load: float) -> tuple[float, float]:
    """Tip of a cantilever of unit length and stiffness under a dead transverse load P L^2/EI."""

    def shape(curvature: float) -> Array:
        def rate(_: float, y: Array) -> list[float]:
            return [y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(rate, (0, 1), [0, curvature, 0, 0], rtol=1e-9, atol=1e-10).y[:, -1]

    clamped = brentq(lambda curvature: shape(curvature)[1], 0.0, load)
    _, _, x, y = shape(clamped)
    return float(x), float(y)


@pytest.mark.parametrize("load", [1.0, 5.0])
def test_cantilever_bends_far_as_the_elastica(load: float) -> None:
    length, height = 0.4, 0.01
    pattern = cantilever(length, height, through=1, along=20, order=2, poisson=0.0)
    stiffness = pattern.foam.young_pa * THICKNESS_M * height**3 / 12.0
    force = end_load(pattern, load * stiffness / length**2)
    right = np.isclose(pattern.space.node_m[:, 0], length)
    tip = bent_far(pattern, force, load_steps=2)[right].mean(axis=0) / length
    x, y = _elastica(load)
    # shear and the strain of the fibres, both of (h/L)^2 = 6e-4 order, which the elastica lacks
    assert tip == pytest.approx([x - 1.0, y], abs=2e-3)
    linear = pattern.solve_linear(force)[right].mean(axis=0) / length
    assert linear[1] == pytest.approx(load / 3.0, rel=2e-3)
    assert abs(linear[1] - y) > 20 * abs(tip[1] - y)


def test_small_loads_give_the_linear_solution() -> None:
    pattern = l_pattern()
    load = pattern.on_nodes(-1e-3 * pattern.surface.vertex_area_vector_m2 * [[1.0, 0.5]])
    linear, large = pattern.solve_linear(load), bent_far(pattern, load)
    # their difference is of the order of the rotation, here 1e-6
    assert np.allclose(large, linear, rtol=0.0, atol=1e-5 * np.abs(linear).max())


def test_load_beyond_the_limit_of_the_law_is_refused_at_the_share_reached() -> None:
    supports = Supports(resting=("left", "bottom"))
    mesh, foam = mesh_of(bar(0.02, 0.01), 0.01), Foam(poisson=0.0)
    # of first order, for which loads by area are those of a uniform stress
    pattern = Pattern(mesh, supports, foam, order=1, thickness_m=THICKNESS_M)
    pressed = end_load(pattern, pattern.foam.young_pa * THICKNESS_M * 0.01)[:, ::-1]
    with pytest.raises(LoadNotReachedError, match=r"no equilibrium beyond 1[6-9]\.\d %") as stop:
        bent_far(pattern, -pressed, smallest_step=1.0 / 64.0)
    # without widening the force is E A s (1 - s^2)/2, at most at the stretch s = 1/sqrt(3)
    limit = 1.0 / (3.0 * np.sqrt(3.0))
    assert limit - 2.0 / 64.0 < stop.value.fraction <= limit


def test_bedding_holds_a_pattern_that_stands_free() -> None:
    pattern = pattern_of_kind("quadrilaterals", 2, Supports(bedding_n_m3=1e5))
    load = np.zeros_like(pattern.surface.vertices_m)
    load[:, 0] = 0.1 * pattern.surface.vertex_area_m2 / pattern.surface.vertex_area_m2.sum()
    # 0.1 N on springs of 1e5 N/m3 over 0.02 m2 of surface; the foam is far stiffer
    whole = pattern.on_nodes(load)
    for moved in (pattern.solve_linear(whole), bent_far(pattern, whole)):
        assert moved == pytest.approx(np.tile([5e-5, 0.0], (len(moved), 1)), abs=1e-9)


def test_number_of_load_steps_must_be_positive() -> None:
    with pytest.raises(ValueError, match="number of load steps is 0, valid is 1 or more"):
        NewtonSettings(load_steps=0)
