"""What stands round the spheres: triangles and edges of solids, cavities, what opens and bends."""

from __future__ import annotations

import base64
import json
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from sandmould.drawing.figures import dimensioned
from sandmould.drawing.sphere_scene import (
    MOST_TRIANGLES,
    SIDES,
    UNKNOWN,
    SurfaceField,
    sharp_edges,
    solid_scene,
    sphere_scene,
)
from sandmould.geometry.geometry import Block
from sandmould.report.scene_page import draw_scene_file
from sandmould.scenario.scenario import Scenario
from tests.hopper import DEEP, hopper_scene

BALL_ROWS = 180


def unpacked(solid: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, triangles and edges as the page reads them."""
    raw = zlib.decompress(base64.b64decode(solid["data"]))
    v, t = 12 * solid["vertices"], 12 * solid["triangles"]
    parts = raw[:v], raw[v : v + t], raw[v + t :]
    kinds = ("<f4", 3), ("<u4", 3), ("<u4", 2)
    return tuple(  # type: ignore[return-value]
        np.frombuffer(part, dtype=kind).reshape(-1, width)
        for part, (kind, width) in zip(parts, kinds, strict=True)
    )


def volume_m3(vertices: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = vertices[triangles].astype(np.float64).transpose(1, 0, 2)
    return float(np.sum(a * np.cross(b, c)) / 6)


def test_plates_are_cuboids_with_twelve_edges_and_the_gate_opens() -> None:
    scenario = hopper_scene(**DEEP)
    solids = sphere_scene(scenario, 0.16)["solids"]
    assert [s["name"] for s in solids if s["opens"]] == ["gate"]
    for solid, block in zip(solids, scenario.scene.blocks, strict=True):
        vertices, triangles, edges = unpacked(solid)
        assert (len(vertices), len(triangles), len(edges)) == (8, 12, 12)
        # closed and counter-clockwise: the faces turned to the viewer are known by that
        assert volume_m3(vertices, triangles) == pytest.approx(block.measure, rel=1e-5)
        assert not solid["bends"]


def test_round_tube_is_drawn_with_its_rims_and_its_cavity() -> None:
    tube = {
        "kind": "tube", "diameter_m": 0.03, "length_m": 0.05, "left_end_x_m": 0.05,
        "axis_height_m": 0.04, "section": "round",
    }  # fmt: skip
    scenario = Scenario.model_validate({"dimension": 3, "obstacles": [tube]})
    scene = sphere_scene(scenario, 0.08)
    assert scene["size_m"] == [0.1, 0.05, 0.08]
    assert scene["cut_m"] == 0.025
    (solid,) = scene["solids"]
    vertices, triangles, edges = unpacked(solid)
    # closed by the box at its right end: two rims at each end, none along the tube
    assert len(edges) == 4 * SIDES
    (wall,) = scenario.scene.revolved
    assert volume_m3(vertices, triangles) == pytest.approx(wall.measure, rel=1e-4)
    (bore,) = scene["bores"]
    points = np.array(bore).reshape(-1, 3)
    assert points[:, 0].min() == pytest.approx(0.05)
    assert points[:, 0].max() == pytest.approx(0.1)
    assert np.hypot(points[:, 1] - 0.025, points[:, 2] - 0.04) == pytest.approx(0.015, rel=2e-3)


def test_an_open_surface_ends_in_edges() -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    edges = sharp_edges(square, np.array([[0, 1, 2], [0, 2, 3]]))
    assert edges.tolist() == [[0, 1], [0, 3], [1, 2], [2, 3]]


def test_a_mesh_of_too_many_triangles_keeps_its_shape() -> None:
    angle = np.linspace(0, np.pi, BALL_ROWS + 1)
    rows, sides = np.meshgrid(angle, np.linspace(0, 2 * np.pi, BALL_ROWS + 1), indexing="ij")
    place = 0.02 * np.stack(
        [np.sin(rows) * np.cos(sides), np.sin(rows) * np.sin(sides), np.cos(rows)], -1
    )
    vertices, at = np.unique(np.round(place.reshape(-1, 3), 9), axis=0, return_inverse=True)
    at = at.reshape(BALL_ROWS + 1, BALL_ROWS + 1)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    triangles = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    flat = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    ball = {
        "kind": "triangles", "vertices_m": (vertices + 0.025).tolist(),
        "triangles": triangles[~flat].tolist(),
    }  # fmt: skip
    assert len(ball["triangles"]) > MOST_TRIANGLES
    scenario = Scenario.model_validate({"dimension": 3, "obstacles": [ball]})
    (solid,) = sphere_scene(scenario, 0.1)["solids"]
    drawn, faces, _ = unpacked(solid)
    assert 5_000 < len(faces) <= MOST_TRIANGLES
    exact = 4 / 3 * np.pi * 0.02**3
    # vertices move by a cell of the grid at most, a 64th of the width
    assert volume_m3(drawn, faces) == pytest.approx(exact, rel=3 / 32)


def test_a_scene_before_anything_runs_shows_its_part_and_its_sizes_in_mm(tmp_path: Path) -> None:
    plate = {"kind": "plate", "centre_m": [0.05, 0.025, 0.02], "size_m": [0.03, 0.02, 0.01]}
    scenario = Scenario.model_validate(
        {
            "dimension": 3,
            "obstacles": [plate],
            "sand": {"size_scale": 16},
            "fill": {"layers": [{"count": 30}]},
        }
    )
    draw_scene_file(scenario, "A plate", "base", tmp_path / "scene.html")
    page = (tmp_path / "scene.html").read_text()
    told = page.partition('id="film-scene">')[2].partition("</script>")[0]
    tint: Any = sphere_scene(scenario, 0.1)["solid_tint"]
    assert json.loads(told)["solid_tint"][-1] > 0.7 > tint[-1]
    (ax,) = dimensioned(scenario, None).axes
    assert {"100 mm"} <= {text.get_text() for text in ax.texts}


def test_a_field_colours_a_surface_cut_to_its_places_and_is_not_known_far_from_them() -> None:
    """The places lie on the block's lower half, their value is x."""
    block = Block("part", np.full(3, 0.01), np.full(3, 0.01), np.eye(3))
    x = 0.001 * np.arange(21)
    place_m = np.stack(np.meshgrid(x, x, x[:11], indexing="ij"), axis=-1).reshape(-1, 3)
    field = SurfaceField("x", place_m, place_m[:, 0], 0.0, 0.02, ("0", "20 mm"), 0.001)
    from_m = np.full(3, 0.5)
    moved = replace(field, place_m=place_m + from_m)
    shifted = Block("part", block.centre_m + from_m, block.half_size_m, np.eye(3))
    for scene in (
        solid_scene([block], np.zeros(3), np.full(3, 0.02), [field]),
        solid_scene([shifted], from_m, from_m + 0.02, [moved]),
    ):
        (solid,) = cast(list[dict[str, Any]], scene["solids"])
        raw = zlib.decompress(base64.b64decode(solid["data"]))
        vertices = np.frombuffer(raw, "<f4", 3 * solid["vertices"]).reshape(-1, 3)
        triangles = np.frombuffer(raw, "<u4", 3 * solid["triangles"], vertices.nbytes)
        shades = np.frombuffer(raw, np.uint8)[-solid["vertices"] :]
        corners = vertices[triangles.reshape(-1, 3)]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        assert sides.max() <= 0.001 * (1 + 1e-4)
        assert volume_m3(vertices, triangles.reshape(-1, 3)) == pytest.approx(0.02**3, rel=1e-5)
        assert solid["edges"] == 12
        low = vertices[:, 2] <= 0.01
        # the nearest place is half of their distance away at the most
        assert np.abs(shades[low] / 254 - vertices[low, 0] / 0.02).max() <= 0.5 / 20 + 0.5 / 254
        assert (shades[vertices[:, 2] > 0.0121] == UNKNOWN).all()
    assert scene["from_m"] == from_m.tolist()
    assert scene["fields"] == [{"title": "x", "ends": ("0", "20 mm")}]
