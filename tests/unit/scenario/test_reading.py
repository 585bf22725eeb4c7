"""YAML as users write it, and where every value came from."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sandmould.bad_input import BadInputError, Problem
from sandmould.scenario.quantity import fields_at, keys_at
from sandmould.scenario.reading import Origin, merge, read_planned, read_yaml, validated
from sandmould.scenario.scenario import Scenario


def read(folder: Path, text: str) -> dict[str, object]:
    path = folder / "trial.yaml"
    path.write_text(text, encoding="utf-8")
    return read_yaml(path, "trial.yaml")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("7e4", 7e4),
        ("1E-3", 1e-3),
        ("-.5", -0.5),
        ("3", 3),
        ("3.", 3.0),
        ("vertical", "vertical"),
        ("'7e4'", "7e4"),
        ("null", None),
        ("true", True),
    ],
)
def test_numbers_are_read_as_engineers_write_them(text: str, value: object, tmp_path: Path) -> None:
    found = read(tmp_path, f"a: {text}")["a"]
    assert found == value
    assert type(found) is type(value)
    planned = read_planned(tmp_path / "trial.yaml", "trial.yaml")["a"]
    assert (planned, type(planned)) == (value, type(value))


def test_key_that_stands_twice_is_refused_at_any_depth(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="line 2 cannot be read as YAML: key 'c' stands twice"):
        read(tmp_path, "a:\n  b: {c: 1, c: 2}")


def test_aliases_can_repeat_a_section(tmp_path: Path) -> None:
    tree = read(tmp_path, "a: &law {friction: 0.5}\nb: *law")
    assert tree == {"a": {"friction": 0.5}, "b": {"friction": 0.5}}


def test_mappings_merge_and_lists_replace() -> None:
    origin = Origin()
    base = merge({}, {"a": {"x": 1, "y": 2}, "l": [1, 2]}, origin, "base")
    both = merge(base, {"a": {"y": 3}, "l": [4]}, origin, "own")
    assert both == {"a": {"x": 1, "y": 3}, "l": [4]}
    assert base == {"a": {"x": 1, "y": 2}, "l": [1, 2]}
    assert origin.file_of("a.x") == "base"
    assert origin.file_of("a.y") == origin.file_of("l.0") == "own"
    assert origin.source_of("l.1") is None


def test_sourced_leaf_is_unwrapped_and_its_source_kept() -> None:
    origin = Origin()
    leaf = {"value": [1, 2], "unit": "m", "source": "a book"}
    assert merge({}, {"a": leaf}, origin, "f") == {"a": [1, 2]}
    assert origin.source_of("a") == origin.source_of("a.1") == "a book"
    assert origin.file_of("a.1") == "f"


def test_section_over_a_value_forgets_where_the_value_came_from() -> None:
    origin = Origin()
    base = merge({}, {"a": {"value": None, "source": "a book"}}, origin, "base")
    assert merge(base, {"a": {"x": 1}}, origin, "own") == {"a": {"x": 1}}
    assert origin.source_of("a.x") == "own"
    assert origin.source_of("a.y") is None


def told(tree: dict[str, object]) -> list[Problem]:
    with pytest.raises(BadInputError) as caught:
        validated(Scenario, tree, Origin({"": "f"}))
    return list(caught.value.problems)


def test_names_of_union_branches_do_not_reach_the_key() -> None:
    tube = {"kind": "tube", "diameter_m": 0, "length_m": 0.1, "left_end_x_m": 0,
            "axis_height_m": 0.1, "tubes": 2}  # fmt: skip
    assert [p.key for p in told({"obstacles": [tube]})] == [
        "obstacles.0.diameter_m",
        "obstacles.0.tubes",
    ]


def test_wrong_entry_of_a_list_is_told_once() -> None:
    (problem,) = told({"vibration": [{"acceleration_g": 1, "direction": [0, "up"]}]})
    assert problem == Problem("vibration.0.direction.1", "up", "a number", "f")


def test_rule_of_a_section_is_told_at_the_section() -> None:
    (problem,) = told({"fill": {"layers": [{"count": 5, "mass_kg": 1}]}})
    assert problem.key == "fill.layers.0"
    assert problem.valid == "exactly one of height_m, mass_kg and count"


def test_keys_of_a_path_are_known_from_the_types() -> None:
    assert keys_at(Scenario, ["box"]) == ["depth_m", "height_m", "width_m"]
    assert "facets" in keys_at(Scenario, ["obstacles", "0"])
    assert keys_at(Scenario, ["seed"]) == []
    (thickness,) = fields_at(Scenario, "obstacles.0.wall_thickness_m")
    assert thickness.description == "Thickness of the tube's wall."
    assert len(fields_at(Scenario, "obstacles.0.name")) == 6
    assert fields_at(Scenario, "") == fields_at(Scenario, "0") == []


@pytest.mark.parametrize("read_file", [read_yaml, read_planned])
def test_a_pipe_and_a_text_nested_without_end_are_sentences(
    read_file: Callable[[Path, str], object], tmp_path: Path
) -> None:
    path = tmp_path / "trial.yaml"
    for opening in ("[", "- ", "{a: ", "? "):
        path.write_text(opening * 100_000)
        with pytest.raises(BadInputError, match=r"trial\.yaml: "):
            read_file(path, "trial.yaml")
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(BadInputError, match="file = 'it is no plain file' cannot be used"):
        read_file(path, "trial.yaml")


@pytest.mark.parametrize("before", [{"free": True}, {"hung": [1], "bedding_n_m3": 2.0}])
@pytest.mark.parametrize("after", [{"free": True}, {"hung": [3]}, {"clamped": []}])
def test_a_pattern_that_becomes_free_or_held_starts_its_supports_anew(
    before: dict[str, Any], after: dict[str, Any]
) -> None:
    both = merge({"supports": before}, {"supports": after}, Origin(), "own")
    is_anew = "free" in {*before, *after} and before != after
    assert both["supports"] == (after if is_anew else {**before, **after})


def test_another_kind_starts_a_section_anew() -> None:
    shape = {"kind": "bar", "width_m": 1, "height_m": 2}
    origin = Origin()
    base = merge({}, {"shape": shape, "box": {"depth_m": 1}}, origin, "base")
    both = merge(base, {"shape": {"kind": "file", "file": "a"}}, origin, "own")
    assert both == {"shape": {"kind": "file", "file": "a"}, "box": {"depth_m": 1}}
    assert "shape.width_m" not in origin.file
    same = merge(base, {"shape": {"kind": "bar", "height_m": 3}}, origin, "own")
    assert same["shape"] == {**shape, "height_m": 3}
