"""What the plan tells before anything is computed: thin walls, volumes, sand, symmetry."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from sandmould.bad_input import BadInputError
from sandmould.casting.arpm import scene
from sandmould.casting.arpm.estimates import cooled, freezes_s
from sandmould.casting.arpm.raster import Raster
from sandmould.casting.arpm.solidification import solidify
from sandmould.kinds.sand import planning as planning_of_sand
from sandmould.scenario.checks.wall_thickness import thinnest_wall
from sandmould.scenario.solids import SolidMesh, drawn_part, other_units, unit_hint
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table
from sandmould.study.plan.price import Prices
from tests.drawings import BODIES, DAMAGES, binary, written
from tests.scenes import TUBE_SCENE
from tests.unit.geometry.test_mesh_union import CUBE, box, file_of
from tests.unit.kinds.test_solidification_study import opened

DISC = [[0.04 + 0.02 * math.cos(t), 0.04 + 0.02 * math.sin(t)]
        for t in np.linspace(0, 2 * np.pi, 65)[:-1]]  # fmt: skip


def square(low: float, side: float) -> dict[str, Any]:
    return {"kind": "rectangle", "low_m": [low, low], "high_m": [low + side, low + side]}


def around(side: float, sand: float) -> dict[str, Any]:
    size = side + 2 * sand
    return {"box": {"low_m": [0.0, 0.0], "high_m": [size, size]}, "shapes": [square(sand, side)],
            "probes": []}  # fmt: skip


def plan_of(folder: Path, top: dict[str, Any] | None = None, /, **scenario: Any) -> str:
    return plan_table(expand(open_study(opened(folder, top, **scenario))), Prices(), 1)


def notes_of(folder: Path, **scenario: Any) -> list[str]:
    return plan_of(folder, **scenario).partition("Wall time on")[2].splitlines()[1:]


def test_a_sound_casting_has_no_notes(tmp_path: Path) -> None:
    assert notes_of(tmp_path, **around(0.04, 0.04), element_m=0.004) == []


def test_a_fin_thinner_than_an_element_is_told(tmp_path: Path) -> None:
    fin = {"kind": "polygon", "vertices_m": [
        [0.04, 0.04], [0.08, 0.04], [0.08, 0.08], [0.0608, 0.08], [0.0608, 0.12],
        [0.0592, 0.12], [0.0592, 0.08], [0.04, 0.08]]}  # fmt: skip
    room = {"low_m": [0.0, 0.0], "high_m": [0.12, 0.16]}
    walls, *_ = notes_of(tmp_path, shapes=[fin], box=room, probes=[], element_m=0.004)
    assert walls.startswith("Walls: the thinnest measures 1.60 mm, at (0.0")
    assert "less than 2 elements of 4 mm. 33 % of the surface belongs to such walls." in walls
    assert "missing from the run" in walls
    resolved = notes_of(tmp_path, shapes=[fin], box=room, probes=[], element_m=0.0008)
    assert resolved == []


@pytest.mark.parametrize("dimension", [2, 3])
def test_thickness_of_walls_off_the_axes(dimension: int) -> None:
    """A disc and a cube have none; a slanting plate of 3 mm has, whatever its direction."""
    from scipy.spatial.transform import Rotation

    from sandmould.geometry.geometry import Block
    from sandmould.geometry.outline import Outline

    turn = Rotation.random(random_state=4).as_matrix() if dimension == 3 else np.array(
        [[0.8, 0.6], [-0.6, 0.8]])  # fmt: skip
    half = np.array([0.02, 0.0015, 0.03][:dimension])
    plate = Block("plate", np.zeros(dimension), half, turn)
    wall = thinnest_wall([plate], 0.004)
    assert wall is not None
    assert wall.thickness_m == pytest.approx(0.003, rel=1e-4)
    assert wall.surface_share == pytest.approx(
        0.04 / 0.043 if dimension == 2 else 0.0024 / 0.00282, rel=0.05)  # fmt: skip
    assert thinnest_wall([plate], 0.0029) is None
    # two plates on each other are twice as thick
    beside = Block("beside", 0.003 * turn[1], half, turn)
    assert thinnest_wall([plate, beside], 0.0055) is None
    assert thinnest_wall([Outline("disc", np.array(DISC))], 0.035) is None
    assert thinnest_wall([Block("c", np.zeros(3), np.full(3, 0.5), np.eye(3))], 0.9) is None


def test_walls_of_a_picture(tmp_path: Path) -> None:
    rows = np.full((60, 60), 255, dtype=np.uint8)
    y, x = np.indices(rows.shape)
    rows[(x - 20) ** 2 + (y - 30) ** 2 <= 15**2] = 0
    Image.fromarray(rows).save(tmp_path / "disc.png")
    picture = {"kind": "image", "file": "disc.png", "pixel_m": 0.001}
    room = {"low_m": [-0.01, -0.01], "high_m": [0.07, 0.07]}
    assert notes_of(tmp_path, shapes=[picture], box=room, probes=[], element_m=0.001) == []
    rows[28:31, 30:58] = 0
    Image.fromarray(rows).save(tmp_path / "disc.png")
    walls, *_ = notes_of(tmp_path, shapes=[picture], box=room, probes=[], element_m=0.002)
    assert "the thinnest measures 3" in walls


def test_large_elements_in_a_metal_that_melts_at_one_temperature_are_told(tmp_path: Path) -> None:
    scene_ = around(0.08, 0.04) | {"element_m": 0.004}
    pure = {"casting": {"solidus_k": 1750.0, "liquidus_k": 1750.0}}
    (front,) = notes_of(tmp_path, **scene_, **pure, layers=[2])
    assert front.startswith(
        "Layers: the metal melts at one temperature, and layers put elements of 8 mm"
    )
    assert notes_of(tmp_path, **scene_, **pure) == []
    assert notes_of(tmp_path, **scene_, layers=[2]) == []
    # too thin for a larger one
    assert notes_of(tmp_path, **around(0.012, 0.04), element_m=0.004, **pure, layers=[2]) == []


def test_elements_that_hold_another_volume_than_drawn_are_told(tmp_path: Path) -> None:
    off = around(0.043, 0.04)
    off["box"]["high_m"] = [0.124, 0.124]
    kernel = {"exchange": "symmetric", "heat_transfer_w_m2_k": None}
    assert notes_of(tmp_path, **around(0.04, 0.04), **kernel, element_m=0.004) == []
    # eleven cells a side have their centre inside
    assert notes_of(tmp_path, **off, **kernel, element_m=0.004) == [
        "Volume: the elements hold 4.7 % more than the drawn casting: 1\u202f936 instead of "
        "1\u202f849 mm2."
    ]
    # faces have the drawing's volume, whatever cells are painted
    assert notes_of(tmp_path, **off, element_m=0.004) == []
    (run,) = expand(open_study(opened(tmp_path, **off, element_m=0.004)))
    it = scene.cooled_of(run.scenario)
    # counted at 256 points of each cut cell
    assert it.volume_m3 == pytest.approx(0.043**2, rel=2e-3)
    assert it.volume_m3 + it.sand_m3 == pytest.approx(0.124**2, rel=1e-9)


def test_elements_beside_the_drawn_faces_are_told(tmp_path: Path) -> None:
    off = around(0.04, 0.05)
    off["box"]["low_m"] = [-0.002, 0.0]
    assert notes_of(tmp_path, **off, element_m=0.005)[-1] == (
        "Elements: they hold the casting at x 48 to 88 instead of 50 to 90 mm, since they do not "
        "meet its faces. Heat, volume and surface are as drawn; pictures and places of the report "
        "are those of elements. Both are alike where the box begins a whole number of elements "
        "before the casting and elements divide its size."
    )


def test_too_little_sand_is_told(tmp_path: Path) -> None:
    (little,) = notes_of(tmp_path, **around(0.04, 0.01), element_m=0.002)
    # 40 mm squared gives 0.79 of what 60 mm squared less it can take, 2 000 mm2 over 160 mm
    assert little.startswith("Sand: there is too little, 12.5 mm on average")
    assert "gives 79 % of the heat that this sand can take" in little
    assert notes_of(tmp_path, **around(0.04, 0.02), element_m=0.002) == []


def test_a_box_that_can_never_freeze_the_casting_is_told(tmp_path: Path) -> None:
    shape = {"kind": "rectangle", "low_m": [0.01, 0.01], "high_m": [0.11, 0.07]}
    room = {"low_m": [0.0, 0.0], "high_m": [0.12, 0.08]}
    scenario = {"shapes": [shape], "box": room, "probes": [], "element_m": 0.01}
    (never,) = notes_of(tmp_path, **scenario)
    # by hand: 7200 (272000 + 711 110) J/m3 of 0.006 m2 over 1600 1130 1420 J/m3 of 0.0036 m2
    assert never.startswith("Sand: the casting never freezes in this box, whatever until_s is")
    assert "gives 1.64 times the heat" in never
    assert "more than 0.00589" in never
    assert "never" in plan_of(tmp_path, **scenario).splitlines()[1]
    # true: the run ends liquid with all at one temperature above the solidus
    (run,) = expand(open_study(opened(tmp_path, **scenario)))
    it = run.scenario
    elements, filling = scene.elements_of(it), scene.filling_of(it)
    marching = scene.method_of(it).marching(elements, filling, scene.raster_of(it))
    result = solidify(elements, filling, marching, record_s=1000.0, until_s=20000.0)
    assert math.isnan(result.solidification_time_s)
    assert result.heat.temperature_k.min() > it.casting.solidus_k


def test_sides_of_the_box_that_the_casting_touches_are_told(tmp_path: Path) -> None:
    half = {"kind": "rectangle", "low_m": [0.0, 0.02], "high_m": [0.02, 0.06]}
    (note,) = notes_of(tmp_path, shapes=[half], probes=[], element_m=0.005)
    assert note == ("Symmetry: the casting touches the box at low x. No heat passes there, as "
                    "through a plane of symmetry.")  # fmt: skip


@pytest.mark.parametrize("element_m", [0.004, 0.002, 0.001])
def test_estimate_sees_symmetry_and_is_near_the_run(element_m: float) -> None:
    """A square of 40 mm freezes after 155 s, and so do its half and its quarter on the box's sides.

    The rule knows no more than one depth of a casting: 30 %. Five elements to the middle leave 15 %
    between the three.
    """
    size = round(0.16 / element_m)
    side = round(0.04 / element_m)
    whole = np.zeros((size, size), dtype=np.int64)
    a = (size - side) // 2
    whole[a : a + side, a : a + side] = 1
    steel = yaml.safe_load(Path("config/materials/hirata_2019.yaml").read_text())
    scenario = _steel(steel)
    both = [
        freezes_s(scenario, cooled(Raster(material, element_m, np.zeros(2))))
        for material in (whole, whole[size // 2 :], whole[size // 2 :, size // 2 :])
    ]
    assert both == pytest.approx([155.0] * 3, rel=0.3)
    assert both[1:] == pytest.approx(both[:1] * 2, rel=0.15)


def _steel(tree: dict[str, Any]) -> Any:
    from sandmould.scenario.casting.solidification import Solidification

    def values(node: Any) -> Any:
        if isinstance(node, dict):
            return node["value"] if "value" in node else {k: values(v) for k, v in node.items()}
        return node

    return Solidification.model_validate({**values(tree), **around(0.04, 0.06), "element_m": 0.004})


def test_a_shell_that_is_no_cavity_is_told(tmp_path: Path) -> None:
    file_of([CUBE, box([8, 8, 8], [16, 16, 16])], tmp_path)
    mesh = {"kind": "mesh", "file": "parts.stl", "unit_m": 0.001}
    room = {"low_m": [0.0, 0.0, 0.0], "high_m": [0.028, 0.028, 0.028]}
    notes = notes_of(tmp_path, shapes=[mesh], box=room, probes=[], element_m=0.002)
    (told,) = [note for note in notes if note.startswith("Drawing shapes.0: ")]
    assert told.endswith(
        " cm3 in 12 triangles. 1 shell lies in another one with faces outwards, and is part of the "
        "solid there. A cavity faces inwards."
    )


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        ("one_missing", "It was mended: 1 hole of 6.00 cm2 closed, which leaves 0 % of the volume "
         "unknown. The surface is now 52.00 cm2, as drawn 46.00; as drawn it enclosed no volume."),
        ("drawn_twice", "It was mended: 1 triangle without area, drawn twice or outside of every "
         "surface left away. The surface is now 52.00 cm2, as drawn "),
        ("point_on_an_edge", "It was mended: 1 end of open edges joined to the edge or end beside, "
         "by at most 0.00400 mm. The surface is now 52.00 cm2, as drawn 52.00; as drawn it"),
        ("one_turned", "1 triangle was drawn inside out and turned round: a closed surface says"),
    ],
)  # fmt: skip
def test_a_mended_drawing_is_told_with_its_changes(damage: str, says: str, tmp_path: Path) -> None:
    written(tmp_path / "part.stl", binary(DAMAGES[damage](BODIES["box"][0])))
    mesh = {"kind": "mesh", "file": "part.stl", "unit_m": 0.001, "position_m": [0.01, 0.01, 0.01]}
    room = {"low_m": [0.0, 0.0, 0.0], "high_m": [0.06, 0.052, 0.04]}
    notes = notes_of(tmp_path, shapes=[mesh], box=room, probes=[], element_m=0.002)
    (told,) = [note for note in notes if note.startswith("Drawing shapes.0: ")]
    assert "It measures 40 x 30 x 20 mm and 24.00 cm3 in 1" in told
    assert says in told


@pytest.mark.parametrize(
    ("drawn_in", "read_with", "asks"),
    [
        (25.4, 0.001, [(0.0254, "inches"), (0.01, "cm")]),
        (1.0, 0.001, []),
        (1.0, 1.0, [(0.001, "mm")]),
        (10.0, 0.001, [(0.0254, "inches"), (0.01, "cm")]),
    ],
)
def test_the_units_in_which_a_drawing_fits_its_box(
    drawn_in: float, read_with: float, asks: list[tuple[float, str]], tmp_path: Path
) -> None:
    vertices, triangles = BODIES["box"][0]
    path = written(tmp_path / "part.stl", binary((vertices / drawn_in, triangles)))
    solid = SolidMesh(kind="mesh", file=str(path), unit_m=read_with)
    size_m, box_m = read_with * np.array([40.0, 30.0, 20.0]) / drawn_in, np.full(3, 0.12)
    assert bool(drawn_part(solid, box_m).other_units) == (drawn_in > 1.0)
    hint = unit_hint(solid, size_m, box_m)
    assert bool(hint) == (read_with == 1.0)
    assert [*other_units(solid, size_m, box_m)] == asks or not asks


def test_layers_that_break_the_kernels_rule_are_refused_by_the_plan(tmp_path: Path) -> None:
    path = opened(tmp_path, **around(0.04, 0.06), element_m=0.001, exchange="corrected",
                  heat_transfer_w_m2_k=None, layers=[1] * 5)  # fmt: skip
    with pytest.raises(BadInputError, match=r"layers = \[1, 1, 1, 1, 1\] .* the rule of 1/c_k"):
        expand(open_study(path))


def test_a_note_of_several_points_is_told_once(tmp_path: Path) -> None:
    sweep = {"sweep": {"keys": {"heat_transfer_w_m2_k": [200, 800]}}}
    lines = plan_of(tmp_path, sweep, **around(0.04, 0.01)).splitlines()
    (note,) = [line for line in lines if line.startswith("Sand: ")]
    assert "(At both points" in note
    assert note.endswith("the figures are those of heat_transfer_w__200.)")


def test_poured_metal_without_collisions_is_told(tmp_path: Path) -> None:
    study: dict[str, Any] = {
        "kind": "flow",
        "scenario": {"case": {"kind": "shoulder"}},
        "objective": {"measure": "mean_speed_m_s"},
    }
    told = {}
    for distance in (0.0, 0.8):
        study["scenario"]["collision_distance"] = distance
        path = tmp_path / "pour.yaml"
        path.write_text(yaml.safe_dump(study))
        told[distance] = plan_table(expand(open_study(path)), Prices(), 1)
    assert "Collisions: with collision_distance 0 particles" in told[0.0]
    assert "Collisions:" not in told[0.8]


@pytest.mark.parametrize("compiled", [False, True])
def test_what_is_to_be_compiled_is_told_once(
    compiled: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planning_of_sand, "are_compiled", lambda room: compiled)
    path = tmp_path / "engines.yaml"
    path.write_text(
        yaml.safe_dump(
            {
                "scenario": TUBE_SCENE,
                "objective": {"measure": "solid_fraction"},
                "sweep": {
                    "keys": {"engine.name": ["lammps", "reference"], "gravity_m_s2": [9.0, 10.0]}
                },
            }
        )
    )
    said = plan_table(expand(open_study(path)), Prices(), 1)
    # LAMMPS computes this scene alone
    told = "about 55 s of a core more, once. (At 2 of 4 points; first at engine_reference_"
    assert said.count("compiled") == (0 if compiled else 1)
    assert (told in said) != compiled


def test_obstacles_thinner_than_a_grain_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planning_of_sand, "are_compiled", lambda room: True)

    def table(thickness_m: float) -> str:
        vertices = [[0.02, 0.02], [0.06, 0.02], [0.06, 0.02 + thickness_m],
                    [0.02, 0.02 + thickness_m]]  # fmt: skip
        obstacle = {"kind": "polygon", "name": "shelf", "vertices_m": vertices}
        scene = {**TUBE_SCENE, "obstacles": [obstacle]}
        path = tmp_path / "shelf.yaml"
        path.write_text(
            yaml.safe_dump({"scenario": scene, "objective": {"measure": "solid_fraction"}})
        )
        return plan_table(expand(open_study(path)), Prices(), 1)

    told = [line for line in table(0.0005).splitlines() if line.startswith("Walls")]
    assert len(told) == 1
    assert told[0].startswith("Walls of shelf: the thinnest measures 0.500 mm, at (0.0")
    assert "Walls of" not in table(0.01)


@pytest.mark.parametrize(("displacement_m", "told"), [(0.05, True), (0.0019, False)])
def test_a_drive_beyond_reason_is_told(tmp_path: Path, displacement_m: float, told: bool) -> None:
    # a (2 pi 50 Hz)^2 over 9.80665 m/s2: 503 g for 50 mm, 19.1 g for 1.9 mm
    stage = {"hold": "displacement", "displacement_m": displacement_m, "frequency_hz": 50}
    path = tmp_path / "shaken.yaml"
    stages = [stage | {"duration_s": 0.1}]
    path.write_text(yaml.safe_dump({"based_on": "tube", "scenario": {"vibration": stages}}))
    table = plan_table(expand(open_study(path)), Prices(), 1)
    sentence = (
        "Acceleration 1: the box shakes at up to 503 g at 50 Hz: check the amplitude and its unit."
    )
    assert (sentence in table.splitlines()) is told
