"""A first study by ``sandmould new``: five templates, filled by options."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import trimesh
import yaml
from typer.testing import CliRunner, Result

from sandmould import SHIPPED
from sandmould.bad_input import BadInputError
from sandmould.cli.commands import app
from sandmould.scenario.placement import plan_counts, predicted_bed_height_m
from sandmould.study.plan.build_plan import Plan, open_plan
from tests.scenes import open_engine

STL = SHIPPED / "config" / "meshes" / "bracket.stl"


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def new(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["new", *arguments])


def written(*arguments: str) -> tuple[dict[str, Any], Plan]:
    """The file that a study was written to, as its user reads it and as it plans."""
    said = new(*arguments)
    assert said.exit_code == 0, said.output
    path = Path(said.output.partition(":")[0])
    return yaml.safe_load(path.read_text()), open_plan(path)


@pytest.mark.parametrize(
    ("name", "kind", "runs", "files"),
    [
        ("tube", "sand", 16, ["my_tube.yaml"]),
        ("pocket", "sand", 16, ["my_pocket.yaml"]),
        pytest.param("part", "sand", 2, ["my_part.stl", "my_part.yaml"], marks=pytest.mark.slow),
        ("deck", "deck", 10, ["my_deck.in.j2", "my_deck.yaml"]),
        ("casting", "solidification", 1, ["my_casting.stl", "my_casting.yaml"]),
    ],
)
def test_each_study_plans_as_it_is(name: str, kind: str, runs: int, files: list[str]) -> None:
    stated, plan = written(name)
    assert stated["title"].endswith("?")
    assert (plan.kind.name, len(plan.runs)) == (kind, runs)
    assert sorted(path.name for path in Path.cwd().iterdir()) == files


@pytest.mark.parametrize("name", ["tube", "pocket", "deck", "casting"])
def test_each_line_with_a_value_says_what_it_is(name: str) -> None:
    assert new(name, "mine.yaml").exit_code == 0
    above = ""
    for line in Path("mine.yaml").read_text().splitlines():
        # what one comment says of a list or of a mapping holds for the lines below it
        opens = line.rstrip().endswith(":") or "- kind:" in line
        assert opens or "#" in line or "#" in above or above.lstrip().startswith("- {"), line
        above = line


@pytest.mark.parametrize(
    ("options", "hold", "amplitude"),
    [
        (["--acceleration-g", "3"], "acceleration", {"acceleration_g": 3.0}),
        (["--velocity-mm-s", "47"], "velocity", {"velocity_m_s": 0.047}),
        (["--amplitude-mm", "0.05"], "displacement", {"displacement_m": 5e-05}),
    ],
)
def test_what_stays_the_same_is_written_in_the_units_of_a_study(
    options: list[str], hold: str, amplitude: dict[str, float]
) -> None:
    _, plan = written("tube", *options)
    vibration = plan.runs[0].scenario.vibration[0]
    assert vibration.hold == hold
    for key, value in amplitude.items():
        assert getattr(vibration, key) == value


def test_working_moment_and_mass_of_a_table_with_unbalance_motors() -> None:
    _, plan = written("pocket", "--unbalance", "60", "300")
    unbalance = plan.runs[0].scenario.vibration[0].unbalance
    assert (unbalance.moment_kg_m, unbalance.moving_mass_kg) == (0.6, 300.0)


def test_speeds_box_and_hole_land_in_their_keys() -> None:
    options = ["--frequency-hz", "20", "160", "--box-mm", "400", "500", "--hole-mm", "30", "50"]
    stated, plan = written("tube", "other.yaml", *options, "--material", "rojek_2004")
    assert stated["material"] == "rojek_2004"
    assert [run.scenario.vibration[0].frequency_hz for run in plan.runs[::4]] == [20, 40, 80, 160]
    scenario = plan.runs[0].scenario
    assert (scenario.box.width_m, scenario.box.height_m) == (0.4, 0.5)
    tube = scenario.obstacles[0]
    assert (tube.diameter_m, tube.length_m, tube.left_end_x_m) == (0.03, 0.05, 0.35)
    assert stated["objective"] == {"measure": "tube_fill_of_bed_fraction"}


@pytest.mark.parametrize("opens", ["down", "up"])
def test_a_pocket_is_closed_at_the_end_that_it_does_not_open_to(opens: str) -> None:
    _, plan = written("pocket", "--opens", opens, "--hole-mm", "30", "80")
    scenario = plan.runs[0].scenario
    (pocket,), (left, right, end) = scenario.cavities, scenario.obstacles
    assert (pocket.opens, pocket.size_m) == (opens, (0.03, 0.08))
    below = pocket.centre_m[1] - 0.04
    above = pocket.centre_m[1] + 0.04
    assert end.centre_m[1] == pytest.approx(above + 0.0015 if opens == "down" else below - 0.0015)
    assert left.centre_m[0] + 0.0015 == pytest.approx(pocket.centre_m[0] - 0.015)
    assert right.centre_m[0] - 0.0015 == pytest.approx(pocket.centre_m[0] + 0.015)


@pytest.mark.parametrize("name", ["tube", "pocket"])
def test_an_engine_takes_what_is_written(name: str, tmp_path: Path) -> None:
    _, plan = written(name)
    assert open_engine(plan.runs[0].scenario, tmp_path).grains == 0


def test_an_obstacle_has_no_name_of_a_wall(tmp_path: Path) -> None:
    assert new("pocket").exit_code == 0
    text = Path("my_pocket.yaml").read_text()
    Path("my_pocket.yaml").write_text(text.replace("left_side", "left"))
    with pytest.raises(BadInputError, match=r"'left' .* a name that no wall of the box has: floor"):
        open_plan(Path("my_pocket.yaml"))


@pytest.mark.parametrize("name", ["tube", "pocket"])
@pytest.mark.parametrize("hole", [("25", "50"), ("80", "80")])
def test_sand_stands_at_four_fifths_of_the_box(name: str, hole: tuple[str, str]) -> None:
    _, plan = written(name, "--hole-mm", *hole)
    scenario = plan.runs[0].scenario
    level_m = predicted_bed_height_m(scenario, plan_counts(scenario))
    assert level_m == pytest.approx(0.8 * scenario.box.height_m, rel=0.005)


def test_a_drawing_is_named_as_its_study_sees_it_and_its_mould_has_whole_elements() -> None:
    Path("parts").mkdir()
    shutil.copyfile(STL, Path("parts", "Größe 2.stl"))
    Path("studies").mkdir()
    stated, plan = written("casting", "studies/mine.yaml", "--drawing", "parts/Größe 2.stl")
    assert stated["scenario"]["shapes"][0]["file"] == "../parts/Größe 2.stl"
    scenario = plan.runs[0].scenario
    # the disc with its bracket is 80 x 60 x 16 mm, and an eighth of that an element
    assert scenario.element_m == 0.002
    assert scenario.box.low_m == (-0.06, -0.06, -0.038)
    assert scenario.box.high_m == (0.08, 0.06, 0.038)
    assert [path.name for path in Path("studies").iterdir()] == ["mine.yaml"]


@pytest.mark.slow
def test_a_part_of_foam_hangs_in_the_sand_by_its_top() -> None:
    _, plan = written("part", "--drawing", str(STL), "--amplitude-mm", "0.4")
    scenario = plan.runs[0].scenario
    assert scenario.pattern.position_m == (0.06, 0.06, 0.038)
    (gate,) = scenario.pattern.supports.hung
    # its top lies 8 mm over the origin of the drawing
    assert (gate.low_m[2], gate.high_m[2]) == (0.0455, 0.0465)
    assert scenario.vibration[0].displacement_m == 0.0004


@pytest.mark.slow
def test_one_speed_and_what_the_table_bears() -> None:
    options = ["--amplitude-mm", "1.2", "--largest-acceleration-g", "5"]
    _, plan = written("tube", *options, "--frequency-hz", "30", "30")
    assert [run.parameters for run in plan.runs][:1] == [{"vibration.0.frequency_hz": 30}]
    assert len({str(run.parameters) for run in plan.runs}) == 1
    Path("my_tube.yaml").unlink()
    _, plan = written("tube", *options, "--frequency-hz", "20", "70")
    assert plan.beyond_table
    assert all(point["vibration.0.frequency_hz"] > 32 for point in plan.beyond_table)


def test_foam_has_elements_by_its_thinnest_wall() -> None:
    for wall_mm, element_m in ((3.0, 0.008), (8.0, 0.012), (30.0, 0.016)):
        trimesh.creation.box(extents=(90.0, 60.0, wall_mm)).export("wall.stl")
        _, plan = written("part", "--drawing", "wall.stl")
        found_m = plan.runs[0].scenario.pattern.element_m
        assert found_m == pytest.approx(element_m, rel=0.15)
        Path("my_part.yaml").unlink()


def test_a_block_hangs_by_the_middle_of_its_top() -> None:
    trimesh.creation.box(extents=(80.0, 60.0, 20.0)).export("block.stl")
    _, plan = written("part", "--drawing", "block.stl")
    (gate,) = plan.runs[0].scenario.pattern.supports.hung
    assert (gate.low_m[:2], gate.high_m[:2]) == ((0.06, 0.05), (0.08, 0.07))


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["tube", "--hole-mm", "0", "50"], "--hole-mm = (0.0, 50.0) cannot be used: valid is grea"),
        (["tube", "--box-mm", "nan", "50"], "--box-mm = (nan, 50.0) cannot be used: valid is grea"),
        (["pocket", "--acceleration-g", "-1"], "--acceleration-g = -1.0 cannot be used: valid is"),
        (["tube", "--hole-mm", "25", "115"], "with its walls in the box of 120 x 110 mm."),
        (["pocket", "--hole-mm", "115", "20"], "with its walls in the box of 120 x 110 mm."),
        (["tube", "--hole-mm", "4", "50"], "diameter_m = 0.004 cannot be used: valid is more than"),
        (["tube", "--frequency-hz", "50", "20"], "cannot be used: valid is a low smaller than hi"),
        (["tube", "--material", "gold"], "valid is the name of a material of kind sand: "),
        (["casting", "--hole-mm", "25", "50"], "leave --hole-mm out with casting."),
        (["part", "--unbalance", "60", "300"], "leave --unbalance out with part."),
        (["casting", "--drawing", "none.stl"], "valid is a readable file (No such file"),
        (["casting", "--material", "gold"], "name of a material of kind solidification: "),
        (["deck", "Mine.yaml"], "valid is small letters, digits and _, a letter first"),
        (
            ["tube", "--acceleration-g", "1", "--amplitude-mm", "1"],
            "give one of --acceleration-g and --amplitude-mm: only one can stay the same",
        ),
    ],
)
def test_nonsense_is_one_sentence_and_nothing_is_written(
    arguments: list[str], sentence: str
) -> None:
    said = new(*arguments)
    assert said.exit_code == 1
    assert sentence in said.stderr
    assert len(said.stderr.splitlines()) == 1
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize("there", ["mine.yaml", "mine.in.j2"])
def test_no_file_is_replaced(there: str) -> None:
    Path(there).write_text("before")
    said = new("deck", "mine.yaml")
    assert (said.exit_code, said.stderr) == (
        1,
        f"FILE = '{there}' cannot be used: valid is a new file: none is replaced.\n",
    )
    assert Path(there).read_text() == "before"
    assert [path.name for path in Path.cwd().iterdir()] == [there]
