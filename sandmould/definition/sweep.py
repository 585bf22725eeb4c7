"""Sweeps: which keys of a scenario are varied, over which values, in which design."""

from __future__ import annotations

import difflib
import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould.bad_input import Problem
from sandmould.limits import RUNS
from sandmould.scenario.quantity import Section, fields_at, quantity
from sandmould.scenario.reading import Tree
from sandmould.scenario.sand import ARGUED
from sandmould.scenario.standing_keys import instead_of

Design = Literal["grid", "zipped", "list", "latin_hypercube", "sobol"]
Point = dict[str, Any]
"""Values of the swept keys of one point, by key path."""


class Range(Section):
    """Values between two bounds, in the unit of the swept key."""

    low: float = quantity(..., "Lowest value.", unit="of the key", source="user", ge=-1e15, le=1e15)
    high: float = quantity(
        ..., "Highest value.", unit="of the key", source="user", ge=-1e15, le=1e15
    )
    number: int | None = quantity(
        None, "How many values; for grid and zipped designs.", source="user", ge=2, le=RUNS.most
    )
    spacing: Literal["linear", "log"] = quantity(
        "linear", "Equal steps or equal ratios.", source=ARGUED
    )

    @model_validator(mode="after")
    def _order(self) -> Range:
        if self.low >= self.high:
            raise PydanticCustomError("range", "a low smaller than high")
        if self.spacing == "log" and self.low <= 0:
            raise PydanticCustomError("range", "a low greater than 0 when spacing is log")
        return self

    def at(self, share: float) -> float:
        """Value at a share of the way from low to high, to six digits."""
        if self.spacing == "log":
            value = self.low * (self.high / self.low) ** share
        else:
            value = self.low + share * (self.high - self.low)
        return min(max(float(f"{value:.6g}"), self.low), self.high)


class Sweep(Section):
    """What is varied from run to run."""

    design: Design = quantity(
        "grid",
        "grid: all combinations. zipped: first values together, then second ones. list: the given "
        "points. latin_hypercube: samples spread between the bounds. sobol: the same by a Sobol "
        "sequence, whose number is a power of two.",
        source=ARGUED,
    )
    keys: dict[str, Annotated[tuple[Any, ...], Field(min_length=1)] | Range] = Field(
        {},
        description="Values of each swept key, such as vibration.0.frequency_hz: [25, 50]. In a "
        "drawn design a list is a choice among its values.",
    )
    points: tuple[dict[str, Any], ...] = Field(
        (), description="Points of a list design: each a mapping of key paths to values."
    )
    samples: int | None = quantity(
        None, "Points of a drawn design.", source="user", ge=1, le=RUNS.most
    )

    @property
    def is_drawn(self) -> bool:
        """Whether the points are drawn between bounds."""
        return self.design in ("latin_hypercube", "sobol")

    @property
    def swept(self) -> list[str]:
        """Swept key paths, in the order of the file."""
        if self.design == "list":
            return list(self.points[0]) if self.points else []
        return list(self.keys)

    def count(self, key: str) -> int:
        """Number of values of a key in a grid or zipped design."""
        values = self.keys[key]
        return (values.number or 0) if isinstance(values, Range) else len(values)

    @property
    def number_of_points(self) -> int:
        """Number of points, without making them."""
        if self.design == "list":
            return len(self.points)
        if self.is_drawn:
            return self.samples or 0
        counts = [self.count(key) for key in self.keys]
        return math.prod(counts) if self.design == "grid" else min(counts, default=0)


def is_whole(scenario: type[Section], key: str) -> bool:
    """Whether a key takes whole numbers only, in scenarios of a type."""
    types = [f.annotation for f in fields_at(scenario, key)]
    return any(t is int or int in get_args(t) for t in types)


def _between(values: tuple[Any, ...] | Range, whole: bool, share: float) -> Any:
    """Value of a key at a share (0 to 1) of its range, or of its list (0 to below 1)."""
    if not isinstance(values, Range):
        return values[int(share * len(values))]
    value = values.at(share)
    return round(value) if whole else value


def _each(values: tuple[Any, ...] | Range, whole: bool) -> list[Any]:
    if not isinstance(values, Range):
        return list(values)
    number = values.number or 0
    return [_between(values, whole, i / (number - 1)) for i in range(number)]


def _drawn(sweep: Sweep, whole: Mapping[str, bool], seed: int) -> Iterator[Point]:
    # scipy.stats takes a second to import, and most sweeps are grids.
    from scipy.stats import qmc

    dimension, samples = len(sweep.keys), sweep.samples or 0
    sampler = qmc.LatinHypercube if sweep.design == "latin_hypercube" else qmc.Sobol
    for row in sampler(dimension, rng=seed).random(samples):
        yield {
            key: _between(values, whole[key], float(share))
            for (key, values), share in zip(sweep.keys.items(), row, strict=True)
        }


def points(sweep: Sweep, scenario: Any) -> list[Point]:
    """All points of a sweep that has no problems; an empty one where nothing is swept.

    ``scenario``: what is varied: its type says which keys take whole numbers only, its seed fixes
    the points of a drawn design.
    """
    if sweep.design == "list":
        return [dict(p) for p in sweep.points]
    whole = {key: is_whole(type(scenario), key) for key in sweep.keys}
    if sweep.is_drawn:
        return list(_drawn(sweep, whole, scenario.seed))
    columns = [_each(values, whole[key]) for key, values in sweep.keys.items()]
    rows = itertools.product(*columns) if sweep.design == "grid" else zip(*columns, strict=True)
    return [dict(zip(sweep.keys, row, strict=True)) for row in rows]


def value_at(tree: Any, key: str) -> Any:
    """Value at a key path of a resolved scenario.

    Raises
    ------
    KeyError
        When the path leads nowhere.
    """
    for part in key.split("."):
        if isinstance(tree, dict) and part in tree:
            tree = tree[part]
        elif isinstance(tree, list) and part.isdecimal() and int(part) < len(tree):
            tree = tree[int(part)]
        else:
            raise KeyError(key)
    return tree


def key_paths(tree: Tree | list[Any], above: str = "") -> Iterator[str]:
    """Every key path of a resolved scenario, sections and lists included."""
    for name, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
        key = f"{above}.{name}" if above else str(name)
        yield key
        if isinstance(value, dict | list):
            yield from key_paths(value, key)


def problems(sweep: Sweep, scenario: Section, replicates: int) -> list[Problem]:
    """List what keeps a well-typed sweep from being laid over a scenario."""
    misfits = [*_design(sweep), *_paths(sweep, scenario)]
    return misfits or [*RUNS.problems("sweep", sweep.number_of_points * replicates)]


def _design(sweep: Sweep) -> Iterator[Problem]:
    """What the design needs and what it cannot use."""
    design = sweep.design
    if design == "list":
        if sweep.keys:
            yield Problem("sweep.keys", list(sweep.keys), "absent: a list design has points")
        if not any(sweep.points):
            yield Problem("sweep.points", list(sweep.points), "at least one point with one key")
        for i, point in enumerate(sweep.points[1:], start=1):
            if set(point) != set(sweep.points[0]):
                keys = ", ".join(sweep.points[0])
                yield Problem(f"sweep.points.{i}", point, f"a point with the keys {keys}")
        return
    if sweep.points:
        yield Problem("sweep.points", list(sweep.points), "absent unless the design is list")
    if design != "grid" and not sweep.keys:
        yield Problem("sweep.keys", {}, f"at least one key in a {design} design")
    if sweep.is_drawn:
        yield from _samples(sweep)
        return
    if sweep.samples is not None:
        yield Problem("sweep.samples", sweep.samples, "absent unless the design is drawn")
    longest = max(sweep.keys, key=sweep.count, default="")
    for key, values in sweep.keys.items():
        if isinstance(values, Range) and values.number is None:
            yield Problem(f"sweep.keys.{key}.number", None, f"a number of values in a {design}")
        elif design == "zipped" and sweep.count(key) < sweep.count(longest):
            yield Problem(
                f"sweep.keys.{key}",
                f"{sweep.count(key)} values",
                f"{sweep.count(longest)} values, as many as {longest} has",
            )


def _samples(sweep: Sweep) -> Iterator[Problem]:
    n = sweep.samples
    if n is None:
        yield Problem("sweep.samples", None, f"a number of points of the {sweep.design} design")
    elif sweep.design == "sobol" and n & (n - 1):
        below = 1 << (n.bit_length() - 1)
        yield Problem(
            "sweep.samples",
            n,
            f"a power of two, {below} or {2 * below}: Sobol points are balanced only then",
        )


def _paths(sweep: Sweep, scenario: Section) -> Iterator[Problem]:
    """Swept keys that the scenario lacks, or that cannot be swept."""
    base = scenario.model_dump(mode="json")
    above = "sweep.points.0" if sweep.design == "list" else "sweep.keys"
    for key in sweep.swept:
        values = sweep.keys.get(key)
        where = f"{above}.{key}"
        stated = list(values) if isinstance(values, tuple) else key
        if key == "seed":
            yield Problem(where, stated, "any key but the seed: replicates draw their own")
            continue
        try:
            value_at(base, key)
        except KeyError:
            near = difflib.get_close_matches(key, list(key_paths(base)), n=3, cutoff=0.5)
            keys = f"nearest are {', '.join(near)}" if near else "such as sand.size_scale"
            parts = ["scenario", *key.split(".")]
            told = (instead_of(parts[:n]) for n in range(2, len(parts) + 1))
            valid = next(filter(None, told), f"a key of the scenario; {keys}")
            yield Problem(where, stated, valid)
        inside = [k for k in sweep.swept if k.startswith(key + ".")]
        if inside:
            yield Problem(where, stated, f"a key that does not hold another swept one, {inside[0]}")
        if isinstance(values, Range) and is_whole(type(scenario), key):
            for name, bound in (("low", values.low), ("high", values.high)):
                if bound != round(bound):
                    yield Problem(f"{where}.{name}", bound, "a whole number, as the key itself")
