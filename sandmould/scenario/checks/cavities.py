"""What keeps cavities from being measured: their keys, their place, their mouth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sandmould.bad_input import BadInputError, Problem
from sandmould.geometry.geometry import Cavity
from sandmould.geometry.outline import outline_fault
from sandmould.scenario.box import AnyObstacle, Box, Tube, build_scene
from sandmould.scenario.cavities import (
    CAVITY_KINDS,
    CELLS_A_GRAIN,
    AnyCavity,
    BoxCavity,
    CylinderCavity,
    MeshCavity,
    PolygonCavity,
    cavity_grid,
    cavity_space,
    drawn_inside,
    inward,
)
from sandmould.scenario.scenario import Scenario

_MOST_POINTS = 200_000
"""Of the grid that a mouth is tried on."""
_MOST_SOLID = 0.01
"""Share of a cavity that may lie in obstacles: drawings need not agree to the last digit."""
_DRAWN = 50_000
"""Places in the box round a cavity: a share of 5 % comes out to 0.2 %."""
_MOST_SKIN = 0.05
"""The same where the overlap is a skin: a round hole of 12 facets lacks 4.5 % of its circle."""
_SKIN_OF_GRAIN = 0.25
"""Thickness of such a skin over the smallest grain: the middle of a grain keeps half a diameter
from the wall, so half of that still separates it from the skin (argued)."""
_SKIN_OF_WIDTH = 0.1
"""Thickness over the cavity's width up to which an overlap is one of facets, not of the place."""


def cavity_problems(s: Scenario) -> Iterator[Problem]:
    """List what is wrong with the cavities of a scenario whose obstacles have no problems."""
    tubes = [o.name for o in s.obstacles if isinstance(o, Tube)]
    names = [*tubes, *(c.name for c in s.cavities)]
    for i, cavity in enumerate(s.cavities):
        if cavity.name in names[: len(tubes) + i]:
            valid = "a name that no other cavity and no tube has"
            yield Problem(f"cavities.{i}.name", cavity.name, valid)
    faults = [p for i, c in enumerate(s.cavities) for p in _of_keys(s, c, f"cavities.{i}")]
    yield from faults
    if faults:
        return
    for i, (cavity, space) in enumerate(zip(s.cavities, s.scene.cavities, strict=True)):
        yield from _of_place(s, cavity, space, f"cavities.{i}")


def _of_keys(s: Scenario, cavity: AnyCavity, key: str) -> Iterator[Problem]:
    """What no geometry can be made of."""
    kinds = CAVITY_KINDS[s.dimension]
    if cavity.kind not in kinds:
        valid = f"{', '.join(kinds[:-1])} or {kinds[-1]} in {s.dimension}D"
        yield Problem(f"{key}.kind", cavity.kind, valid)
        return
    if isinstance(cavity, BoxCavity):
        for name, value in (("centre_m", cavity.centre_m), ("size_m", cavity.size_m)):
            if len(value) != s.dimension:
                valid = f"{s.dimension} numbers, one a dimension"
                yield Problem(f"{key}.{name}", list(value), valid)
    elif isinstance(cavity, PolygonCavity):
        valid_outline = outline_fault(np.array(cavity.vertices_m))
        if valid_outline is not None:
            vertices = [list(v) for v in cavity.vertices_m]
            yield Problem(f"{key}.vertices_m", vertices, valid_outline)
    try:
        if isinstance(cavity, MeshCavity):
            cavity_space(cavity, s.dimension, key)
        else:
            inward(cavity, s.dimension, key)
    except BadInputError as error:
        yield from error.problems


def _of_place(s: Scenario, cavity: AnyCavity, space: Cavity, key: str) -> Iterator[Problem]:
    """What is wrong with where a cavity lies, one sentence a cavity."""
    place = {"polygon": "vertices_m", "mesh": "position_m"}.get(cavity.kind, "centre_m")
    corners_m = space.space.corners()
    # as far as the seven digits of a drawing's file go
    if not s.box.holds(corners_m, s.dimension, slack=1e-6):
        low, high = (_point(end) for end in (corners_m.min(axis=0), corners_m.max(axis=0)))
        valid = f"a cavity inside the box, {s.box.size_text(s.dimension)}; it goes from {low} to "
        yield Problem(f"{key}.{place}", cavity.name, f"{valid}{high} m")
        return
    grain_m = s.largest_diameter_m
    gate = s.discharge.gate if s.discharge else ""
    found = _tried(s.box, s.obstacles, gate, cavity, s.dimension, grain_m)
    if found.widest_m < grain_m:
        valid = f"a cavity wider than the largest grain, {grain_m:.6g} m"
        yield Problem(f"{key}.kind", f"{cavity.kind} {cavity.name}", valid)
    elif found.solid_share > _MOST_SOLID and _is_skin(s, found):
        if (
            found.solid_share > _MOST_SKIN
            or found.deepest_m > _SKIN_OF_GRAIN * s.sand.classes(s.dimension)[0].diameter_m
        ):
            overlap = f"About {100 * found.solid_share:.0f} % of this one"
            valid = (
                f"a cavity whose facets fit those of the part. {overlap} lies in the part, up to "
                f"{1e3 * found.deepest_m:.2g} mm deep. Export both drawings with finer facets, or "
                "make the cavity a little smaller"
            )
            if isinstance(cavity, MeshCavity):
                yield Problem(f"{key}.file", cavity.file, valid)
            else:
                yield Problem(f"{key}.{place}", cavity.name, valid)
    elif found.solid_share > _MOST_SOLID:
        share = f"about {100 * found.solid_share:.0f} %"
        valid = f"a cavity in free space; {share} of this one lies in obstacles"
        yield Problem(f"{key}.{place}", cavity.name, valid)
    elif found.is_shut:
        stated = cavity.opens if isinstance(cavity.opens, str) else list(cavity.opens)
        valid = (
            "a side where the largest grain can come in: nothing as wide as its "
            f"{grain_m:.6g} m leads from there into {cavity.name}"
        )
        yield Problem(f"{key}.opens", stated, valid)


def free_share(s: Scenario, number: int) -> float:
    """Share of a cavity that no obstacle fills: what facets leave of it among meshes, else 1.

    ``number``: of the cavity, from 0.
    """
    if not s.scene.meshes:
        return 1.0
    gate = s.discharge.gate if s.discharge else ""
    cavity, grain_m = s.cavities[number], s.largest_diameter_m
    return 1.0 - _overlap(s.box, s.obstacles, gate, cavity, s.dimension, grain_m)[0]


def _is_skin(s: Scenario, found: _Trial) -> bool:
    """Whether a cavity overlaps the facets of a part in a thin layer alone."""
    return bool(s.scene.meshes) and found.deepest_m <= _SKIN_OF_WIDTH * found.widest_m


@dataclass(frozen=True)
class _Trial:
    """How a grain fares at a cavity among solids."""

    widest_m: float
    """Diameter of the largest grain that lies in the cavity; at most what it can be."""
    solid_share: float
    """Of the cavity, what lies in solids."""
    deepest_m: float
    """How deep it does, at most."""
    is_shut: bool
    """Whether no way leads a grain in through the mouth; never said of one that is hardly open."""


@lru_cache(maxsize=64)
def _tried(
    box: Box,
    obstacles: tuple[AnyObstacle, ...],
    gate: str,
    cavity: AnyCavity,
    dimension: int,
    grain_m: float,
) -> _Trial:
    """Try a cavity on a grid, once for all points of a sweep that have it."""
    from scipy.ndimage import label  # slow to import, and few scenes have cavities

    scene = build_scene(box, obstacles, dimension).without(gate)
    space = cavity_space(cavity, dimension, "cavities")
    grid = cavity_grid(space, grain_m / CELLS_A_GRAIN[dimension], _MOST_POINTS, margin_m=grain_m)
    # no place is farther than this from a point of the grid
    slack_m = 0.5 * float(np.linalg.norm(grid.spacing_m))
    points_m = grid.points_m.reshape(-1, dimension)
    depth_m = space.depth_m(points_m).reshape(grid.inside_m.shape)
    inside, before = grid.inside_m > 0.0, (depth_m < 0.0) & (depth_m > -grain_m)
    asked = inside | before
    clear_m = np.full(asked.shape, -np.inf)
    clear_m[asked] = scene.clearance_m(grid.points_m[asked], grain_m)
    if isinstance(cavity, BoxCavity):
        widest_m = min(cavity.size_m)
    elif isinstance(cavity, CylinderCavity):
        widest_m = min(cavity.diameter_m, cavity.length_m)
    else:
        widest_m = 2.0 * (float(grid.inside_m.max()) + slack_m)
    solid_share, deepest_m = _overlap(box, obstacles, gate, cavity, dimension, grain_m)
    # where the middle of a grain may come
    free = clear_m >= 0.5 * grain_m - slack_m
    way, _ = label(free, structure=np.ones((3,) * dimension))
    leads_in = np.intersect1d(way[free & inside], way[free & before])
    return _Trial(
        widest_m=widest_m,
        deepest_m=deepest_m,
        solid_share=solid_share,
        is_shut=slack_m < 0.5 * grain_m and not len(leads_in),
    )


@lru_cache(maxsize=64)
def _overlap(
    box: Box,
    obstacles: tuple[AnyObstacle, ...],
    gate: str,
    cavity: AnyCavity,
    dimension: int,
    reach_m: float,
) -> tuple[float, float]:
    """Share of a cavity that lies in solids, and how deep it does, up to a reach."""
    scene = build_scene(box, obstacles, dimension).without(gate)
    space = cavity_space(cavity, dimension, "cavities")
    inside_m = drawn_inside(space, _DRAWN)
    clear_m = scene.clearance_m(inside_m, reach_m)
    share = float((clear_m < 0.0).sum() / max(1, len(inside_m)))
    return share, max(0.0, -float(clear_m.min(initial=0.0)))


def _point(place_m: np.ndarray) -> str:
    return f"({', '.join(f'{x:.4g}' for x in place_m.tolist())})"
