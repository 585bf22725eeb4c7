"""A result stays one wherever it lies and whoever installed the program; an edit touches its runs.

Ten studies, five of which name files of a user's, are finished by a stand-in for their engines.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.execution.packs.pack import pack
from sandmould.execution.packs.unpack import unpack
from sandmould.execution.tidy import orphans
from sandmould.kinds.registry import kind_of
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import write_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.announcement import left_line
from sandmould.study.plan.build_plan import RESULTS, Plan, changed_since, open_plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.lacking import Need
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import changed_line, read_run, write_study
from tests.planned import announce

MESHES = ROOT / "config" / "meshes"
DECK = """\
# a comment
{# and another #}
read_data grains.data
{% if number > 100 %}
fix slow all viscous 0.1
{% endif %}
thermo_style custom step time ke
run {{ number }} # from {{ seed }}
"""
STUDIES = {
    "stl": """\
based_on: bracket
scenario:
  obstacles: [{kind: mesh, file: part.stl, unit_m: 0.001, position_m: [0.06, 0.05, 0.045]}]
sweep: {keys: {obstacles.0.position_m: [[0.06, 0.05, 0.045], [0.06, 0.05, 0.046]]}}
""",
    "step": """\
based_on: bracket_freezes
scenario: {shapes: [{kind: mesh, name: part, file: part.step, position_m: [0.062, 0.052, 0.072]}]}
sweep:
  design: list
  points: [{exchange: faces, element_m: 0.004, layers: []}]
reference: {exchange: faces, element_m: 0.004, layers: []}
""",
    "mesh": """\
based_on: foam_supports
scenario: {pattern: {shape: {kind: file, file: wall.vtk, unit_m: 0.001}}}
sweep: {keys: {pattern.shape.file: [wall.vtk, more/wall.vtk]}}
""",
    "picture": """\
based_on: drawn_three_ways
sweep:
  design: list
  points:
    - shapes: [{kind: image, file: part.png, pixel_m: 0.005}]
    - shapes: [{kind: rectangle, low_m: [0.0, 0.0], high_m: [0.02, 0.06]}]
""",
    "deck": """\
kind: deck
trust_deck: true
scenario:
  template: chute.in.j2
  files: [grains.data]
  values: {number: 100}
  measures: {kinetic_j: KinEng}
sweep: {keys: {values.number: [100, 200]}}
replicates: 2
objective: {measure: kinetic_j}
""",
    "layers": """\
based_on: tube
sweep:
  design: list
  points:
    - fill.layers: [{height_m: 0.02}]
      sand.sieve:
        - {opening_m: 0.0004, passing_fraction: 0}
        - {opening_m: 0.001, passing_fraction: 1}
    - fill.layers: [{height_m: 0.01}, {height_m: 0.011}]
      sand.sieve:
        - {opening_m: 0.0003, passing_fraction: 0}
        - {opening_m: 0.001, passing_fraction: 1}
""",
    "foam": """\
based_on: l_pattern_small
sweep: {keys: {time_step.fraction: [0.7, 0.75]}}
""",
    "casting": """\
based_on: plates
sweep:
  design: list
  points:
    - {exchange: faces, element_m: 0.01, layers: []}
    - {exchange: faces, element_m: 0.005, layers: []}
reference: {exchange: faces, element_m: 0.005, layers: []}
""",
    "flow": "based_on: tank_small\nscenario: {duration_s: 0.01}\n",
    "plain": """\
based_on: tube
scenario: {engine: {name: reference}, record: {snapshot_every_s: 0.04}, seed: 3}
sweep: {keys: {contact.grain_grain.normal_stiffness_n_m: [60000, 70000]}}
replicates: 2
""",
}
NEEDS = """
import json, pathlib, sys
from sandmould.study.plan.build_plan import RESULTS, open_plan
needs = {}
for name in sys.argv[1:]:
    plan = open_plan(pathlib.Path(f"{name}.yaml"))
    lacks = plan.lacks(RESULTS)
    needs[name] = [lacks[run.run].need if run.run in lacks else 0 for run in plan.runs]
print(json.dumps(needs))
"""
"""What the runs of some studies need, for a process of another installation."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ten studies, their files and results."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "more").mkdir()
    for name in ("part.stl", "part.step", "part.png", "wall.vtk", "more/wall.vtk"):
        shipped = {"part.png": "l_shape.png"}.get(name, Path(name).name.replace("part", "bracket"))
        shutil.copy(MESHES / shipped, folder / name)
    other = folder / "more" / "wall.vtk"
    other.write_bytes(other.read_bytes().replace(b"ASCII", b"ascii"))
    (folder / "chute.in.j2").write_text(DECK, encoding="utf-8")
    (folder / "grains.data").write_text("three grains\n", encoding="utf-8")
    for name, text in STUDIES.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    before = Path.cwd()
    os.chdir(folder)
    try:
        for name in STUDIES:
            finish(open_plan(Path(f"{name}.yaml")))
    finally:
        os.chdir(before)
    return folder


def finish(plan: Plan) -> None:
    """Leave what runs leave that are at their end, without computing them."""
    announce(plan, RESULTS, 1)
    for run in (*plan.runs, *plan.fills):
        folder, planning = RESULTS / plan.study.name / run.place, kind_of(run.scenario).planning
        for name in ("deck.in", "series.tsv", "measures.tsv"):
            (folder / name).write_text(f"{name}\n", encoding="utf-8")
        origin = {
            "scenario_sha256": scenario_hash(run.scenario),
            "template_sha256": planning.template_hash(run.scenario),
        }
        outcome = RunOutcome(Outcome.FINISHED, "", 1.0, 1.0)
        write_manifest(folder, "computed", {}, origin, {"wall_s": 1.0}, outcome=outcome.text)
        write_manifest(folder, "measured", {}, code=planning.measured_by(run.scenario))
        outcome.write(folder / "outcome.json")


def check_whole(studies: Path = Path()) -> None:
    """See that no study in a folder has a run to compute or to measure, or one left over."""
    for name in STUDIES:
        plan = open_plan(studies / f"{name}.yaml")
        assert plan.lacks(RESULTS) == {}, name
        assert orphans(plan, RESULTS) == [], name


def test_runs_are_the_same_in_three_folders(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Copied, deeper than it was.
    copied = tmp_path / "far" / "away" / "copied"
    shutil.copytree(finished, copied)
    monkeypatch.chdir(copied)
    check_whole()
    # Moved on, the studies apart from their results.
    moved = tmp_path / "moved"
    (moved / "studies").mkdir(parents=True)
    shutil.move(copied / RESULTS, moved)
    for path in copied.iterdir():
        shutil.move(path, moved / "studies")
    monkeypatch.chdir(moved)
    check_whole(Path("studies"))
    # Packed there, unpacked beside a copy of the studies alone.
    packs = [tmp_path / f"{name}.zip" for name in STUDIES]
    for name, path in zip(STUDIES, packs, strict=True):
        pack(open_plan(Path("studies", f"{name}.yaml")), RESULTS, path)
    shutil.copytree(moved / "studies", tmp_path / "unpacked")
    monkeypatch.chdir(tmp_path / "unpacked")
    for path in packs:
        said = unpack(path, RESULTS)
        assert re.match(r"\w+: [1-9] runs? taken$", said), said
    check_whole()


def test_a_report_of_a_moved_study_reads_the_files_that_have_moved_with_it(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    moved = tmp_path / "moved"
    shutil.copytree(finished, moved)
    monkeypatch.chdir(moved)
    study, folder = Path("picture.yaml"), RESULTS / "picture"
    open_plan(study)  # a look alone
    (run,) = (p for p in folder.glob("runs/*/scenario.yaml") if "part.png" in p.read_text())

    def picture() -> Path:
        return read_run(run).scenario.shapes[0].path

    assert not picture().samefile(moved / "part.png")
    assert changed_since(study, folder).startswith("picture.yaml was changed or moved: ")
    assert picture().samefile(moved / "part.png")


def test_rounds_go_on_where_the_files_of_their_points_have_moved(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished)
    study = open_study(Path("mesh.yaml"))
    point = expand(study)[0].parameters
    (here,) = expand(study, [(point, 2)])[2:]
    shutil.copytree(finished, tmp_path / "there", ignore=shutil.ignore_patterns("results"))
    monkeypatch.chdir(tmp_path / "there")
    (there,) = expand(open_study(Path("mesh.yaml")), [(point, 2)])[2:]
    assert there.run == here.run
    assert there.parameters != here.parameters


def test_a_mesh_that_changed_since_the_plan_stops_its_run(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(finished, tmp_path / "edited", ignore=shutil.ignore_patterns("results"))
    monkeypatch.chdir(tmp_path / "edited")
    one, other = open_plan(Path("mesh.yaml")).runs
    shutil.copy("more/wall.vtk", "wall.vtk")
    with pytest.raises(BadInputError, match="this one has changed since"):
        kind_of(one.scenario).execution.render(one, tmp_path)
    kind_of(other.scenario).execution.render(other, tmp_path)


EDITS = {
    "a spring": ("plain", "plain.yaml", b"60000", b"61000", 2),
    "a sieve class": ("layers", "layers.yaml", b"0.0004", b"0.0005", 1),
    "a layer": ("layers", "layers.yaml", b"0.011", b"0.012", 1),
    "the seed": ("plain", "plain.yaml", b"seed: 3", b"seed: 4", 4),
    "the step": ("foam", "foam.yaml", b"0.75", b"0.76", 1),
    "one branch of a deck": ("deck", "chute.in.j2", b"0.1", b"0.2", 2),
    "a file beside a deck": ("deck", "grains.data", b"three", b"four", 4),
    "a mesh that one point names": ("mesh", "more/wall.vtk", b"ascii", b"Ascii", 1),
    "a picture that one point names": ("picture", "part.png", b"B`\x82", b"B`\x82.", 1),
    "a comment in a deck": ("deck", "chute.in.j2", b"# a comment", b"# nothing", 0),
}


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_touches_just_its_runs(
    finished: Path, monkeypatch: pytest.MonkeyPatch, edit: str
) -> None:
    study, file, was, now, touched = EDITS[edit]
    monkeypatch.chdir(finished)
    path = Path(file)
    before = path.read_bytes()
    assert was in before
    path.write_bytes(before.replace(was, now))
    try:
        plan = open_plan(Path(f"{study}.yaml"))
        lacks = plan.lacks(RESULTS)
        needs = [lacks[run.run].need for run in plan.runs if run.run in lacks]
    finally:
        path.write_bytes(before)
    assert needs == touched * [Need.COMPUTE]


def test_runs_are_the_same_where_the_study_sweeps_one_more_key(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(finished, tmp_path / "edited")
    monkeypatch.chdir(tmp_path / "edited")
    before = {run.run for run in open_plan(Path("plain.yaml")).runs}
    one_more = "contact.grain_grain.friction: [0.6, 0.8]"
    friction = "sweep: {keys: {contact.grain_grain.normal_stiffness_n_m: [60000, 70000], "
    text = STUDIES["plain"].split("sweep:")[0] + friction + one_more + "}}\nreplicates: 2\n"
    Path("plain.yaml").write_text(text, encoding="utf-8")
    plan = open_plan(Path("plain.yaml"))
    assert len(plan.runs) == 8
    assert {run.run for run in plan.runs} > before
    assert not before & plan.lacks(RESULTS).keys()
    assert orphans(plan, RESULTS) == []
    # of another scenario, though its name ends alike
    shutil.rmtree(RESULTS / "plain" / "runs")
    stray = RESULTS / "plain" / "runs" / f"other_r1_{plan.runs[0].run[-6:]}"
    stray.mkdir(parents=True)
    shutil.copy(next(RESULTS.glob("layers/runs/*/products.json")), stray)
    assert stray.name not in {run.run for run in open_plan(Path("plain.yaml")).runs}


def test_a_deck_is_only_measured_again_where_another_measure_is_asked(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(finished, tmp_path / "edited")
    monkeypatch.chdir(tmp_path / "edited")
    more = STUDIES["deck"].replace("KinEng}", "KinEng, potential_j: PotEng}")
    Path("deck.yaml").write_text(more, encoding="utf-8")
    with pytest.raises(BadInputError, match=r"potential_j = 'PotEng'.*series.tsv has as"):
        open_plan(Path("deck.yaml"))
    for series in RESULTS.glob("deck/runs/*/series.tsv"):
        series.write_text("time_s\tlog_Step\tlog_KinEng\tlog_PotEng\n", encoding="utf-8")
    plan = open_plan(Path("deck.yaml"))
    assert [lack.need for lack in plan.lacks(RESULTS).values()] == 4 * [Need.MEASURE]
    assert left_line(plan, RESULTS, 1) == "All runs have ended here: 4; 4 are to be measured.\n"
    folder, study = RESULTS / "deck", plan.study.study
    assert "deck.yaml was changed or moved" in changed_line(study, plan.study.path, folder)
    write_study(study, folder)
    assert changed_line(study, plan.study.path, folder) == ""
    # a damaged log ends no plan
    for series in RESULTS.glob("deck/runs/*/series.tsv"):
        series.write_bytes(b"\xff\x00\n\xff")
    assert len(open_plan(Path("deck.yaml")).runs) == 4
    # one that ended for a measure which its log lacked
    (folder,) = RESULTS.glob(f"deck/runs/{plan.runs[0].run}")
    RunOutcome(Outcome.BAD_INPUT, "the log lacks it", 1.0, 1.0).write(folder / "outcome.json")
    assert plan.lacks(RESULTS)[plan.runs[0].run].need is Need.COMPUTE


KEY = "    measure_at_rest: bool = quantity("
LAST_IMPORT = "import numpy as np\n"


def test_another_installation_computes_what_its_code_computes_otherwise(
    finished: Path, tmp_path: Path
) -> None:
    site = tmp_path / "site"
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    shutil.unpack_archive(wheel, site, "zip")

    def needs(*studies: str) -> dict[str, set[Need]]:
        command = [sys.executable, "-c", NEEDS, *studies]
        environment = os.environ | {"PYTHONPATH": str(site)}
        ran = subprocess.run(
            command, cwd=finished, env=environment, check=True, capture_output=True
        )
        return {name: set(map(Need, of_runs)) for name, of_runs in json.loads(ran.stdout).items()}

    assert needs(*STUDIES) == {name: {Need.NOTHING} for name in STUDIES}
    for file, was, now in (
        ("scenario/scenario.py", KEY, f"    more: int = 1\n{KEY}"),
        ("scenario/scenario.py", "\n        0.05, ", "\n        0.04, first=0.05, description="),
        ("casting/mps/particles.py", LAST_IMPORT, f"{LAST_IMPORT}MORE = 1\n"),
        ("analysis/tube_fill.py", LAST_IMPORT, f"{LAST_IMPORT}MORE = 1\n"),
    ):
        path = site / "sandmould" / file
        text = path.read_text(encoding="utf-8")
        assert text.count(was) == 1, file
        path.write_text(text.replace(was, now), encoding="utf-8")
    assert needs("casting", "deck", "flow", "layers", "plain") == {
        "casting": {Need.NOTHING},
        "deck": {Need.NOTHING},
        "flow": {Need.COMPUTE},
        # takes the default that has changed
        "layers": {Need.COMPUTE},
        "plain": {Need.MEASURE},
    }
