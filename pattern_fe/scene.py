"""A scenario's pattern as an elastic body."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshHex
from threadpoolctl import threadpool_limits

from sandmould.bad_input import BadInputError, Problem
from sandmould.geometry.mesh import TriangleMesh
from sandmould.limits import PATTERN_ELEMENTS, SOLID_EQUATIONS
from sandmould.pattern_fe.checks import check_inside, check_mesh
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.mesh_file import read_mesh
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.shapes import bar, l_shape, mesh_of, name_of, side_by_side
from sandmould.pattern_fe.supports import Supports
from sandmould.pattern_fe.surroundings import Surroundings
from sandmould.pattern_fe.volume_mesh import drawing_mesh
from sandmould.scenario.pattern import Bar, Loop, LShape, MeshFile, PatternConfig, PatternDrawing
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import drawn_surface, unit_hint

Array = NDArray[np.float64]


def pattern_of(scenario: Scenario) -> Pattern:
    """The pattern of a scenario that has one.

    Raises
    ------
    BadInputError
        With one sentence on what keeps it from being computed.
    """
    config = scenario.pattern
    assert config is not None
    box, d = scenario.box, scenario.dimension
    for body, key in zip(config.bodies, _keys(config), strict=True):
        if len(body.position_m) != d:
            valid = f"{d} numbers, one a dimension"
            raise BadInputError([Problem(f"{key}.position_m", list(body.position_m), valid)])
        has_depth = isinstance(body.shape, MeshFile | PatternDrawing)
        if body.depth_m is not None and (d == 2 or has_depth):
            valid = "null in 2D and for a file, which has its own"
            raise BadInputError([Problem(f"{key}.depth_m", body.depth_m, valid)])
        _check_elements(body, box.depth_m if d == 3 else None)
    # what is shared by all runs of a study that differ in their sand or their loop
    alike = config.model_copy(update={"loop": Loop()})
    size_m = (box.width_m, box.height_m) if d == 2 else (box.width_m, box.depth_m, box.height_m)
    thickness_m = scenario.sand.thickness_m if d == 2 else None
    return _computed(alike, size_m, thickness_m, tuple(map(_changed_ns, config.bodies)))


def _keys(config: PatternConfig) -> list[str]:
    """Where a scenario tells the bodies of a cluster."""
    return ["pattern", *(f"pattern.others.{n}" for n in range(len(config.others or ())))]


def _check_elements(config: PatternConfig, box_depth_m: float | None) -> None:
    """Refuse more elements than can be solved; a mesh file has its own, drawings are counted."""
    shape = config.shape
    if isinstance(shape, MeshFile | PatternDrawing):
        return
    across_m = shape.reach_m if isinstance(shape, LShape) else shape.width_m
    sides_m = [across_m, shape.height_m]
    if box_depth_m is not None:
        sides_m.append(config.depth_m or box_depth_m)
    elements = math.prod(side_m / config.element_m for side_m in sides_m)
    PATTERN_ELEMENTS.check("pattern.element_m", elements, config.element_m)


def surroundings_of(scenario: Scenario, pattern: Pattern) -> Surroundings:
    """What the pattern of a scenario can touch beside the sand."""
    config = scenario.pattern
    assert config is not None
    return pattern.surrounded(scenario.scene, config.name, config.loop.largest_displacement_m)


def _changed_ns(config: PatternConfig) -> int:
    """When the file of a pattern was last changed, 0 without one."""
    shape = config.shape
    if isinstance(shape, MeshFile | PatternDrawing) and shape.path.is_file():
        return shape.path.stat().st_mtime_ns
    return 0


@lru_cache(maxsize=8)
def _computed(
    config: PatternConfig,
    size_m: tuple[float, ...],
    thickness_m: float | None,
    changed_ns: tuple[int, ...],
) -> Pattern:
    """The pattern of a section in a box; its matrices stay with it."""
    _refuse_cluster(config, len(size_m))
    meshes, equations = [], 0
    for body, key in zip(config.bodies, _keys(config), strict=True):
        shape = body.shape
        named = shape.file if isinstance(shape, MeshFile | PatternDrawing) else shape.model_dump()
        with _blaming(f"{key}.shape", named):
            meshes.append(_mesh(body, size_m).translated(np.array(body.position_m)))
            check_mesh(meshes[-1])
        with _blaming(f"{key}.position_m", list(body.position_m)):
            check_inside(meshes[-1].p.T, np.zeros(len(size_m)), np.array(size_m))
        if isinstance(meshes[-1], MeshHex):
            # of each element its own nodes; those of the surface come to them
            equations += 3 * config.order**3 * meshes[-1].nelements
            asked: tuple[str, Any] = ("pattern.element_m", config.element_m)
            if isinstance(shape, MeshFile):
                asked = (f"{key}.shape.file", shape.file)
            SOLID_EQUATIONS.check(asked[0], equations, asked[1])
    with _blaming("pattern.others", f"{len(meshes) - 1} patterns"):
        mesh = side_by_side(meshes)
    # Threads of small matrices wait for one another, longest beside other runs.
    held = [body.supports.model_dump(mode="json", exclude_none=True) for body in config.bodies]
    with threadpool_limits(1), _blaming("pattern.supports", held if config.others else held[0]):
        pattern = Pattern(
            mesh,
            _supports(config),
            Foam(config.young_modulus_pa, config.poisson_ratio, config.density_kg_m3),
            config.order,
            thickness_m,
        )
        if not config.supports.free:
            pattern.solve_linear(np.zeros_like(pattern.space.node_m))
    return pattern


def _refuse_cluster(config: PatternConfig, dimension: int) -> None:
    """Refuse further patterns where there is room for one alone."""
    valid = ""
    if dimension == 2:
        valid = "absent in 2D, where sand meets one outline; a scene in 3D holds several patterns"
    elif any(body.supports.free or body.supports.bedding_n_m3 for body in config.bodies):
        valid = "absent beside supports.free or bedding_n_m3; clamped, resting and hung hold each"
    if config.others and valid:
        raise BadInputError([Problem("pattern.others", f"{len(config.others)} patterns", valid)])


def _supports(config: PatternConfig) -> Supports:
    """What holds the pattern; a ValueError where a free one is held by something else too."""
    given = config.supports
    ways = ("clamped", "resting", "hung", "bedding_n_m3")
    held = [name for name in ways if getattr(given, name)]
    if given.free and held:
        valid = f"valid is without {', '.join(held)}: [] or null for each"
        raise ValueError(f"a free pattern is held by sand alone, {valid}")
    of_all = [body.supports for body in config.bodies]
    named = list(enumerate(of_all))
    return Supports(
        tuple(name_of(side, n) for n, supports in named for side in supports.clamped),
        tuple(name_of(side, n) for n, supports in named for side in supports.resting),
        given.bedding_n_m3 or 0.0,
        tuple((box.low_m, box.high_m) for supports in of_all for box in supports.hung or ()),
    )


def _mesh(config: PatternConfig, size_m: tuple[float, ...]) -> Any:
    shape = config.shape
    if isinstance(shape, MeshFile):
        mesh = read_mesh(shape.path, shape.unit_m)
        if mesh.dim() != len(size_m):
            valid = f"a mesh in {len(size_m)}D as the scene"
            raise ValueError(f"mesh file {shape.path.name} is in {mesh.dim()}D, valid is {valid}")
        return mesh
    if isinstance(shape, PatternDrawing):
        if len(size_m) == 2:
            raise ValueError("a drawing is a solid, valid in 3D; draw a mesh in 2D for kind: file")
        vertices_m, triangles = drawn_surface(shape, "pattern.shape")
        # before it is meshed: in the wrong unit it would have millions of elements
        box_m = np.array(size_m)
        hint = unit_hint(shape, np.ptp(vertices_m, axis=0), box_m)
        with _blaming("pattern.position_m", list(config.position_m)):
            check_inside(vertices_m + np.array(config.position_m), np.zeros(3), box_m, hint)
        return drawing_mesh(shape, TriangleMesh("drawing", vertices_m, triangles), config.element_m)
    depth_m = None
    if len(size_m) == 3:
        depth_m = size_m[1] - config.position_m[1] if config.depth_m is None else config.depth_m
    if isinstance(shape, Bar):
        return mesh_of(bar(shape.width_m, shape.height_m), config.element_m, depth_m)
    if shape.thickness_m >= min(shape.height_m, shape.reach_m):
        valid = "below its height and its reach"
        raise ValueError(f"thickness is {shape.thickness_m:g} m, valid is {valid}")
    rectangles = l_shape(shape.thickness_m, shape.height_m, shape.reach_m)
    return mesh_of(rectangles, config.element_m, depth_m)


@contextmanager
def _blaming(key: str, value: Any) -> Iterator[None]:
    """Tell what is wrong with a pattern at the key that holds it."""
    try:
        yield
    except BadInputError:
        raise
    except ValueError as fault:
        valid = f"one that can be computed: {fault}"
        raise BadInputError([Problem(key, value, valid)]) from fault
