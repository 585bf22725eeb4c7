"""A plan goes from the command that made it to the Snakemake that is forked from it."""

from __future__ import annotations

from pathlib import Path

from sandmould.study.plan.build_plan import Plan, open_plan
from sandmould.study.plan.trust import check_letters, check_places, check_trust

_PLANS: dict[Path, Plan] = {}
"""Of the next process that is forked, by the study's file."""


def checked_plan(path: Path, text: str | None = None) -> Plan:
    """Open, validate and expand a study whose runs are to start.

    Parameters
    ----------
    path : Path
    text : str, optional
        What its file will hold, where it is not written yet.

    Raises
    ------
    BadInputError
        With one sentence a problem; a place or a program that is not to be trusted is one.
    """
    plan = open_plan(path, text=text)
    check_places(plan.study)
    check_letters(plan.runs)
    check_trust(plan.study, plan.runs)
    return plan


def hand_over(plan: Plan) -> None:
    """Let processes that are forked from this one have a plan."""
    _PLANS[plan.study.path.resolve()] = plan


def plan_of(path: Path) -> Plan:
    """The plan that was handed over, or a new one; errors as of ``checked_plan``."""
    return _PLANS.get(path.resolve()) or checked_plan(path)
