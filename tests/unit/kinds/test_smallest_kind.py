"""A new kind of study states what it needs and nothing more."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import pandas as pd
import pytest
from pydantic import Field

from sandmould.definition.run import LAST_MEASURED, Run
from sandmould.definition.study import Study, kind_key
from sandmould.execution.simulate import measure_run, render_run, simulate
from sandmould.kinds import registry
from sandmould.kinds.kind import Execution, Kind, Planning
from sandmould.report.kinds.kind import KindReport
from sandmould.report.kinds.registry import REPORTS
from sandmould.report.page import write_report
from sandmould.runs.measures import Measure, MeasureGroup, once
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import Computed, Cost
from sandmould.scenario.quantity import Section, quantity
from sandmould.study.collect import collect
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.lacking import Need
from sandmould.study.plan.plan_files import VERDICT_FILE
from tests.planned import announce

REPORT = KindReport()


class Fall(Section):
    """A stone that falls."""

    height_m: float = quantity(1.0, "Height.", unit="m", source="user", gt=0)
    seed: int = quantity(1, "Seed.", source="user")


class FallStudy(Study):
    """A study of stones that fall."""

    kind: Literal["fall"] = kind_key("fall")
    scenario: Fall = Field(Fall(), description="The stone.")


class FallPlanning(Planning[Fall]):
    measures = (
        MeasureGroup("every fall", lambda _: once(), (Measure("fall_s", "Duration of the fall."),)),
    )

    def sources(self, scenario: Fall) -> list[Path]:
        return [Path(__file__)]

    def predicted_s(self, scenario: Fall) -> float:
        return 0.5


class FallExecution(Execution[Fall]):
    products = ("series.tsv",)

    def no_cost(self, scenario: Fall) -> Cost:
        return Cost("fall", 1, math.nan, math.nan, version="1")

    def compute(self, run: Run, folder: Path) -> Computed:
        (folder / "work").mkdir()
        fall_s = math.sqrt(2.0 * run.scenario.height_m / 9.81)
        (folder / "work" / "series.tsv").write_text(f"time_s\n{fall_s}\n")
        outcome = RunOutcome(Outcome.FINISHED, "", fall_s, fall_s)
        return Computed(outcome, self.no_cost(run.scenario), is_root=True)

    def measure(self, run: Run, folder: Path) -> None:
        table = pd.read_csv(folder / "series.tsv", sep="\t")
        table = table.assign(vibration_time_s=math.nan, stage="falling", fall_s=table["time_s"])
        table.to_csv(folder / LAST_MEASURED, sep="\t", index=False)


def test_the_smallest_kind_is_planned_computed_and_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind = Kind("fall", Fall, FallStudy, FallPlanning, FallExecution)
    monkeypatch.setitem(registry.KINDS, "fall", kind)
    monkeypatch.setitem(registry._OF_SCENARIO, Fall, kind)
    monkeypatch.setitem(REPORTS, "fall", __name__)
    file = tmp_path / "stones.yaml"
    file.write_text(
        "kind: fall\nobjective: {measure: fall_s, better: smaller}\n"
        "sweep: {keys: {height_m: [1.0, 4.0]}}\n"
    )
    plan, folder = open_plan(file, tmp_path), tmp_path / "stones"
    assert "1 core-second" in announce(plan, tmp_path, 1)
    for run in plan.runs:
        of_run = folder / run.place
        render_run(of_run)
        assert "what the solver 1 is given\nheight_m = " in (of_run / "deck.in").read_text()
        assert simulate(of_run) == 0
        measure_run(of_run)
        known = announce(plan, tmp_path, 1)
        last = run is plan.runs[-1]
        assert ("All runs have ended here: 2." if last else "1 of 2 runs have ended here;") in known
    assert all(lack.need is Need.NOTHING for lack in plan.lacks(tmp_path).values())
    collect(folder)
    summary = pd.read_csv(folder / "summary.tsv", sep="\t")
    assert summary["fall_s"].tolist() == pytest.approx([0.4515, 0.9030], abs=1e-4)
    write_report(folder, folder / "report.html")
    assert "1 m" in (folder / VERDICT_FILE).read_text()
