"""Plans with the files that the jobs of all runs write first."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sandmould.definition.run import Run
from sandmould.study.plan import announcement, plan_files
from sandmould.study.plan.build_plan import Plan


def write_plan(runs: Sequence[Run], folder: Path) -> None:
    """Write the plan of a study, and of each run what its job writes first."""
    for run in runs:
        plan_files.write_run(run, folder)
    plan_files.write_plan(runs, folder)


def announce(plan: Plan, results: Path, cores: int) -> str:
    """Announce a plan with the folders of all runs."""
    write_plan([*plan.fills, *plan.runs], results / plan.study.name)
    return announcement.announce(plan, results, cores)
