"""Several patterns in one box: each is held by its own supports and bends as if it were alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.scene import pattern_of
from sandmould.scenario.scenario import Scenario
from tests.patterns import _one_thread  # noqa: F401
from tests.verification.one_grain import RADIUS_M
from tests.verification.test_coupling_in_space import (
    ENGINES,
    TOP_M,
    cantilever_scene,
    opened,
    put_sphere,
    under_point_load,
)

LOWER_TOP_M = 0.008
GATING = {"low_m": [0.0, 0.0, 0.0], "high_m": [0.005, 0.02, 0.05]}
LOWER: dict[str, Any] = {
    "shape": {"kind": "bar", "width_m": 0.019, "height_m": 0.005},
    "position_m": [0.0, 0.006, LOWER_TOP_M - 0.005],
    "depth_m": 0.008,
    "supports": {"hung": [GATING]},
}
"""Beside and below the bar of the scene, hung at its other end."""
ACROSS = {"position_m": [0.01, 0.006, TOP_M - 0.005], "supports": {"clamped": ["left"]}}
"""Through the bar of the scene."""


def cluster(*others: dict[str, Any], **changes: Any) -> Scenario:
    return cantilever_scene(pattern={"others": others or [LOWER]}, **changes)


def lower_alone() -> Scenario:
    return cantilever_scene(pattern=LOWER | {"supports": {"clamped": [], "hung": [GATING]}})


def lower(vertices_m: np.ndarray) -> np.ndarray:
    return np.asarray(vertices_m[:, 0] < 0.0195)


def test_each_bends_under_its_own_loads_as_if_it_were_alone() -> None:
    both = pattern_of(cluster())
    load = np.random.default_rng(1).standard_normal(both.surface.vertices_m.shape)
    moved = both.on_surface(both.solve_linear(both.on_nodes(load)))
    for scenario, is_lower in ((cantilever_scene(), False), (lower_alone(), True)):
        pattern, own = pattern_of(scenario), lower(both.surface.vertices_m) == is_lower
        np.testing.assert_array_equal(both.surface.vertices_m[own], pattern.surface.vertices_m)
        alone = pattern.on_surface(pattern.solve_linear(pattern.on_nodes(load[own])))
        np.testing.assert_allclose(moved[own], alone, rtol=0.0, atol=1e-9 * np.abs(alone).max())


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_a_grain_bends_the_pattern_that_it_lies_on(engine: str, tmp_path: Path) -> None:
    scenario, place = cluster(engine={"name": engine}), [0.0157, 0.0113, LOWER_TOP_M + RADIUS_M]
    session = opened(scenario, tmp_path)
    put_sphere(session, place, [0.0, 0.0, 0.0])
    for _ in range(60):
        session.advance()
    session.close()
    weight_n = scenario.gravity_m_s2 * scenario.sand.grain_mass_kg(2 * RADIUS_M, 3)
    alone = pattern_of(lower_alone())
    exact_m = under_point_load(alone, np.array([*place[:2], LOWER_TOP_M]), weight_n)
    is_lower, largest_m = lower(scenario.scene.meshes[0].vertices_m), np.abs(exact_m).max()
    moved_m = session.displacement_m
    # as that of one cantilever: what is left to sink, and round-off of friction
    np.testing.assert_allclose(moved_m[is_lower], exact_m, rtol=0.0, atol=1e-4 * largest_m)
    np.testing.assert_allclose(moved_m[~is_lower], 0.0, atol=1e-9 * largest_m)
    assert largest_m > 1e-8


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (LOWER | {"supports": {"clamped": []}}, "has supports that leave it free to shift along x"),
        (LOWER | {"supports": {"free": True}}, "valid is absent beside supports.free"),
        (LOWER | ACROSS, "a place clear of the first pattern"),
        (LOWER | {"position_m": [0.04, 0.0, 0.0]}, "pattern.others.0.position_m = "),
        (LOWER | {"supports": {"clamped": ["lid"]}}, "'lid of pattern.others.0'"),
    ],
)  # fmt: skip
def test_a_pattern_that_cannot_stand_beside_the_first_is_refused(
    other: dict[str, Any], said: str
) -> None:
    with pytest.raises(BadInputError) as refused:
        cluster(other)
    assert said in str(refused.value)


def test_a_plane_scene_has_one_pattern() -> None:
    bar = {"shape": {"kind": "bar", "width_m": 0.02, "height_m": 0.01}, "position_m": [0.0, 0.0]}
    scene = {"dimension": 2, "box": {"width_m": 0.1, "height_m": 0.1}, "sand": {"size_scale": 9}}
    other = bar | {"position_m": [0.05, 0.0]}
    with pytest.raises(BadInputError, match="absent in 2D"):
        with_surface(Scenario.model_validate({**scene, "pattern": {**bar, "others": [other]}}))
