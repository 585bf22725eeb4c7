"""The scaling benchmark: its stand-in, its page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.scaling.chart import draw
from benchmarks.scaling.measure import executed, files
from benchmarks.scaling.page import page
from benchmarks.scaling.peers import HERE, Tool, written_lines
from benchmarks.scaling.study import REPLICATES, Place
from sandmould.study.plan.build_plan import open_plan


def row(runs: int, is_executed: bool) -> dict[str, Any]:
    """Numbers as the benchmark finds them, in proportion to the runs."""

    def cost(fixed: float, each: float) -> dict[str, float]:
        seconds = fixed + each * runs
        return {"wall_s": seconds, "cpu_s": seconds, "peak_memory_bytes": 2e8 + 1e5 * runs}

    found: dict[str, Any] = {
        "validate_s": 0.01 + 5e-4 * runs, "batches_s": 1e-4 * runs, "batches": runs // 5,
        "write_s": 1e-3 * runs, "write_again_s": 1e-3 * runs, "job_start": 1.5 + 5e-4 * runs,
        "graph_shared": cost(2, 0.002), "graph_alone": cost(2, 0.0165),
        "nothing_to_do": cost(2, 0.001), "status": cost(1, 1e-3), "collect": cost(1, 0.004),
        "report": cost(2, 0.004), "report_bytes": 1_500_000,
    }  # fmt: skip
    if not is_executed:
        found["linked_files"] = 24 * runs
    else:
        found["append"] = cost(9, 0.01) | {"runs": 5}
        found["run_alone"] = cost(4, 4.1)
        found["run_shared"] = cost(4, 1.9)
        found["files"] = {
            "files": 25.0, "of_snapshots": 10.0, "bytes": 90e3, "bytes_of_snapshots": 30e3,
            "logs": 2.0, "of_snakemake": 2.5,
        }  # fmt: skip
    return found


@pytest.fixture
def found() -> dict[str, Any]:
    tool = {
        "lines": 10,
        "commands_after_kill": 1,
        "whole": {"cpu_s": 2.0, "wall_s": 1.0},
        "failing": {"others_done": 95, "status": 1, "then_done": 100, "then_status": 0,
                    "redone": 0},
        "killed": {"done_at_kill": 40, "status": 0, "then_done": 100, "redone": 0},
    }  # fmt: skip
    graph = {"cpu_s": 300.0, "peak_memory_bytes": 1.5e9}
    names = "start of Python", "preamble of a script", "imports of a run", "imports of measuring"
    more = "imports of a shared job", "process of a run", "rendering", "measuring"
    return {
        "rows": {"10": row(10, True), "100": row(100, True), "10000": row(10_000, False)},
        "parts": dict.fromkeys((*names, *more), 0.5) | {"process of a run": 1.3},
        "turns": {"before": "abc", "command": "turns", "machine": "a core", "remark": "As it was.",
                  "rows": [{"what": "files of a run", "before": "25", "now": "12"}]},
        "before": {"commit": "abc", "processor": "a core", "graph": graph,
                   "graph_pattern_s": 200.0, "report": graph, "report_bytes": 31e6,
                   "run_cpu_s": 4.1},
        "peers": {"runs": 100, "cores": 2, "tools": {"sandmould": tool, "yade-batch": tool},
                  "job_cpu_s": {"plain": 0.02, "yade": 1.3}, "versions": {"Yade": "1"}},
        "took_s": 3600, "load_before": 0.1, "load_after": 2.0,
        "provenance": {"commit": "abc", "versions": {"numpy": "2"},
                       "machine": {"processor": "p", "cores": 2, "system": "s"}},
    }  # fmt: skip


def test_page_and_picture_are_made_from_numbers(found: dict[str, Any], tmp_path: Path) -> None:
    text = page(found)
    assert "$" not in text
    assert " nan" not in text
    assert "| whole study, three jobs a run | 45.0 (4.50 a run) | 414 (4.14 a run) | – |" in text
    assert "| one more point, to its report | 9.1 (5 runs) | 10.0 (5 runs) | – |" in text
    assert "| graph, collection and report, a run | 0.510 | 0.060 | 0.011 |" in text
    assert "33 kB and 5.5 ms of a core for each job" in text  # of three a run
    # Without the start of Snakemake.
    assert "one in shared jobs 1.92 s" in text
    assert "0 of 40 finished runs redone" in text
    draw(found, tmp_path / "scaling.png")
    assert (tmp_path / "scaling.png").stat().st_size > 1e4


def test_lines_are_those_that_a_user_writes() -> None:
    for name in ("paramspace", "signac", "yade", "sandmould"):
        tool = Tool(name, name, (), (), (), "")
        assert 5 < written_lines(tool) < 60
    assert (HERE / "one_run.py").exists()


def test_the_stand_in_is_planned_in_any_number(tmp_path: Path) -> None:
    place = Place(tmp_path / "place")
    for runs in (3, 10, 200):
        plan = open_plan(place.study(runs))
        assert len(plan.runs) == runs
    assert len(open_plan(place.study(200, more_points=1)).runs) == 200 + REPLICATES


@pytest.mark.slow
def test_three_runs_of_the_stand_in_are_whole(tmp_path: Path) -> None:
    place = Place(tmp_path / "place")
    study = place.study(3)
    cost = executed(place, 3, study, True, 2)
    assert cost["cpu_s"] > 0
    assert (place.results(3) / "report.html").exists()
    assert len(list(place.results(3).glob("batches/*.done"))) == 1
    assert files(place, 3)["files"] == 10
