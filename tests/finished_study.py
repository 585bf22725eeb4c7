"""Studies whose runs are computed in this process, in seconds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sandmould.execution.simulate import measure_run, render_run, simulate, write_crash
from sandmould.study.collect import collect
from sandmould.study.plan.build_plan import RESULTS, Plan, open_plan
from tests.planned import announce

ELEMENTS_M = (0.01, 0.02)
EXCHANGES = ("corrected", "faces", "difference")
FLOW = """\
based_on: tank
scenario:
  case: {particle_m: 0.004, width_m: 0.016, depth_m: 0.032}
  duration_s: 0.01
  record_s: 0.005
  dt_max_s: 0.002
objective: {measure: h20_sd_pa}
sweep: {keys: {relaxations: [1]}}
"""
"""A study's file: a small tank of metal, one run."""


def study_text(
    elements_m: Sequence[float] = ELEMENTS_M, exchanges: Sequence[str] = EXCHANGES
) -> str:
    """A study's file: coarse plates that cool for seconds."""
    points = "".join(
        f"    - {{exchange: {exchange}, element_m: {element_m:g}, layers: []}}\n"
        for element_m in elements_m
        for exchange in exchanges
    )
    return (
        "based_on: plates\nscenario: {until_s: 100, heat_transfer_w_m2_k: null}\n"
        f"sweep:\n  design: list\n  points:\n{points}"
        f"reference: {{exchange: {exchanges[0]}, element_m: {elements_m[0]:g}}}\n"
    )


def finished_study(path: Path, failed: int = 0) -> Plan:
    """Compute, measure and collect a study with results below the working folder.

    Parameters
    ----------
    path : Path
        The study's file, which is written unless it is there.
    failed : int
        So many of its runs, the last ones, fail instead.
    """
    if not path.exists():
        path.write_text(study_text(), encoding="utf-8")
    plan = open_plan(path)
    announce(plan, RESULTS, 1)
    folder = RESULTS / plan.study.name
    for place, run in enumerate(plan.runs):
        where = folder / "runs" / run.run
        render_run(where, run)
        if place < len(plan.runs) - failed:
            assert simulate(where) == 0
        else:
            (where / "work").mkdir()
            write_crash(where, "as this test wants it")
        measure_run(where, run)
    collect(folder)
    batches = folder / "batches"
    batches.mkdir(exist_ok=True)
    for batch in plan.batches(10.0, 2):
        (batches / f"{batch.name}.done").touch()
    return plan
