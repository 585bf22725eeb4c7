"""Studies that compare: what they may ask for, and the runs of a cross check."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.definition.run import Run
from sandmould.engines.program import build_program
from sandmould.scenario.engine import ENGINE_NAMES
from sandmould.statistics.config import Goal, Objective
from sandmould.study.plan.build_plan import Plan, open_plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table, read_run
from sandmould.study.plan.price import Prices
from tests.planned import write_plan

FREQUENCY = "vibration.0.frequency_hz"
MARGINS = {"margins": {"tube_fill_fraction": 0.03}}
CHECKED: dict[str, Any] = {
    "scenario": {"engine": {"name": "reference"}},
    "sweep": {"keys": {FREQUENCY: [25, 50]}},
    "replicates": 3,
    "cross_check": {"engine": "lammps", "at": {FREQUENCY: 50}, "replicates": 2},
    "equivalence": MARGINS,
}
NAMED = f"{', '.join(map(repr, ENGINE_NAMES[:-1]))} or {ENGINE_NAMES[-1]!r}"
Planned = Callable[..., Plan]


@pytest.fixture
def planned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Planned:
    """Plan a study based on the shipped tube."""
    monkeypatch.chdir(tmp_path)

    def plan(**tree: Any) -> Plan:
        path = Path("trial.yaml")
        path.write_text(yaml.safe_dump({"based_on": "tube", **tree}), encoding="utf-8")
        return open_plan(path)

    return plan


def told(planned: Planned, **tree: Any) -> str:
    with pytest.raises(BadInputError) as caught:
        planned(**tree)
    return str(caught.value)


def twins() -> list[Run]:
    return expand(open_study(ROOT / "config" / "studies" / "engine_twins.yaml"))


def test_twins_of_a_replicate_have_the_same_grains_in_the_same_places() -> None:
    runs = twins()
    engines = {run.scenario.engine.name for run in runs}
    assert engines == {"lammps", "liggghts", "reference"}
    assert max(run.replicate for run in runs) >= 5
    for replicate in (1, 2):
        alike = [run for run in runs if run.replicate == replicate]
        assert len({run.seed for run in alike}) == 1
        first, *others = (build_program(run.scenario).layers for run in alike)
        for other in others:
            for ours, theirs in zip(first, other, strict=True):
                np.testing.assert_array_equal(ours.position_m, theirs.position_m)
                np.testing.assert_array_equal(ours.radius_m, theirs.radius_m)
    assert len({run.seed for run in runs}) == max(run.replicate for run in runs)


def test_twins_differ_in_their_engine_alone() -> None:
    alike = [run.scenario.model_dump() for run in twins() if run.replicate == 1]
    names = {scenario["engine"].pop("name") for scenario in alike}
    assert len(names) == 3
    assert all(scenario == alike[0] for scenario in alike)


def test_cross_check_adds_runs_of_its_point_on_the_other_engine(planned: Planned) -> None:
    runs = planned(**CHECKED).runs
    checks = [run for run in runs if run.part == "cross_check"]
    assert len(runs) == 6 + 2
    assert [run.parameters for run in checks] == [{FREQUENCY: 50}] * 2
    assert {run.scenario.engine.name for run in checks} == {"lammps"}
    own = {run.replicate: run for run in runs if run.parameters == {FREQUENCY: 50}
           and run.part == "sweep"}  # fmt: skip
    for run in checks:
        assert run.seed == own[run.replicate].seed
        assert run.run.startswith(f"engine_lammps_frequency_50_r{run.replicate}_")
        assert run.sources["engine.name"] == "cross_check of trial.yaml"


def test_all_replicates_are_checked_unless_fewer_are_asked_for(planned: Planned) -> None:
    check = {"engine": "lammps", "at": {FREQUENCY: 25}}
    runs = planned(**{**CHECKED, "cross_check": check}).runs
    assert [r.replicate for r in runs if r.part == "cross_check"] == [1, 2, 3]


def test_a_shorter_check_has_runs_of_both_engines(planned: Planned) -> None:
    check = CHECKED["cross_check"] | {"vibration_s": 0.5}
    runs = planned(**{**CHECKED, "cross_check": check}).runs
    short = [run for run in runs if run.scenario.vibrations[-1].duration_s == 0.5]
    assert [(run.part, run.scenario.engine.name, run.replicate) for run in short] == [
        (part, engine, replicate)
        for part, engine in (
            ("cross_check", "lammps"), ("cross_check, own engine", "reference"),
        )
        for replicate in (1, 2)
    ]  # fmt: skip
    assert short[2].run.startswith("engine_reference_frequency_50_r1_")
    assert len(runs) == 6 + 4


def test_study_without_a_sweep_can_be_checked(planned: Planned) -> None:
    tree = {**CHECKED, "sweep": {}, "cross_check": {"engine": "lammps"}}
    assert [r.part for r in planned(**tree).runs] == ["sweep"] * 3 + ["cross_check"] * 3


def test_part_of_a_run_is_in_the_plan_on_disk(planned: Planned, tmp_path: Path) -> None:
    runs = planned(**CHECKED).runs
    write_plan(runs, tmp_path)
    table = pd.read_csv(tmp_path / "runs.tsv", sep="\t")
    assert list(table.columns) == ["run", FREQUENCY, "replicate", "seed", "part"]
    assert list(table["part"]).count("cross_check") == 2
    for run in runs:
        assert read_run(tmp_path / "runs" / run.run / "scenario.yaml") == run


def test_price_is_that_of_each_engine(planned: Planned) -> None:
    rates = {("reference", 2): 2e7, ("lammps", 2): 2e6}
    rows = plan_table(planned(**CHECKED).runs, Prices(rates), 1).splitlines()[1:]
    assert [row.split()[:2] for row in rows[:3]] == [
        ["frequency_25", "3"], ["frequency_50", "3"], ["engine_lammps_frequency_50", "2"],
    ]  # fmt: skip
    assert "an estimate" not in "".join(rows)
    half = Prices({("lammps", 2): 2e6})
    assert ", an estimate\n" in plan_table(planned(**CHECKED).runs, half, 1)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            {"cross_check": {"engine": "lammps", "at": {FREQUENCY: 50}, "vibration_s": 9.0}},
            "trial.yaml: cross_check.vibration_s = 9.0 cannot be used: valid is at most 2 s, that "
            "of the last vibration.",
        ),
        (
            {"cross_check": {"engine": "lammps", "at": {FREQUENCY: 65}}},
            "trial.yaml: cross_check.at = {'vibration.0.frequency_hz': 65} cannot be used: valid "
            "is a point of the sweep, such as {'vibration.0.frequency_hz': 25}.",
        ),
        (
            {"cross_check": {"engine": "reference", "at": {FREQUENCY: 50}}},
            "trial.yaml: cross_check.engine = 'reference' cannot be used: valid is another engine "
            "than the study's own, reference, or cross_check: null.",
        ),
        (
            {"cross_check": {"engine": "lammps", "at": {FREQUENCY: 50}, "replicates": 4}},
            "trial.yaml: cross_check.replicates = 4 cannot be used: valid is at most 3, the "
            "study's own: runs are compared in pairs.",
        ),
        (
            {"cross_check": {"engine": "abacus", "at": {FREQUENCY: 50}}},
            f"trial.yaml: cross_check.engine = 'abacus' cannot be used: valid is one of {NAMED}.",
        ),
        (
            {"equivalence": {}},
            "trial.yaml: equivalence.margins = {} cannot be used: valid is at least one measure "
            "with its margin, such as solid_fraction: 0.005.",
        ),
        (
            {"equivalence": {"keys": ["engine.name"], **MARGINS}},
            "trial.yaml: equivalence.keys.0 = 'engine.name' cannot be used: valid is a swept key: "
            "vibration.0.frequency_hz.",
        ),
        (
            {"equivalence": {"keys": [FREQUENCY, FREQUENCY], **MARGINS}},
            "trial.yaml: equivalence.keys.1 = 'vibration.0.frequency_hz' cannot be used: valid is "
            "each key once.",
        ),
        (
            {"equivalence": {"margins": {"tube_fill_fraction": 0}}},
            "trial.yaml: equivalence.margins.tube_fill_fraction = 0 cannot be used: valid is a "
            "number greater than 0.",
        ),
    ],
)
def test_comparison_that_cannot_be_made_is_told(
    planned: Planned, change: dict[str, Any], sentence: str
) -> None:
    assert told(planned, **{**CHECKED, **change}) == sentence


def test_cross_check_over_a_swept_engine_is_refused(planned: Planned) -> None:
    sweep = {"keys": {"engine.name": ["lammps", "reference"]}}
    said = told(planned, **{**CHECKED, "sweep": sweep})
    assert "valid is absent where engine.name is swept" in said


def test_what_one_engine_refuses_is_told_before_anything_starts(planned: Planned) -> None:
    sweep = {"keys": {"engine.name": ["reference", "liggghts"]}}
    said = told(planned, sweep=sweep, scenario={"background_damping": {"form": "none"}})
    assert "trial.yaml: sweep.keys.engine.name = ['reference', 'liggghts'] cannot be used" in said
    assert said.endswith(", here disc, is sphere on engine liggghts.")
    said = told(planned, scenario={"engine": {"name": "liggghts"}},
                sweep={"keys": {"sand.disc_inertia": ["sphere", "disc"]}})  # fmt: skip
    assert "trial.yaml: sweep.keys.sand.disc_inertia = 'disc' cannot be used" in said


def test_own_sweep_replaces_the_comparisons_of_the_base(tmp_path: Path) -> None:
    path = tmp_path / "trial.yaml"
    path.write_text("based_on: tube_demo\nsweep: {}\nreplicates: 1\n")
    study = open_study(path).study
    assert study.cross_check is None
    assert study.equivalence.margins == {}
    path.write_text("based_on: tube_demo\n")
    assert open_study(path).study.cross_check is not None


def test_ranks_are_threads_on_the_reference_engine(planned: Planned) -> None:
    sweep = {"keys": {"engine.name": ["lammps", "reference"]}}
    plan = planned(sweep=sweep, scenario={"engine": {"ranks": 2}})
    lammps, reference = (run.run for run in plan.runs)
    assert (plan.threads(lammps), plan.ranks(lammps)) == (2, 2)
    assert (plan.threads(reference), plan.ranks(reference)) == (2, 1)


def test_deck_is_made_from_its_own_dialect_and_solver(planned: Planned) -> None:
    sweep = {"keys": {"engine.name": ["lammps", "reference"]}}
    plan = planned(sweep=sweep, scenario={"time_step": {"bed_fraction": 0}})
    lammps, reference = (
        [path.as_posix() for path in plan.kind.planning.sources(run.scenario)] for run in plan.runs
    )
    assert any(path.endswith("templates/lammps/deck.in.j2") for path in lammps)
    assert not any("/dem/" in path for path in lammps)
    assert any(path.endswith("sandmould/dem/contact_law.py") for path in reference)


@pytest.mark.parametrize(
    ("objective", "valid"),
    [
        ({"target": 1.2}, "above 0 and at most 1"),
        (
            {"target": 0.5, "better": "neither"},
            "absent, or null over an inherited one, where objective.better is neither",
        ),
        ({"measure": "solid_fraction", "target": "full"}, "a value of solid_fraction"),
    ],
)
def test_a_target_that_nothing_can_reach_is_one_sentence(
    objective: dict[str, Any], valid: str, planned: Planned
) -> None:
    with pytest.raises(BadInputError) as caught:
        planned(objective=objective)
    (problem,) = caught.value.problems
    assert (problem.key, problem.value) == ("objective.target", objective["target"])
    assert problem.valid.startswith(valid)


@pytest.mark.parametrize(
    ("beside", "key", "valid"),
    [
        ([{"measure": "tube_fill_fraction"}], "measure", "each measure once"),
        ([{"measure": "solid_fraction", "better": "neither"}], "better", "larger or smaller"),
        ([{"measure": "solid_fraction", "target": 1.2}], "target", "above 0 and at most 1"),
        ([{"measure": "solid_fractoin"}], "measure", "nearest"),
    ],
)
def test_what_is_asked_besides_is_checked_as_the_first(
    planned: Planned, beside: list[dict[str, Any]], key: str, valid: str
) -> None:
    said = told(planned, objective={"beside": beside}, scenario={"engine": {"name": "reference"}})
    assert f"objective.beside.0.{key}" in said
    assert valid in said


def test_a_measure_named_alone_is_refused_with_what_to_write(planned: Planned) -> None:
    said = told(planned, objective={"beside": ["solid_fraction"]})
    assert "objective.beside.0 = 'solid_fraction'" in said
    assert said.endswith("such as {measure: solid_fraction}.")


@pytest.mark.parametrize(
    ("objective", "goal"),
    [
        ({}, Goal("tube_fill_of_bed_fraction", 0.95)),
        ({"target": 0.6}, Goal("tube_fill_fraction", 0.6)),
        ({"better": "smaller"}, None),
        ({"measure": "solid_fraction"}, None),
    ],
)
def test_the_fill_of_a_tube_has_a_target(objective: dict[str, Any], goal: Goal | None) -> None:
    assert Objective(**objective).goal == goal
