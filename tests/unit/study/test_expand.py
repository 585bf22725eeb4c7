"""Runs of a study: ids, seeds, sources, and problems told at the swept key."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.definition.run import Run
from sandmould.runs.hashing import scenario_hash
from sandmould.study.plan.expand import MOST_PROBLEMS, as_planned, expand, replicate_seed
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import read_run
from tests.bracket import BRACKET
from tests.planned import write_plan

FREQUENCY = "vibration.0.frequency_hz"
Runs = Callable[..., list[Run]]


@pytest.fixture
def runs_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Runs:
    """Expand a study based on the shipped tube."""
    monkeypatch.chdir(tmp_path)

    def runs(**tree: Any) -> list[Run]:
        path = Path("trial.yaml")
        path.write_text(yaml.safe_dump({"based_on": "tube", **tree}), encoding="utf-8")
        return expand(open_study(path))

    return runs


def swept(**keys: Any) -> dict[str, Any]:
    return {"keys": {key.replace("__", "."): values for key, values in keys.items()}}


def leaves(tree: Any, above: str = "") -> set[str]:
    """Key paths of the leaves; a list of numbers is one leaf."""
    if isinstance(tree, dict):
        items: Any = tree.items()
    elif isinstance(tree, list) and tree and isinstance(tree[0], dict):
        items = enumerate(tree)
    else:
        return {above}
    return {k for n, v in items for k in leaves(v, f"{above}.{n}" if above else str(n))}


def test_id_is_label_replicate_and_hash(runs_of: Runs) -> None:
    (run, *_) = runs_of(sweep=swept(vibration__0__frequency_hz=[50, 75]), replicates=2)
    assert re.fullmatch(r"frequency_50_r1_[0-9a-f]{6}", run.run)
    assert run.run.endswith(scenario_hash(run.scenario)[:6])
    assert run.study == "trial"


def test_ids_repeat_and_differ_from_run_to_run() -> None:
    demo = ROOT / "config" / "studies" / "tube_demo.yaml"
    runs, again = expand(open_study(demo)), expand(open_study(demo))
    assert [r.run for r in runs] == [r.run for r in again]
    assert len({r.run for r in runs}) == len(runs)


def test_ids_do_not_depend_on_the_order_of_columns(runs_of: Runs) -> None:
    one = runs_of(sweep={"keys": {FREQUENCY: [25, 50], "sand.size_scale": [5, 6]}})
    points = [{"sand.size_scale": s, FREQUENCY: f} for s in (6, 5) for f in (25, 50)]
    other = runs_of(sweep={"design": "list", "points": points})
    assert {r.run for r in one} == {r.run for r in other}


def test_changed_base_gives_new_ids(runs_of: Runs) -> None:
    sweep = swept(vibration__0__frequency_hz=[25, 50])
    before = {r.run for r in runs_of(sweep=sweep)}
    after = {r.run for r in runs_of(sweep=sweep, scenario={"sand": {"size_classes": 4}})}
    assert not before & after


def test_labels_are_short_and_safe(runs_of: Runs) -> None:
    walls = [{"friction": 0.1}, {"friction": 0.2}]
    keys = {
        "contact.grain_grain.friction": [0.25],
        "contact.no_tension": ["elastic"],
        "contact.grain_wall": walls,
        "sand.density_kg_m3": [2400],
        "fill.drop_height_m": [1e-4],
    }
    for run in runs_of(sweep={"keys": keys}):
        assert re.fullmatch(r"[a-z][a-z0-9_]*", run.run)
        assert len(run.run) < 70
    runs = runs_of(sweep={"keys": {"contact.grain_grain.friction": [0.25],
                                   "contact.grain_wall.friction": [0.1]}})  # fmt: skip
    assert runs[0].run.startswith("grain_grain_fric_0p25_grain_wall_frict_0p1_r1_")
    assert runs_of(sweep=swept(fill__drop_height_m=[1e-5]))[0].run.startswith("drop_height_1em05_")
    sideways = runs_of(sweep=swept(vibration__0__direction=[[1, 0.5]]))
    assert sideways[0].run.startswith("direction_1_0p5_r1_")
    assert runs_of()[0].run.startswith("base_r1_")


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("vibration.0.acceleration_g", [1.0, 2.0]),
        ("vibration.0.direction", ["vertical", "horizontal", [1.0, 1.0]]),
        ("vibration.0.duration_s", [1.0, 3.0]),
        ("fill.layers.0.height_m", [0.02, 0.027]),
        ("obstacles.0.diameter_m", [0.02, 0.024]),
        ("obstacles.0.length_m", [0.04, 0.05]),
    ],
)
def test_any_key_of_the_scene_can_be_swept(runs_of: Runs, key: str, values: list[Any]) -> None:
    runs = runs_of(sweep={"keys": {key: values}})
    assert [run.parameters[key] for run in runs] == values
    assert len({run.run.rsplit("_r", 1)[0] for run in runs}) == len(values)


def test_replicates_are_blocks_with_the_same_seed_at_every_point(runs_of: Runs) -> None:
    runs = runs_of(sweep=swept(vibration__0__frequency_hz=[25, 50, 75]), replicates=4)
    seeds = {r: {run.seed for run in runs if run.replicate == r} for r in (1, 2, 3, 4)}
    assert all(len(s) == 1 for s in seeds.values())
    assert len(set.union(*seeds.values())) == 4
    assert seeds[3] == {replicate_seed(1, 3)}
    other = runs_of(scenario={"seed": 2})[0]
    assert other.seed == replicate_seed(2, 1) != replicate_seed(1, 1)


def test_a_round_writes_a_value_as_the_sweep_does() -> None:
    # a deck would have 0.0 as another text than 0, and the same seeds twice
    chosen = as_planned({"friction": 0.0}, [{"friction": 0}, {"friction": 0.5}])
    assert str(chosen["friction"]) == "0"
    assert as_planned({"friction": 0.2}, [{"friction": 0}]) == {"friction": 0.2}


def test_more_replicates_keep_the_runs_there_are(runs_of: Runs) -> None:
    few = {r.run for r in runs_of(replicates=2)}
    assert few < {r.run for r in runs_of(replicates=5)}


def test_swept_values_reach_the_scenario(runs_of: Runs) -> None:
    runs = runs_of(sweep=swept(vibration__0__frequency_hz=[25, 50], sand__size_scale=[5]))
    assert [r.parameters[FREQUENCY] for r in runs] == [25, 50]
    assert [r.scenario.vibration[0].frequency_hz for r in runs] == [25, 50]
    assert {r.scenario.sand.size_scale for r in runs} == {5}
    assert {r.scenario.vibration[0].acceleration_g for r in runs} == {1.5}


def test_swept_section_merges_and_swept_list_replaces(runs_of: Runs) -> None:
    first, second = runs_of(sweep=swept(contact__grain_wall=[{"friction": 0.1}, {"friction": 0.2}]))
    assert first.scenario.contact.grain_wall.friction == 0.1
    assert first.scenario.contact.grain_wall.normal_stiffness_n_m == 2e4
    assert second.sources["contact.grain_wall.friction"] == "sweep of trial.yaml"
    assert second.sources["contact.grain_wall.damping_ratio"] == "Rojek 2004, section 4.1"
    layers = [[{"count": 500}, {"mass_kg": 0.02}], [{"height_m": 0.05}]]
    first, second = runs_of(sweep=swept(fill__layers=layers))
    assert [layer.count for layer in first.scenario.fill.layers] == [500, None]
    assert second.scenario.fill.layers[0].height_m == 0.05
    assert second.sources["fill.layers.0.height_m"] == "sweep of trial.yaml"
    assert second.sources["fill.layers.0.repeat"] == "argued default, docs/choices.md"


def test_swept_stage_replaces_the_whole_stage(runs_of: Runs) -> None:
    (run,) = runs_of(sweep=swept(vibration__0=[{"displacement_m": 1e-4, "hold": "displacement"}]))
    assert run.scenario.vibration[0].acceleration_g is None
    assert run.sources["vibration.0.displacement_m"] == "sweep of trial.yaml"


@pytest.mark.parametrize("name", ["tube_demo", "tube_paper", "tube_3d_small"])
def test_every_leaf_has_a_source(name: str) -> None:
    for run in expand(open_study(ROOT / "config" / "studies" / f"{name}.yaml")):
        assert set(run.sources) == leaves(run.scenario.model_dump(mode="json"))
        assert all(run.sources.values())


def test_sources_name_paper_file_default_sweep_and_seed(runs_of: Runs) -> None:
    run = runs_of(sweep=swept(vibration__0__frequency_hz=[25]), scenario={"box": {"width_m": 0.13}},
                  replicates=2)[1]  # fmt: skip
    assert run.sources["sand.density_kg_m3"] == "Rojek 2004, section 4.1"
    assert run.sources["sand.sieve.2.opening_m"].startswith("bounds from Rojek 2004")
    assert run.sources["box.width_m"] == "trial.yaml"
    assert run.sources["box.height_m"] == "config/scenarios/tube.yaml"
    assert run.sources["sand.disc_thickness_m"] == "argued default, docs/choices.md"
    assert run.sources[FREQUENCY] == "sweep of trial.yaml"
    assert run.sources["vibration.0.acceleration_g"] == "Rojek 2004, section 4.2"
    assert run.sources["seed"] == "replicate 2 of seed 1 (default)"


def test_source_of_a_list_of_numbers(runs_of: Runs) -> None:
    stage = {"acceleration_g": 1.5, "direction": [0.0, 1.0]}
    (run,) = runs_of(scenario={"vibration": [stage]})
    assert run.sources["vibration.0.direction"] == "trial.yaml"


def told(runs_of: Runs, **tree: Any) -> list[str]:
    with pytest.raises(BadInputError) as caught:
        runs_of(**tree)
    return str(caught.value).splitlines()


def test_misfit_is_blamed_on_the_swept_value_that_brings_it(runs_of: Runs) -> None:
    sweep = swept(sand__size_scale=[5, 30], contact__no_tension=["total", "elastic"])
    assert told(runs_of, sweep=sweep) == [
        "trial.yaml: sweep.keys.sand.size_scale = 30 cannot be used: valid is one with which "
        "scenario.obstacles.0.diameter_m, here 0.024, is more than the largest grain, 0.0290371 m."
    ]


def test_misfit_of_values_together_names_them_all(runs_of: Runs) -> None:
    sweep = swept(fill__layers__0__height_m=[0.02, 0.03], box__height_m=[0.11, 0.098])
    assert told(runs_of, sweep=sweep) == [
        "trial.yaml: sweep.keys = {'box.height_m': 0.098, 'fill.layers.0.height_m': 0.03} cannot "
        "be used: valid is one with which scenario.fill.layers, here a bed about 0.1025 m high, "
        "is layers that fit into box.height_m, 0.098 m."
    ]


def test_misfit_of_the_base_is_told_there(runs_of: Runs) -> None:
    lines = told(
        runs_of,
        sweep=swept(contact__no_tension=["total", "elastic"]),
        scenario={"box": {"height_m": 0.09}},
    )
    assert len(lines) == 1
    assert lines[0].startswith("config/scenarios/tube.yaml: scenario.fill.layers = ")


def test_bad_point_of_a_list_is_named_by_its_number(runs_of: Runs) -> None:
    points = [{"sand.size_scale": 5}, {"sand.size_scale": "big"}]
    assert told(runs_of, sweep={"design": "list", "points": points}) == [
        "trial.yaml: sweep.points.1.sand.size_scale = 'big' cannot be used: valid is a number."
    ]


def test_bad_part_of_a_swept_section_is_named_inside_it(runs_of: Runs) -> None:
    assert told(runs_of, sweep=swept(fill__layers=[[{"height_m": -1}]])) == [
        "trial.yaml: sweep.keys.fill.layers.0.height_m = -1 cannot be used: "
        "valid is a number greater than 0."
    ]


def test_same_point_twice_is_refused(runs_of: Runs) -> None:
    assert told(runs_of, sweep=swept(sand__size_scale=[5, 5.0])) == [
        "trial.yaml: sweep: sand.size_scale = 5 stands twice."
    ]


def test_many_problems_are_told_by_the_first(runs_of: Runs) -> None:
    lines = told(runs_of, sweep=swept(sand__size_scale=[-n for n in range(1, 99)]), replicates=9)
    assert len(lines) == MOST_PROBLEMS
    assert lines[0].startswith("trial.yaml: sweep.keys.sand.size_scale = -1 cannot be used")


def test_run_finds_its_mesh_from_anywhere_and_another_mesh_is_another_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, elsewhere = tmp_path / "own", tmp_path / "elsewhere"
    for place in (folder, elsewhere):
        place.mkdir()
    mesh, content = folder / "part.stl", BRACKET.read_bytes()
    mesh.write_bytes(content)
    path = folder / "trial.yaml"
    path.write_text(
        "based_on: bracket\nscenario: {obstacles: [{kind: mesh, file: part.stl, "
        "unit_m: {value: 0.001, unit: m, source: mm}, position_m: [0.06, 0.05, 0.045]}]}",
        encoding="utf-8",
    )
    monkeypatch.chdir(elsewhere)
    (run,) = expand(open_study(path))
    write_plan([run], elsewhere)
    again = read_run(elsewhere / "runs" / run.run / "scenario.yaml")
    assert again.scenario.scene.meshes[0].measure == pytest.approx(4.772e-5, rel=1e-3)
    # the header of a binary STL says nothing about the surface, but the file is another one
    mesh.write_bytes(b"another" + content[7:])
    (other,) = expand(open_study(path))
    assert other.run != run.run
    with pytest.raises(BadInputError, match="the file that the study was planned with") as caught:
        _ = read_run(elsewhere / "runs" / run.run / "scenario.yaml").scenario.scene
    assert "obstacles.0.file" in str(caught.value)


def test_shipped_mesh_is_named_from_the_repository() -> None:
    (run,) = expand(open_study(ROOT / "config" / "studies" / "bracket_small.yaml"))
    (obstacle,) = run.scenario.model_dump()["obstacles"]
    assert obstacle["file"] == "config/meshes/bracket.stl"
    assert run.sources["obstacles.0.unit_m"] == "drawn in mm, tests/bracket.py"
