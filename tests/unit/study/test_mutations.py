"""Shipped studies changed at random, by the schema's keys: they open, or tell what is wrong."""

from __future__ import annotations

import copy
import functools
import json
import math
import tempfile
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.definition.sweep import key_paths, value_at
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

SCHEMA = json.loads((ROOT / "config" / "schema.json").read_text(encoding="utf-8"))
STUDIES = sorted((ROOT / "config").glob("*/tube*.yaml"))
KEYS = sorted(
    {key for part in (SCHEMA, *SCHEMA["$defs"].values()) for key in part.get("properties", {})}
)


def paths_of(tree: Any, above: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Every path of a tree, sections and list entries included."""
    items: list[tuple[str | int, Any]] = []
    if isinstance(tree, dict):
        items = list(tree.items())
    elif isinstance(tree, list):
        items = list(enumerate(tree))
    found = []
    for name, value in items:
        found += [(*above, name), *paths_of(value, (*above, name))]
    return found


def schema_paths(part: dict[str, Any], depth: int = 5) -> list[tuple[str | int, ...]]:
    """Every path that the schema knows, lists entered at their first entry."""
    found: list[tuple[str | int, ...]] = []
    if depth == 0:
        return found
    if "$ref" in part:
        return schema_paths(SCHEMA["$defs"][part["$ref"].rsplit("/", 1)[1]], depth)
    for choice in (*part.get("anyOf", []), *part.get("oneOf", [])):
        found += schema_paths(choice, depth)
    if "items" in part:
        found += [(0, *path) for path in schema_paths(part["items"], depth)]
    for name, inner in part.get("properties", {}).items():
        found += [(name,), *((name, *path) for path in schema_paths(inner, depth - 1))]
    return found


SCHEMA_PATHS = sorted(set(schema_paths(SCHEMA)), key=str)

# What a slip of the keyboard or a program can leave in a file.
values = st.one_of(
    st.sampled_from(
        [
            *(None, True, False, "", "fast", "a\nb", "tube", [], {}, [[]], {"a": 1}, [None]),
            *(math.nan, math.inf, -math.inf, 0, -1, 2, 3, 0.5, 1e300, -1e300, 1e-300),
            *(10**30, 10**400, [1, 2, 3], ["sand.size_scale"]),
            {"value": 1, "source": "x"},
            {"value": None, "unit": "m", "source": ["x"]},
            {"low": 0.1, "high": 9, "number": 3},
        ]
    ),
    st.floats(),
    st.integers(-(10**12), 10**12),
    st.floats(min_value=0, max_value=1, exclude_min=True),
    st.text(max_size=6),
    st.lists(st.floats(allow_nan=False), max_size=4),
)


def put(tree: Any, path: tuple[str | int, ...], value: Any) -> None:
    """Lay a value into a tree of YAML, making what is missing on the way."""
    *parents, last = path
    # Drawn lists and mappings are shared between examples.
    value = copy.deepcopy(value)
    for n, part in enumerate(parents):
        made: Any = [] if isinstance(path[n + 1], int) else {}
        if isinstance(tree, dict):
            if not isinstance(tree.get(part), type(made)):
                tree[part] = made
            tree = tree[part]
        else:
            if not tree or not isinstance(tree[0], type(made)):
                tree[:1] = [made]
            tree = tree[0]
    if isinstance(tree, dict):
        tree[last] = value
    else:
        tree[:1] = [value]


def remove(tree: Any, path: tuple[str | int, ...]) -> None:
    """Take an existing key out of a tree of YAML."""
    for part in path[:-1]:
        tree = tree[part]
    del tree[path[-1]]


@st.composite
def mutated_studies(draw: st.DrawFn) -> Any:
    """A shipped study with one to three keys changed, added or removed."""
    chosen = draw(st.sampled_from(STUDIES))
    tree = yaml.safe_load(chosen.read_text(encoding="utf-8"))
    for _ in range(draw(st.integers(1, 3))):
        existing = paths_of(tree)
        kind = draw(st.sampled_from(["schema", "existing", "unknown", "remove", "double", "sweep"]))
        if kind == "schema":
            put(tree, draw(st.sampled_from(SCHEMA_PATHS)), draw(values))
        elif kind == "sweep":
            key = draw(st.sampled_from(["sand.size_scale", "fill.layers", "vibration.0", "seed"])
                       | st.sampled_from(KEYS) | st.text(max_size=9))  # fmt: skip
            put(tree, ("sweep", "keys", key), draw(values | st.lists(values, max_size=3)))
        elif existing:
            path = draw(st.sampled_from(existing))
            if kind == "remove":
                remove(tree, path)
            elif kind == "double" and isinstance(path[-1], int):
                put(tree, path[:-1], [draw(values), draw(values)])
            elif kind == "unknown":
                put(tree, (*path[:-1], draw(st.text(max_size=5) | st.sampled_from(KEYS))), 1)
            else:
                put(tree, path, draw(values))
    return tree


def opens_or_tells(data: bytes) -> None:
    """Open and expand into runs; only BadInputError with a file in every line may come instead."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trial.yaml"
        path.write_bytes(data)
        files = [str(path), *(str(s.relative_to(ROOT)) for s in STUDIES), "config/materials/"]
        try:
            runs = expand(open_study(path))
        except BadInputError as error:
            lines = str(error).split("\n")
            assert lines
            for line, problem in zip(lines, error.problems, strict=True):
                assert line.startswith(tuple(files)), line
                if not problem.sentence:
                    assert " = " in line
                    assert "cannot be used: valid is " in line
        else:
            assert runs


@functools.cache
def resolved(study: Path) -> Any:
    """Give the resolved scenario of a shipped study as a tree."""
    return open_study(study).study.scenario.model_dump(mode="json")


@functools.cache
def numbers(study: Path) -> list[str]:
    """Keys of the scenario of a shipped study that hold a number."""
    tree = resolved(study)
    return [key for key in key_paths(tree) if type(value_at(tree, key)) in (int, float)]


TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=60)
magnitudes = st.one_of(
    st.floats(-6, 3).map(lambda e: 10.0**e),
    st.floats(-323, 308).map(lambda e: 10.0**e),
    st.floats(allow_nan=False),
    st.integers(-2, 10**9),
)


@st.composite
def scaled_studies(draw: st.DrawFn) -> Any:
    """A shipped study with numbers of its scenario changed or swept by orders of magnitude."""
    chosen = draw(st.sampled_from(STUDIES))
    tree: Any = {"based_on": chosen.stem, "sweep": {"keys": {}}}
    scenario = copy.deepcopy(resolved(chosen))
    for key in draw(st.lists(st.sampled_from(numbers(chosen)), min_size=1, max_size=3)):
        if draw(st.booleans()):
            above, _, last = key.rpartition(".")
            (value_at(scenario, above) if above else scenario)[last] = draw(magnitudes)
        elif draw(st.booleans()):
            tree["sweep"]["keys"][key] = draw(st.lists(magnitudes, min_size=1, max_size=3))
        else:
            bounds = {"low": draw(magnitudes), "high": draw(magnitudes), "number": 3}
            bounds["spacing"] = draw(st.sampled_from(["linear", "log"]))
            tree["sweep"]["keys"][key] = bounds
    tree["scenario"] = scenario
    design = draw(st.sampled_from(["grid", "grid", "zipped", "latin_hypercube", "sobol"]))
    if design != "grid":
        tree["sweep"]["design"] = design
    if design in ("latin_hypercube", "sobol"):
        tree["sweep"]["samples"] = draw(st.sampled_from([2, 4, 5]))
    return tree


@pytest.mark.slow
@settings(
    max_examples=200,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
@given(tree=mutated_studies())
def test_mutated_study_opens_or_tells(tree: Any) -> None:
    opens_or_tells(yaml.safe_dump(tree).encode())


@pytest.mark.slow
@settings(
    max_examples=150,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
@given(tree=scaled_studies())
def test_scaled_study_opens_or_tells(tree: Any) -> None:
    opens_or_tells(yaml.safe_dump(tree).encode())


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    data=st.binary(max_size=60) | st.text(max_size=60).map(lambda t: t.encode("utf-8", "replace"))
)
def test_any_bytes_open_or_tell(data: bytes) -> None:
    opens_or_tells(data)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(cut=st.integers(0, 2000), study=st.sampled_from(STUDIES))
def test_cut_study_opens_or_tells(cut: int, study: Path) -> None:
    opens_or_tells(study.read_bytes()[:cut])
