"""Foam in drawn solids: its mesh and quality, what the plan says of it, what is refused."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from skfem import MeshTet

from sandmould.bad_input import BadInputError
from sandmould.engines.program import build_program
from sandmould.kinds.kind import BASE_MEMORY_MB
from sandmould.kinds.sand.kind import SAND
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.pattern_fe.quality import mesh_sentence, tetrahedron_quality
from sandmould.pattern_fe.scene import pattern_of
from sandmould.report.bending import drawing_sentences
from sandmould.scenario import solids
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import Triangles
from tests.bracket import BRACKET, STEP
from tests.patterns import _one_thread  # noqa: F401
from tests.unit.meshes import CORNERS, FACETS, SHIPPED

PLACE = [0.06, 0.05, 0.045]
GATING = {"low_m": [0.05, 0.04, 0.0525], "high_m": [0.07, 0.06, 0.0535]}


def drawn(file: Path, unit_m: float = 1.0, **pattern: Any) -> Scenario:
    told = {
        "shape": {"kind": "drawing", "file": str(file), "unit_m": unit_m},
        "position_m": PLACE,
        "element_m": 0.016,
        "supports": {"hung": [GATING]},
    }
    box = {"width_m": 0.14, "depth_m": 0.1, "height_m": 0.14}
    scene = {"dimension": 3, "box": box, "sand": {"size_scale": 18}, "pattern": told | pattern}
    return Scenario.model_validate({**scene, "engine": {"name": "reference"}})


@pytest.mark.parametrize(("file", "unit_m"), [(BRACKET, 1e-3), (STEP, 1.0)])
def test_a_drawn_bracket_is_foam_where_it_is_put(file: Path, unit_m: float) -> None:
    scenario = SAND.planning.resolved(drawn(file, unit_m))
    pattern, (mesh,) = pattern_of(scenario), scenario.scene.meshes
    np.testing.assert_array_equal(mesh.vertices_m, pattern.surface.vertices_m)
    # straight sides of 16 mm along a rim of 30 mm
    assert mesh.measure == pytest.approx(1e-9 * SHIPPED.measure, rel=0.04)
    assert mesh.measure == pytest.approx(pattern.space.weight.sum(), rel=1e-9)
    low_m, high_m = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
    np.testing.assert_allclose(high_m - PLACE, [0.05, 0.03, 0.008], atol=2e-3)
    np.testing.assert_allclose(low_m - PLACE, [-0.03, -0.03, -0.008], atol=2e-3)
    assert scenario.pattern is not None
    assert len(getattr(scenario.pattern.shape, "sha256", "")) == 64
    (note,) = [n.text for n in SAND.planning.notes(scenario) if n.about == "Drawing of the pattern"]
    assert drawing_sentences(scenario) == (mesh_sentence(scenario, pattern),)
    assert mesh_sentence(scenario, pattern) in note
    assert re.search(r"Corners of the drawing lie up to [12]\.\d mm off it", note)
    assert f"{pattern.space.mesh.nelements} tetrahedra of 16" in note
    assert SAND.planning.memory_mb(scenario) > BASE_MEMORY_MB


def test_quality_is_that_of_balls_in_and_round_an_element() -> None:
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    corner = np.vstack([np.zeros(3), np.eye(3)])
    # r = 1/(3 + sqrt 3) and R = sqrt(3)/2 of the corner of a cube
    exact = 3.0 / (3.0 + math.sqrt(3.0)) / (math.sqrt(3.0) / 2.0)
    for place, quality in ((regular, 1.0), (0.01 * corner + 5.0, exact)):
        mesh = MeshTet(place.T, np.arange(4)[:, None])
        assert tetrahedron_quality(mesh) == pytest.approx([quality], rel=1e-9)
    flat = corner * [1.0, 1.0, 1e-3]
    assert tetrahedron_quality(MeshTet(flat.T, np.arange(4)[:, None]))[0] < 0.01


def crossing_cube(path: Path) -> Path:
    """One shell that goes through itself: a corner of a cube pushed out of the face above it."""
    vertices = CORNERS.copy()
    vertices[0] += [0.4, 0.6, 1.5]
    meshio.stl.write(str(path), meshio.Mesh(vertices, [("triangle", FACETS)]), binary=True)
    return path


@pytest.mark.parametrize(
    ("told", "says"),
    [
        (
            {"unit_m": 1.0},
            r"reaches from .* m, valid is inside the box .*; with unit_m: 0.001 it f",
        ),
        (
            {"position_m": [0.1, 0.05, 0.045]},
            r"pattern.position_m = .* reaches from .* valid is in",
        ),
        ({"element_m": 0.0005}, r"pattern.element_m = 0.0005 .* at most 20,000 tetrahedra"),
        ({"depth_m": 0.02}, r"pattern.depth_m = 0.02 .* null in 2D and for a file"),
        ({"file": "nowhere.stl"}, r"pattern.shape.file = .* a readable file"),
        ({"file": STEP, "unit_m": 0.001}, r"pattern.shape.unit_m = 0.001 .* tells its own unit"),
    ],
)
def test_what_cannot_be_foam_is_told(told: dict[str, Any], says: str) -> None:
    pattern = {"file": BRACKET, "unit_m": 1e-3} | told
    with pytest.raises(BadInputError, match=says):
        with_surface(drawn(**pattern))


def test_a_surface_through_itself_is_refused(tmp_path: Path) -> None:
    path = crossing_cube(tmp_path / "crossed.stl")
    with pytest.raises(BadInputError, match=r"shape.file = .* does not pass through itself; about"):
        with_surface(drawn(path, 0.02))


def test_a_drawing_is_refused_in_the_plane() -> None:
    flat = {
        "box": {"width_m": 0.14, "height_m": 0.14},
        "pattern": {"shape": {"kind": "drawing", "file": str(BRACKET), "unit_m": 1e-3}},
    }
    with pytest.raises(BadInputError, match=r"a drawing is a solid, valid in 3D"):
        with_surface(Scenario.model_validate(flat))


def test_a_part_turned_inside_out_is_turned_and_that_is_told(tmp_path: Path) -> None:
    path = tmp_path / "turned.stl"
    mesh = meshio.Mesh(CORNERS, [("triangle", FACETS[:, ::-1])])
    meshio.stl.write(str(path), mesh, binary=True)
    scenario = with_surface(drawn(path, 0.03, supports={"clamped": ["bottom"]}))
    assert scenario.scene.meshes[0].measure == pytest.approx(0.03**3)
    told = [note.text for note in SAND.planning.notes(scenario)]
    assert any("12 triangles were drawn inside out and turned round" in text for text in told)


def test_a_report_tells_a_drawing_that_has_changed(tmp_path: Path) -> None:
    path = tmp_path / "part.stl"
    meshio.stl.write(str(path), meshio.Mesh(CORNERS, [("triangle", FACETS)]), binary=True)
    scenario = SAND.planning.resolved(drawn(path, 0.03, supports={"clamped": ["bottom"]}))
    taller = meshio.Mesh(CORNERS * [1.0, 1.0, 1.1], [("triangle", FACETS)])
    meshio.stl.write(str(path), taller, binary=True)
    assert drawing_sentences(scenario) == (
        "The drawing of the pattern is gone or has changed since the study was planned.",
    )


def test_a_plan_tells_what_a_surface_of_many_triangles_takes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario = drawn(BRACKET, 1e-3)

    def told() -> str:
        (note,) = [n for n in SAND.planning.notes(scenario) if n.about == "Drawing of the pattern"]
        return note.text

    assert "It measures 80 x 60 x 16 mm and 47.72 cm3 in 612 triangles. The pattern" in told()
    monkeypatch.setattr(solids, "MANY_TRIANGLES", 600)
    monkeypatch.setattr(solids, "READ_S", 0.1)
    monkeypatch.setattr(solids, "READ_BYTES", 2_000_000)
    assert "Every process of the study takes about 61 s and 1,224 MB to read its 612" in told()


def test_a_mesh_other_than_the_planned_one_does_not_start(tmp_path: Path) -> None:
    scenario = SAND.planning.resolved(drawn(BRACKET, 1e-3))
    solid = scenario.obstacles[-1]
    assert isinstance(solid, Triangles)
    moved = tuple((x + 1e-6, y, z) for x, y, z in solid.vertices_m)
    other = scenario.model_copy(
        update={"obstacles": (solid.model_copy(update={"vertices_m": moved}),)}
    )
    with pytest.raises(BadInputError, match=r"shape.file = .* meshes here as where the study was"):
        open_coupled(build_program(other), tmp_path, tmp_path / "engine.log")
