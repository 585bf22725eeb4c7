"""Cavities as keys: where they open, what is refused, and scenes without them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sandmould.bad_input import BadInputError
from sandmould.kinds.sand.kind import SAND
from sandmould.kinds.sand.measures import MEASURES
from sandmould.reference.reference import measures_text
from sandmould.runs.hashing import said, scenario_hash
from sandmould.runs.measures import measures_of
from sandmould.scenario.cavities import (
    BoxCavity,
    CylinderCavity,
    MeshCavity,
    PolygonCavity,
    cavity_space,
)
from sandmould.scenario.checks.cavities import cavity_problems, free_share
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.load_study import open_study
from tests.unit.meshes import CORNERS, FACETS
from tests.unit.refusing import refused


def box(**keys: object) -> BoxCavity:
    return BoxCavity.model_validate(
        {"kind": "box", "name": "hole", "centre_m": (1, 2), "size_m": (2, 4), **keys}
    )


def test_a_box_opens_at_the_side_that_is_named() -> None:
    for opens, inward in (("up", (0, -1)), ("down", (0, 1)), ("left", (1, 0)), ("right", (-1, 0))):
        space = cavity_space(box(opens=opens), 2, "cavities.0")
        assert_allclose(space.inward, inward, atol=1e-15)
        assert space.length_m == pytest.approx(4 if opens in ("up", "down") else 2)
    deep = BoxCavity(
        kind="box", name="a", centre_m=(1, 2, 3), size_m=(1, 2, 3), opens="front"
    )  # fmt: skip
    space = cavity_space(deep, 3, "cavities.0")
    assert_allclose(space.inward, [0, 1, 0])
    assert space.depth_m(np.array([[1.0, 1.0, 3.0]])) == pytest.approx(0.0)


def test_other_shapes_open_in_any_direction() -> None:
    triangle = PolygonCavity(
        kind="polygon", name="a", vertices_m=((0, 0), (0, 3), (4, 0)), opens=(3, 4)
    )
    space = cavity_space(triangle, 2, "cavities.0")
    assert_allclose(space.inward, [-0.6, -0.8])
    assert space.length_m == pytest.approx(2.4)  # the height over the longest side
    assert space.space.measure == pytest.approx(6)
    bore = CylinderCavity(
        kind="cylinder", name="a", centre_m=(1, 1, 1), diameter_m=1, length_m=5, opens=(1, 1, 0)
    )
    space = cavity_space(bore, 3, "cavities.0")
    assert space.length_m == pytest.approx(5)
    assert space.space.measure == pytest.approx(np.pi / 4 * 5)
    assert space.depth_m(np.array([[1.0, 1.0, 9.0]])) == pytest.approx(2.5)


def test_a_scene_without_cavities_keeps_its_hash() -> None:
    assert "cavities" not in said(Scenario())
    assert scenario_hash(Scenario(cavities=(box(),))) != scenario_hash(Scenario())


def test_measures_are_those_of_the_cavities_there_are() -> None:
    scenario = Scenario(cavities=(box(),))
    names = [m.name for m in measures_of(MEASURES, scenario) if m.name.startswith("hole")]
    assert sorted(names) == sorted(
        f"hole_{what}"
        for what in (
            "fill_fraction", "fill_of_bed_fraction", "grains", "filled_depth_m", "voids",
            "void_fraction", "sand_m2", "largest_void_m2",
        )
    )  # fmt: skip


def test_a_copy_with_other_cavities_has_their_geometry() -> None:
    scenario = Scenario()
    assert scenario.scene.cavities == ()
    assert len(scenario.model_copy(update={"cavities": (box(),)}).scene.cavities) == 1


def write_stl(path: Path, corners: np.ndarray, facets: np.ndarray) -> None:
    facet = struct.Struct("<12fH")
    rows = b"".join(facet.pack(0, 0, 0, *corners[f].ravel().tolist(), 0) for f in facets)
    path.write_bytes(b" " * 80 + struct.pack("<I", len(facets)) + rows)


def test_a_mesh_bounds_a_cavity_and_its_hash_is_planned(tmp_path: Path) -> None:
    path = tmp_path / "cube.stl"
    write_stl(path, CORNERS, FACETS)
    mesh = MeshCavity(kind="mesh", name="pit", file=str(path), unit_m=0.02, opens="left")
    space = cavity_space(mesh, 3, "cavities.0")
    assert space.space.measure == pytest.approx(8e-6)
    assert_allclose(space.inward, [1, 0, 0])
    (planned,) = SAND.planning.resolved(Scenario(dimension=3, cavities=(mesh,))).cavities
    assert isinstance(planned, MeshCavity)
    assert planned.sha256 is not None


HOLE = "{kind: box, name: hole, centre_m: [0.06, 0.03], size_m: [0.02, 0.02]%s}"
SCENES = {2: "obstacles: [], ", 3: "dimension: 3, obstacles: [], vibration: [], "}
NO_OBJECTIVE = "objective: {measure: solid_fraction}\n"
CASES: dict[str, tuple[int, str, str]] = {
    "outside the box": (
        2, HOLE.replace("0.03]", "0.3]") % "",
        "cavities.0.centre_m = 'hole' cannot be used: valid is a cavity inside the box, "
        "0.12 x 0.11 m; it goes from (0.05, 0.29) to (0.07, 0.31) m.",
    ),
    "two of one name": (
        2, f"{HOLE % ''}, {HOLE % ''}",
        "cavities.1.name = 'hole' cannot be used: valid is a name that no other cavity and no "
        "tube has.",
    ),
    "no name": (
        2, "{kind: box, centre_m: [0.06, 0.03], size_m: [0.02, 0.02]}",
        "cavities.0.name = None cannot be used: valid is a value: this key must be given.",
    ),
    "no kind": (
        2, "{name: hole}",
        "cavities.0 = {'name': 'hole'} cannot be used: valid is a mapping with a kind: box, "
        "polygon, cylinder, mesh.",
    ),
    "polygon that crosses itself": (
        2,
        "{kind: polygon, name: bow, vertices_m: [[0.02, 0.02], [0.06, 0.06], [0.06, 0.02], "
        "[0.02, 0.06]]}",
        "cavities.0.vertices_m = [[0.02, 0.02], [0.06, 0.06], [0.06, 0.02], [0.02, 0.06]] cannot "
        "be used: valid is edges that neither cross nor touch one another.",
    ),
    "kind of 3D": (
        2, "{kind: cylinder, name: a, centre_m: [0, 0, 0], diameter_m: 1, length_m: 1}",
        "cavities.0.kind = 'cylinder' cannot be used: valid is box or polygon in 2D.",
    ),
    "side of 3D": (
        2, HOLE % ", opens: back",
        "cavities.0.opens = 'back' cannot be used: valid is up, down, left or right.",
    ),
    "no direction": (
        2,
        "{kind: polygon, name: a, vertices_m: [[0.02, 0.02], [0.06, 0.02], [0.06, 0.06]], "
        "opens: [0, 0]}",
        "cavities.0.opens = [0.0, 0.0] cannot be used: valid is up, down, left or right, or "
        "numbers that are not all 0.",
    ),
    "numbers of another dimension": (
        3, HOLE % "",
        "cavities.0.centre_m = [0.06, 0.03] cannot be used: valid is 3 numbers, one a dimension.\n"
        "trial.yaml: scenario.cavities.0.size_m = [0.02, 0.02] cannot be used: valid is 3 "
        "numbers, one a dimension.",
    ),
    "too narrow": (
        2, HOLE.replace("[0.02, 0.02]", "[0.003, 0.02]") % "",
        "cavities.0.kind = 'box hole' cannot be used: valid is a cavity wider than the largest "
        "grain, 0.00387161 m.",
    ),
    "too narrow in the round": (
        3,
        "{kind: cylinder, name: pit, centre_m: [0.06, 0.02, 0.03], diameter_m: 0.003, "
        "length_m: 0.02}",
        "cavities.0.kind = 'cylinder pit' cannot be used: valid is a cavity wider than the "
        "largest grain, 0.00387161 m.",
    ),
    "mouth on the floor": (
        2, HOLE.replace("0.03]", "0.01]") % ", opens: down",
        "cavities.0.opens = 'down' cannot be used: valid is a side where the largest grain can "
        "come in: nothing as wide as its 0.00387161 m leads from there into hole.",
    ),
    "no STL": (
        3, "{kind: mesh, name: a, file: absent.stl}",
        "cavities.0.file = 'absent.stl' cannot be used: valid is a readable file (No such file "
        "or directory).",
    ),
    "open mesh": (3, "{kind: mesh, name: a, file: open.stl, unit_m: 0.02}", ""),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=[c.replace(" ", "_") for c in CASES])
def test_sentence(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dimension, cavities, sentence = CASES[case]
    write_stl(tmp_path / "open.stl", CORNERS, FACETS[:1])
    text = f"based_on: tube\n{NO_OBJECTIVE}scenario: {{{SCENES[dimension]}cavities: [{cavities}]}}"
    told = refused(tmp_path, text, monkeypatch)
    if sentence:
        assert told == f"trial.yaml: scenario.{sentence}"
    else:
        assert told.startswith(
            "trial.yaml: scenario.cavities.0.file = 'open.stl' cannot be used: valid is "
        )
        assert "\n" not in told


def test_a_lid_shuts_a_hole_and_an_obstacle_fills_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lid = "{kind: plate, name: lid, centre_m: [0.06, 0.042], size_m: [0.06, 0.004]}"
    sides = ", ".join(
        f"{{kind: plate, name: side{i}, centre_m: [{x}, 0.03], size_m: [0.01, 0.02]}}"
        for i, x in enumerate((0.045, 0.075))
    )
    head = f"based_on: tube\n{NO_OBJECTIVE}scenario: {{"
    shut = refused(
        tmp_path, f"{head}obstacles: [{lid}, {sides}], cavities: [{HOLE % ''}]}}", monkeypatch
    )
    assert "cavities.0.opens = 'up' cannot be used: valid is a side where the largest" in shut
    core = "{kind: plate, name: core, centre_m: [0.06, 0.03], size_m: [0.01, 0.02]}"
    full = refused(tmp_path, f"{head}obstacles: [{core}], cavities: [{HOLE % ''}]}}", monkeypatch)
    assert full == (
        "trial.yaml: scenario.cavities.0.centre_m = 'hole' cannot be used: valid is a cavity in "
        "free space; about 50 % of this one lies in obstacles."
    )


def test_a_bad_side_is_told_by_whatever_asks_for_the_scene(tmp_path: Path) -> None:
    path = tmp_path / "trial.yaml"
    path.write_text(f"based_on: tube\nscenario: {{cavities: [{HOLE % ', opens: back'}]}}")
    with pytest.raises(BadInputError, match="valid is up, down, left or right"):
        measures_text(open_study(path))


def round_hole(sides: int, centre_x_m: float = 0.06) -> Scenario:
    """A pipe whose hole has so many sides, and a round cavity of 20 mm drawn into it."""
    angle = 2 * np.pi * np.arange(sides) / sides
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    rings = [
        np.column_stack([radius_m * circle + [0.06, 0.025], np.full(sides, z_m)])
        for z_m in (0.01, 0.05)
        for radius_m in (0.02, 0.01)
    ]
    i, j = np.arange(sides), np.roll(np.arange(sides), -1)
    triangles: list[list[tuple[int, np.ndarray]]] = []
    # outer side, upper end, inner side, lower end
    for a, b in ((0, 2), (2, 3), (3, 1), (1, 0)):
        triangles += [[(a, i), (a, j), (b, j)], [(a, i), (b, j), (b, i)]]
    corners = [[list(ring * sides + at) for ring, at in t] for t in triangles]
    return Scenario.model_validate(
        {
            "dimension": 3,
            "box": {"width_m": 0.12, "depth_m": 0.05, "height_m": 0.11},
            "sand": {"size_scale": 6},
            "obstacles": [
                {
                    "kind": "triangles",
                    "name": "pipe",
                    "vertices_m": np.concatenate(rings).tolist(),
                    "triangles": np.array(corners).transpose(0, 2, 1).reshape(-1, 3).tolist(),
                }
            ],
            "cavities": [
                {
                    "kind": "cylinder",
                    "name": "hole",
                    "centre_m": [centre_x_m, 0.025, 0.03],
                    "diameter_m": 0.02,
                    "length_m": 0.04,
                }
            ],
        }
    )


def test_facets_of_a_round_hole_may_lie_in_a_cavity_which_is_smaller_then() -> None:
    # a circle has pi r^2, a polygon in it n/2 sin(2 pi/n) r^2
    twelve = round_hole(12)
    assert not list(cavity_problems(twelve))
    assert free_share(twelve, 0) == pytest.approx(3.0 / np.pi, abs=0.005)
    (problem,) = cavity_problems(round_hole(8))
    assert problem.valid.startswith(
        "a cavity whose facets fit those of the part. About 10 % of this one lies in the part"
    )
    assert problem.valid.endswith("with finer facets, or make the cavity a little smaller")
    (problem,) = cavity_problems(round_hole(12, centre_x_m=0.064))
    assert (problem.key, problem.value) == ("cavities.0.centre_m", "hole")
    assert "free space" in problem.valid


def test_a_cavity_among_no_meshes_is_free() -> None:
    assert free_share(Scenario(cavities=(box(),)), 0) == 1.0
