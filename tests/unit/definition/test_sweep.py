"""Designs of a sweep: how many points, where they lie, and that a seed repeats them."""

from __future__ import annotations

from typing import Any

import pytest

from sandmould.bad_input import Problem
from sandmould.definition.sweep import (
    Range,
    Sweep,
    is_whole,
    points,
    problems,
    value_at,
)
from sandmould.limits import RUNS
from sandmould.scenario.casting.flow import MetalFlow
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.reading import Origin, validated
from sandmould.scenario.scenario import Scenario

SCENE = Scenario(seed=1)
BASE = SCENE.model_dump(mode="json")
SCALE, CLASSES, FRICTION = "sand.size_scale", "sand.size_classes", "contact.grain_grain.friction"


def sweep_of(**tree: Any) -> Sweep:
    return validated(Sweep, tree, Origin())


def told(sweep: Sweep, replicates: int = 1) -> list[Problem]:
    return problems(sweep, SCENE, replicates)


def test_grid_takes_all_combinations_last_key_fastest() -> None:
    sweep = sweep_of(keys={SCALE: [4, 6, 8], FRICTION: [0.2, 0.8]})
    found = points(sweep, SCENE)
    assert sweep.number_of_points == len(found) == 6
    assert found[:3] == [
        {SCALE: 4, FRICTION: 0.2},
        {SCALE: 4, FRICTION: 0.8},
        {SCALE: 6, FRICTION: 0.2},
    ]


def test_nothing_swept_is_one_point() -> None:
    assert points(Sweep(), SCENE) == [{}]
    assert Sweep().number_of_points == 1


def test_zipped_takes_values_together() -> None:
    sweep = sweep_of(design="zipped", keys={SCALE: [4, 6], FRICTION: [0.2, 0.8]})
    assert points(sweep, SCENE) == [{SCALE: 4, FRICTION: 0.2}, {SCALE: 6, FRICTION: 0.8}]
    assert sweep.number_of_points == 2


def test_zipped_lists_of_different_length_are_refused() -> None:
    sweep = sweep_of(design="zipped", keys={SCALE: [4, 6, 8], FRICTION: [0.2, 0.8]})
    assert told(sweep) == [
        Problem(f"sweep.keys.{FRICTION}", "2 values", f"3 values, as many as {SCALE} has")
    ]


def test_list_takes_the_points_as_given() -> None:
    given = [{SCALE: 4, FRICTION: 0.2}, {FRICTION: 0.8, SCALE: 5}]
    sweep = sweep_of(design="list", points=given)
    assert told(sweep) == []
    assert points(sweep, SCENE) == given
    assert sweep.number_of_points == 2


def test_range_steps_evenly_or_by_ratios() -> None:
    even = Range(low=1, high=4, number=4)
    assert points(sweep_of(keys={SCALE: even.model_dump()}), SCENE) == [
        {SCALE: 1.0},
        {SCALE: 2.0},
        {SCALE: 3.0},
        {SCALE: 4.0},
    ]
    ratios = {"low": 1, "high": 100, "number": 3, "spacing": "log"}
    assert [p[SCALE] for p in points(sweep_of(keys={SCALE: ratios}), SCENE)] == [1.0, 10.0, 100.0]


@pytest.mark.parametrize("design", ["latin_hypercube", "sobol"])
def test_drawn_points_lie_within_bounds_and_repeat(design: str) -> None:
    keys = {
        SCALE: {"low": 4, "high": 8},
        FRICTION: {"low": 0.01, "high": 1, "spacing": "log"},
        CLASSES: {"low": 2, "high": 6},
        "contact.no_tension": ["total", "elastic"],
    }
    sweep = sweep_of(design=design, keys=keys, samples=32)
    assert told(sweep) == []
    found = points(sweep, Scenario(seed=3))
    assert sweep.number_of_points == len(found) == 32
    assert all(4 <= p[SCALE] <= 8 and 0.01 <= p[FRICTION] <= 1 for p in found)
    # Half of a log range lies below its geometric mean.
    assert sum(p[FRICTION] < 0.1 for p in found) == 16
    assert {p[CLASSES] for p in found} == {2, 3, 4, 5, 6}
    assert all(type(p[CLASSES]) is int for p in found)
    assert sum(p["contact.no_tension"] == "total" for p in found) == 16
    assert points(sweep, Scenario(seed=3)) == found
    assert points(sweep, Scenario(seed=4)) != found


def test_latin_hypercube_has_one_point_in_each_stratum() -> None:
    sweep = sweep_of(design="latin_hypercube", keys={SCALE: {"low": 0.1, "high": 10.1}}, samples=10)
    assert sorted(int(p[SCALE] - 0.1) for p in points(sweep, SCENE)) == list(range(10))


def test_sobol_wants_a_power_of_two() -> None:
    sweep = sweep_of(design="sobol", keys={SCALE: {"low": 4, "high": 8}}, samples=100)
    assert told(sweep) == [
        Problem(
            "sweep.samples",
            100,
            "a power of two, 64 or 128: Sobol points are balanced only then",
        )
    ]


@pytest.mark.parametrize(
    ("tree", "key"),
    [
        ({"keys": {SCALE: {"low": 4, "high": 8}}}, f"sweep.keys.{SCALE}.number"),
        ({"keys": {SCALE: [4]}, "samples": 4}, "sweep.samples"),
        ({"keys": {SCALE: [4]}, "points": [{SCALE: 4}]}, "sweep.points"),
        ({"design": "zipped"}, "sweep.keys"),
        ({"design": "sobol", "samples": 4}, "sweep.keys"),
        ({"design": "sobol", "keys": {SCALE: {"low": 4, "high": 8}}}, "sweep.samples"),
        ({"design": "list"}, "sweep.points"),
        ({"design": "list", "points": [{}]}, "sweep.points"),
        ({"design": "list", "points": [{SCALE: 4}], "keys": {FRICTION: [1]}}, "sweep.keys"),
        ({"design": "list", "points": [{SCALE: 4}, {FRICTION: 1}]}, "sweep.points.1"),
        ({"design": "list", "points": [{"sand.size": 4}]}, "sweep.points.0.sand.size"),
        ({"keys": {"seed": [1, 2]}}, "sweep.keys.seed"),
        ({"keys": {"sand": [{}], SCALE: [4]}}, "sweep.keys.sand"),
        ({"keys": {CLASSES: {"low": 1.5, "high": 4, "number": 2}}}, f"sweep.keys.{CLASSES}.low"),
    ],
)
def test_design_that_does_not_fit_its_parts_is_refused(tree: dict[str, Any], key: str) -> None:
    assert [p.key for p in told(sweep_of(**tree))] == [key]


def test_too_many_runs_are_refused_before_they_are_made() -> None:
    many = {"low": 0.1, "high": 9, "number": 10_000}
    sweep = sweep_of(keys={SCALE: many, FRICTION: many})
    assert told(sweep) == [
        Problem(
            "sweep", "100,000,000 runs", "at most 10,000 runs: fewer points, replicates or rounds"
        )
    ]
    assert told(sweep_of(keys={SCALE: [4, 6]}), replicates=RUNS.most)[0].key == "sweep"


def test_whole_numbers_are_known_by_their_type() -> None:
    assert is_whole(Scenario, "sand.size_classes")
    assert is_whole(Scenario, "fill.layers.0.count")
    assert is_whole(Scenario, "obstacles.0.facets")
    assert not is_whole(Scenario, "sand.size_scale")
    assert not is_whole(Scenario, "contact.no_tension")
    assert not is_whole(Scenario, "no.such.key")
    assert is_whole(MetalFlow, "relaxations")
    assert not is_whole(MetalFlow, "dt_max_s")
    assert is_whole(Solidification, "threads")


def test_value_at_follows_lists_and_refuses_what_is_not_there() -> None:
    assert value_at(BASE, "sand.sieve.1.opening_m") == 0.355e-3
    for key in ("", "sand.", "sand.sieve.99", "sand.sieve.-1", "sand.sieve.²", "fill.layers.x"):
        with pytest.raises(KeyError):
            value_at(BASE, key)
