"""Runs of a shipped study that are committed as a pack: the next start takes them up."""

from __future__ import annotations

from pathlib import Path

from sandmould import ROOT, SHIPPED
from sandmould.execution.packs.archive import SUFFIX, open_pack
from sandmould.execution.packs.pack import pack as pack_study
from sandmould.execution.packs.unpack import take
from sandmould.study.plan.build_plan import Plan, open_plan

RECORDS = ROOT / "docs" / "results"


def record_part(plan: Plan, results: Path) -> str:
    """Pack the runs of a study at their end into its record, with those of it that still fit."""
    plan, _ = take_up(plan, results)
    path = record_of(plan)
    path.parent.mkdir(parents=True, exist_ok=True)
    return pack_study(plan, results, path, last_state=True)


def take_up(plan: Plan, results: Path) -> tuple[Plan, str]:
    """Take the runs of a study's record that it lacks and that fit it as it is now.

    Call it while no other start computes the study. Studies of users have no record.

    Returns
    -------
    plan : Plan
        The same with the rounds of the record.
    said : str
        What was taken; empty where nothing was.

    Raises
    ------
    BadInputError
        Where the pack cannot be read.
    """
    path, folder = record_of(plan), results / plan.study.name
    shipped = plan.study.path.resolve().parent == (SHIPPED / "config" / "studies").resolve()
    if not (shipped and path.is_file()):
        return plan, ""
    with open_pack(path) as pack:
        take(pack, folder, ())  # its rounds, which add runs to the plan
        plan = open_plan(plan.study.path, results)
        planned = {run.place for run in (*plan.runs, *plan.fills)}
        left = take(pack, folder, planned & pack.runs.keys())
    taken = list(left.values()).count("")
    return plan, f"{taken} runs taken from the record of {plan.study.name}" if taken else ""


def record_of(plan: Plan) -> Path:
    """The pack that a shipped study's runs may lie in."""
    return RECORDS / plan.study.name / f"{plan.study.name}_runs{SUFFIX}"
