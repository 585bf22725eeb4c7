"""Short studies to begin with: templates with comments, filled by what a person knows."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sandmould import SHIPPED
from sandmould.bad_input import BadInputError, Problem
from sandmould.casting.arpm.scene import solids_of
from sandmould.engines.deck import environment
from sandmould.geometry.drawing_file import MeshFileError, tells_unit
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.checks.wall_thickness import thinnest_wall
from sandmould.study.plan.build_plan import Plan, open_plan

_HELD = ("acceleration_g", "velocity_mm_s", "amplitude_mm", "unbalance")
_SHAKEN = {
    "material": "rojek_2004",
    "frequency_hz": (25.0, 140.0),
    "acceleration_g": 1.5,
    "velocity_mm_s": None,
    "amplitude_mm": None,
    "largest_acceleration_g": None,
}
_HOLE = {**_SHAKEN, "unbalance": None, "box_mm": (120.0, 110.0)}
_OPTIONS: dict[str, dict[str, Any]] = {
    "tube": {**_HOLE, "hole_mm": (25.0, 50.0)},
    # 1.5 g raise no sand into a pocket that opens down
    "pocket": {**_HOLE, "hole_mm": (25.0, 40.0), "opens": "down", "acceleration_g": 5.0},
    "part": {**_SHAKEN, "drawing": None},
    "deck": {},
    "casting": {"material": "a356_silica", "drawing": None},
}
"""Options of each study, and what is taken unless they are given."""
_EXAMPLES = {
    "part": "meshes/bracket.stl",
    "deck": "decks/chute.in.j2",
    "casting": "meshes/bracket.stl",
}
"""File of ``config`` that is copied beside a study where the user gives none."""
_WALL_MM = 3.0
"""Thickness of the walls round a hole: that of the shipped tube."""
_ROOM_M = 0.03
"""Sand round a part (argued)."""
_ELEMENTS = 8
"""Elements across the smallest extent of a casting (argued)."""
_MOST_ELEMENTS = 32
"""The same where its walls are thin (argued)."""
_FOAM_M = 0.016
"""Longest element of foam where no wall is thinner: that of the shipped bracket."""
_GATE_M = 0.01
"""Half the width of the gating that a part hangs from: that of the shipped bracket."""


def write_new_study(name: str, path: Path, given: dict[str, Any]) -> Plan:
    """Write a study and what it needs, and check it first as the plan does.

    Raises
    ------
    BadInputError
        Where a file is there already, or options do not make a study. Nothing is written then.
    """
    if problems := list(_problems(name, given)):
        raise BadInputError(problems)
    example = "" if "drawing" in given else _EXAMPLES.get(name, "")
    beside = path.with_suffix("".join(Path(example).suffixes)) if example else None
    for each in (path, beside):
        if each is not None and each.exists():
            raise BadInputError([Problem("FILE", str(each), "a new file: none is replaced")])
    if beside is not None:
        shutil.copyfile(SHIPPED / "config" / example, beside)
    try:
        text = _study_text(name, path, given, beside)
        plan = open_plan(path, text=text)
        if name == "casting" and (element_m := _finer_element_m(plan.runs[0].scenario)):
            coarse, fine = (f"element_m: {each:g} " for each in element_m)
            text = text.replace(coarse, fine)
            plan = open_plan(path, text=text)
        path.write_text(text, encoding="utf-8")
    except BadInputError:
        if beside is not None:
            beside.unlink()
        raise
    return plan


def _finer_element_m(scenario: Solidification) -> tuple[float, float] | None:
    """Element of a casting, and half its thinnest wall where that is less; else None."""
    element_m = scenario.element_m
    wall = thinnest_wall(solids_of(scenario), 2.0 * element_m)
    if wall is None:
        return None
    least_m = element_m * _ELEMENTS / _MOST_ELEMENTS
    return element_m, max(math.floor(0.5e4 * wall.thickness_m) / 1e4, least_m)


def _study_text(name: str, path: Path, given: dict[str, Any], beside: Path | None) -> str:
    values = {n: v for n, v in (_OPTIONS[name] | given).items() if v is not None}
    if (file := given.get("drawing", beside)) is not None:
        values["file"] = json.dumps(os.path.relpath(file, path.parent), ensure_ascii=False)
        values |= {} if name == "deck" else _placed(file)
    return environment("study").get_template(f"{name}.yaml.j2").render(values, wall_mm=_WALL_MM)


def _problems(name: str, given: dict[str, Any]) -> Iterator[Problem]:
    """Options that the study does not have, that exclude each other, or that are no amounts."""
    for option, value in given.items():
        key, amounts = _flag(option), value if isinstance(value, tuple) else (value,)
        if option not in _OPTIONS[name]:
            yield Problem(key, value, "absent", sentence=f"leave {key} out with {name}")
        elif any(isinstance(n, float) and not 0 < n < np.inf for n in amounts):
            yield Problem(key, value, "greater than 0")
    if len(held := [_flag(option) for option in _HELD if option in given]) > 1:
        sentence = (
            f"give one of {' and '.join(held)}: only one can stay the same at every speed. "
            "A limit of the table in g is --largest-acceleration-g"
        )
        yield Problem(held[0], None, "", sentence=sentence)
    if "hole_mm" in _OPTIONS[name]:
        values = _OPTIONS[name] | given
        across, up = values["hole_mm"] if name == "pocket" else reversed(values["hole_mm"])
        width, height = values["box_mm"]
        if across + 2 * _WALL_MM >= width or up + 2 * _WALL_MM >= height:
            valid = f"a hole that lies with its walls in the box of {width:g} x {height:g} mm"
            yield Problem("--hole-mm", values["hole_mm"], valid)


def _flag(option: str) -> str:
    return f"--{option.replace('_', '-')}"


def _placed(drawing: Path) -> dict[str, Any]:
    """Box, elements and gating for a part, or its mould."""
    from sandmould.geometry.mesh import TriangleMesh
    from sandmould.geometry.mesh_file import read_surface  # slow to import
    from sandmould.pattern_fe.nearest import nearest_on_facets

    unit_m = 1.0 if tells_unit(drawing) else 0.001
    try:
        vertices, triangles = read_surface(drawing)
    except MeshFileError as fault:
        raise BadInputError([Problem("--drawing", str(drawing), str(fault))]) from fault
    corners_m = unit_m * vertices[triangles]
    low_m, high_m = corners_m.min(axis=(0, 1)), corners_m.max(axis=(0, 1))
    size_m = high_m - low_m
    position_m = _ROOM_M - low_m
    # The gating holds the middle of the highest faces, or the place on them nearest to it.
    lowest_m = corners_m[:, :, 2].min(axis=1)
    tops_m = corners_m[lowest_m >= lowest_m.max() - 1e-3 * size_m[2]]
    middle_m = 0.5 * (tops_m.min(axis=(0, 1)) + tops_m.max(axis=(0, 1)))
    _, _, place_m = nearest_on_facets(middle_m[None], tops_m)
    gate_m = place_m[0] + position_m
    half_m = np.array([_GATE_M, _GATE_M, 0.0005])
    element_m = max(round(float(size_m.min()) / _ELEMENTS, 4), 1e-4)
    cells = np.ceil((size_m + 2 * _ROOM_M) / element_m)
    mould_low_m = low_m - _ROOM_M
    wall = thinnest_wall([TriangleMesh("part", unit_m * vertices, triangles)], _FOAM_M / 1.5)
    found = {
        "box_m": size_m + _ROOM_M * np.array([2, 2, 4]),
        "position_m": position_m,
        "gate_m": np.array([gate_m - half_m, gate_m + half_m]),
        "layer_m": (size_m[2] + 2 * _ROOM_M) / 2,
        "foam_m": max(1.5 * wall.thickness_m, 0.5 * _FOAM_M) if wall else _FOAM_M,
        "element_m": element_m,
        "mould_m": np.array([mould_low_m, mould_low_m + cells * element_m]),
    }
    return {"unit_m": unit_m, **{n: np.round(value, 6).tolist() for n, value in found.items()}}
