"""What holds a pattern: hung in a box, bedded, free; and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.scene import pattern_of
from sandmould.pattern_fe.supports import Supports
from sandmould.scenario.pattern import SupportsConfig
from sandmould.scenario.reading import Origin, validated
from sandmould.scenario.scenario import Scenario
from tests.patterns import _one_thread, mesh_of_kind, pattern_of_kind  # noqa: F401

SCENE: dict[str, Any] = {
    "dimension": 3,
    "box": {"width_m": 0.1, "depth_m": 0.04, "height_m": 0.1},
    "sand": {"size_scale": 6},
    "engine": {"name": "reference"},
}
PLATE: dict[str, Any] = {
    "shape": {"kind": "bar", "width_m": 0.08, "height_m": 0.01},
    "position_m": [0.01, 0.0, 0.03],
    "element_m": 0.02,
}
GATING = {"low_m": [0.0, 0.0, 0.0], "high_m": [0.02, 0.04, 0.1]}


def scene(scheme: str = "aitken", **supports: Any) -> Scenario:
    pattern = {**PLATE, "supports": supports, "loop": {"scheme": scheme}}
    return Scenario.model_validate({**SCENE, "pattern": pattern})


@pytest.mark.parametrize(
    ("told", "clamped"),
    [
        ({}, ("bottom",)),
        ({"resting": ["left"]}, ("bottom",)),
        ({"hung": [GATING]}, ()),
        ({"bedding_n_m3": 1e6}, ()),
        ({"free": True}, ()),
        ({"free": False}, ("bottom",)),
        ({"hung": [GATING], "clamped": ["top"]}, ("top",)),
    ],
)
def test_the_bottom_is_clamped_unless_something_else_holds(
    told: dict[str, Any], clamped: tuple[str, ...]
) -> None:
    supports = validated(SupportsConfig, told, Origin())
    assert supports.clamped == clamped
    # written out and read again, as a run does, it is the same
    assert SupportsConfig.model_validate_json(supports.model_dump_json()) == supports


def test_a_hung_pattern_is_held_where_its_gating_is_and_nowhere_else() -> None:
    pattern = pattern_of(scene(hung=[GATING]))
    held = pattern.space.node_m[:, 0] <= 0.02 + 1e-9
    np.testing.assert_array_equal(pattern.fixed.all(axis=1), held)
    np.testing.assert_array_equal(pattern.fixed.any(axis=1), held)
    assert 0 < held.sum() < len(held)


def test_nodes_inside_a_hung_solid_are_held_in_the_condensed_one_too() -> None:
    corner = ((0.0, 0.0, 0.0), (0.02, 0.02, 0.012))
    mesh = mesh_of_kind("tetrahedra", 0.01)
    pattern = Pattern(mesh, Supports(hung=(corner,)))
    held = pattern.fixed[:, 0]
    inner = np.setdiff1d(np.arange(len(held)), pattern.surface.nodes)
    assert held[inner].any()
    load = np.zeros_like(pattern.space.node_m)
    load[pattern.space.nodes_of("top"), 0] = 1.0
    exact_m = pattern.solve_linear(load)[pattern.surface.nodes].ravel()
    free = ~pattern.condensed.fixed
    stiffness = pattern.condensed.stiffness_n_m[np.ix_(free, free)]
    found_m = np.zeros_like(exact_m)
    found_m[free] = np.linalg.solve(stiffness, load[pattern.surface.nodes].ravel()[free])
    np.testing.assert_allclose(found_m, exact_m, rtol=0.0, atol=1e-9 * np.abs(exact_m).max())


@pytest.mark.parametrize("large", [False, True])
def test_a_plate_under_even_pressure_sinks_evenly_into_its_bedding(large: bool) -> None:
    bedding_n_m3, pressure_pa = 1e6, 300.0
    pattern = pattern_of_kind("hexahedra", 2, Supports(bedding_n_m3=bedding_n_m3))
    body = FoamBody(pattern, large)
    # loads in proportion to the springs of the vertices: exact, for nothing bends
    area_m2 = pattern.surface.vertex_area_m2
    load = np.zeros_like(body.vertices_m)
    load[:, 2] = -pressure_pa * area_m2
    found = body.solve(load)
    sunk_m = pressure_pa / bedding_n_m3
    np.testing.assert_allclose(found.displacement_m[:, 2], -sunk_m, rtol=1e-9)
    weight_n = pressure_pa * area_m2.sum()
    np.testing.assert_allclose(found.reaction_n, [0.0, 0.0, weight_n], atol=1e-9 * weight_n)
    assert found.moment_left_n_m < 1e-9 * weight_n
    assert found.energy_j == pytest.approx(0.5 * weight_n * sunk_m, rel=1e-9)


BELOW = {"low_m": [0.0, 0.0, 0.0], "high_m": [0.1, 0.04, 0.02]}


@pytest.mark.parametrize(
    ("supports", "scheme", "says"),
    [
        ({"hung": [BELOW]}, "aitken", r"supports = .* \(0, 0, 0\) to \(0.1, 0.04, 0.02\) m"),
        ({"hung": [{"low_m": [0, 0], "high_m": [1, 1]}]}, "aitken", "corners of 3 numbers each"),
        ({"free": True, "bedding_n_m3": 1e6}, "in_step", "free pattern is held by sand alone"),
        ({"free": True}, "aitken", r"scheme = 'aitken' .* in_step for a free pattern"),
        ({"resting": ["left"], "clamped": []}, "in_step", "leave it free to"),
    ],
)  # fmt: skip
def test_what_cannot_hold_is_told(supports: dict[str, Any], scheme: str, says: str) -> None:
    with pytest.raises(BadInputError, match=says):
        with_surface(scene(scheme, **supports))
