"""Which runs share a fill, and what a plan says of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from sandmould.definition.run import FILL
from sandmould.execution.status import status_text
from sandmould.execution.tidy import orphans
from sandmould.kinds.sand.kind import SAND
from sandmould.report.tables import key_numbers
from sandmould.runs.columns import CPU_S, FILL_CPU_S, FILL_WALL_S, total_s
from sandmould.runs.formatting import size_text
from sandmould.runs.manifest import save_manifest
from sandmould.study.collect import shares_of_fills
from sandmould.study.plan.announcement import announce, prepare
from sandmould.study.plan.build_plan import Plan, open_plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.fills import own_work, predicted_s, share_fills
from sandmould.study.plan.lacking import Need
from sandmould.study.plan.load_study import STUDIES, open_study
from sandmould.study.plan.plan_files import plan_table, read_run, write_run
from sandmould.study.plan.price import Prices
from tests.planned import write_plan

FREQUENCY = "vibration.0.frequency_hz"


def planned(folder: Path, keys: dict[str, Any], **top: Any) -> Plan:
    tree = {
        "based_on": "tube", "scenario": {"engine": {"name": "reference"}},
        "sweep": {"keys": keys}, "replicates": 2, **top,
    }  # fmt: skip
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return open_plan(path, folder / "results")


def names(plan: Plan) -> list[str]:
    return [run.fill.rsplit("_", 1)[0] for run in plan.runs]


@pytest.mark.parametrize(
    ("key", "values"),
    [
        (FREQUENCY, [25, 50]),
        ("vibration.0.duration_s", [0.5, 1.0]),
        ("measure_at_rest", [True, False]),
    ],
)
def test_runs_that_differ_in_their_vibration_alone_share_a_fill_a_replicate(
    key: str, values: list[Any], tmp_path: Path
) -> None:
    plan = planned(tmp_path, {key: values})
    assert names(plan) == ["fill_r1", "fill_r2"] * 2
    assert {run.fill for run in plan.runs} == {fill.run for fill in plan.fills}
    assert [fill.seed for fill in plan.fills] == [run.seed for run in plan.runs[:2]]


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("contact.grain_grain.friction", [0.5, 0.8]),
        ("time_step.fraction", [0.4, 0.5]),
        ("sand.size_scale", [6, 8]),
        ("record.series_every_s", [0.02, 0.04]),
    ],
)
def test_runs_that_differ_before_share_none(key: str, values: list[Any], tmp_path: Path) -> None:
    plan = planned(tmp_path, {key: values})
    assert not plan.fills
    assert not any(run.fill for run in plan.runs)


def test_scenes_without_vibration_share_none(tmp_path: Path) -> None:
    plan = planned(tmp_path, {FREQUENCY: [25, 50]})
    still = [
        replace(run, scenario=run.scenario.model_copy(update={"vibration": ()}))
        for run in plan.runs
    ]
    assert share_fills(still, SAND.planning) == (still, [])


def test_the_cross_check_on_another_engine_fills_by_itself(tmp_path: Path) -> None:
    check = {"engine": "lammps", "at": {FREQUENCY: 50}}
    margins = {"margins": {"solid_fraction": 0.01}}
    plan = planned(tmp_path, {FREQUENCY: [25, 50]}, cross_check=check, equivalence=margins)
    checks = [run for run in plan.runs if run.part == "cross_check"]
    assert len(checks) == 2
    assert not any(run.fill for run in checks)


def test_a_fill_is_the_scene_up_to_the_first_vibration(tmp_path: Path) -> None:
    rest = {"kind": "rest", "longest_s": 3.0}
    shake = {"frequency_hz": 50, "acceleration_g": 1.5, "duration_s": 0.2}
    scenario = {"engine": {"name": "reference"}, "vibration": [rest, shake]}
    plan = planned(tmp_path, {"vibration.1.frequency_hz": [25, 50]}, scenario=scenario)
    (fill, _) = plan.fills
    assert [stage.kind for stage in fill.scenario.vibration] == ["rest"]
    assert fill.place == f"fills/{fill.run}"
    assert fill.scenario.model_copy(update={"vibration": ()}) == plan.runs[0].scenario.model_copy(
        update={"vibration": ()}
    )


def test_work_of_a_fill_is_counted_once(tmp_path: Path) -> None:
    plan = planned(tmp_path, {FREQUENCY: [25, 50]})
    for run, fill in zip(plan.runs[:2], plan.fills, strict=True):
        alone = replace(run, fill="")
        assert own_work(run) + own_work(fill) == pytest.approx(own_work(alone))
        assert predicted_s(run) + predicted_s(fill) == pytest.approx(predicted_s(alone))
    text = plan_table([*plan.fills, *plan.runs], Prices(), 1)
    assert text.splitlines()[1].startswith("fill ")
    assert "4 runs, " in text
    assert "The 4 runs start from 2 fills of the box, each computed once." in text
    room = size_text(sum(SAND.planning.state_bytes(fill.scenario) for fill in plan.fills))
    assert f"Together the fills take about {room} of the disk." in text


def test_a_plan_writes_fills_beside_the_runs(tmp_path: Path) -> None:
    plan, results = planned(tmp_path, {FREQUENCY: [25, 50]}), tmp_path / "results"
    announce(plan, results, 1)
    folder = results / "trial"
    assert len((folder / "runs.tsv").read_text().splitlines()) == 5
    fill = read_run(write_run(plan.fills[0], folder) / "scenario.yaml")
    assert (fill.part, fill.scenario) == (FILL, plan.fills[0].scenario)
    assert read_run(write_run(plan.runs[0], folder) / "scenario.yaml").fill == fill.run
    assert {run: lack.need for run, lack in plan.lacks(results).items()} == {
        run.run: Need.COMPUTE for run in (*plan.runs, *plan.fills)
    }
    assert prepare(plan, results) == ""
    status = status_text(plan, results, 1)
    assert "4 waiting of 4 runs" in status
    assert "2 waiting of 2 fills that runs share" in status


def test_fills_of_an_edited_study_can_go(tmp_path: Path) -> None:
    results = tmp_path / "results"
    earlier = planned(tmp_path, {FREQUENCY: [25, 50]})
    write_plan([*earlier.runs, *earlier.fills], results / "trial")
    plan = planned(tmp_path, {FREQUENCY: [25, 50]}, replicates=1)
    gone = {folder.name.rsplit("_", 1)[0] for folder in orphans(plan, results)}
    assert gone == {"fill_r2", "frequency_25_r2", "frequency_50_r2"}


def test_each_run_bears_its_part_of_a_fill(tmp_path: Path) -> None:
    for fill, cost in {"fill_a": 8.0, "fill_b": 3.0}.items():
        folder = tmp_path / "fills" / fill
        folder.mkdir(parents=True)
        save_manifest(folder, {"cost": {"wall_s": 2 * cost, "cpu_s": cost}})
    fills = pd.Series(["fill_a", "fill_a", "fill_b", "fill_lost", None])
    table = pd.DataFrame({CPU_S: [1.0] * 5}).assign(**shares_of_fills(fills, tmp_path))
    assert table[FILL_CPU_S].fillna(-1).tolist() == [4.0, 4.0, 3.0, -1.0, -1.0]
    assert table[FILL_WALL_S].fillna(-1).tolist() == [8.0, 8.0, 6.0, -1.0, -1.0]
    assert total_s(table, CPU_S) == 5.0 + 8.0 + 3.0
    # The report tells it.
    whole = table.assign(outcome_code=0, fill=fills, wall_s=2.0).drop(index=3)
    (cost,) = (each for each in key_numbers(whole) if each.label.startswith("computing"))
    assert (cost.value, cost.label) == ("30 s", "computing, all runs and 2 shared fills added up")
    assert cost.note == "15 s of processor time"


def test_rounds_and_controls_of_the_vibration_go_on_from_the_fills_of_the_sweep() -> None:
    study = open_study(STUDIES[0] / "tube_certified.yaml")
    swept = expand(study)
    point = {FREQUENCY: 77.0}
    runs, fills = share_fills(expand(study, [(point, 1)], (40.0, 80.0, 160.0)), SAND.planning)
    of_sweep = {run.seed: run.fill for run in runs if run.part == "sweep"}
    assert len(of_sweep) == len({run.seed for run in swept})
    (added,) = (run for run in runs if run.parameters == point)
    assert added.fill == of_sweep[added.seed]
    controls = {run.part.split()[1] for run in runs if run.part.startswith("control")}
    sharing = {
        run.part.split()[1]
        for run in runs
        if run.part.startswith("control") and run.fill == of_sweep.get(run.seed)
    }
    # The weak shake is checked more often, but from its first vibration on alone.
    assert sharing == {"hold", "spectrum"}
    assert {"hold", "spectrum", "springs"} <= controls
    assert len({fill.run for fill in fills}) == len(fills)
