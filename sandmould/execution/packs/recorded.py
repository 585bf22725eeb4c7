"""Runs of a shipped study that are committed as packs: the next start takes them up."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from sandmould import ROOT, SHIPPED
from sandmould.definition.run import Run
from sandmould.execution.packs.archive import SUFFIX, open_pack
from sandmould.execution.packs.pack import Packed
from sandmould.execution.packs.pack import pack as pack_study
from sandmould.execution.packs.unpack import Unpacked, take, unusable, wants_fill
from sandmould.runs.hashing import scenario_hash
from sandmould.study.plan.build_plan import Plan, open_plan
from sandmould.study.plan.lacking import WHOLE, Need, template_hashes
from sandmould.study.rounds.round_log import ROUNDS_FILE

RECORDS = ROOT / "docs" / "results"


def record_part(plan: Plan, results: Path) -> Packed:
    """Add a pack of the runs at their end that it lacks to the record of a study."""
    folder = RECORDS / plan.study.name
    folder.mkdir(parents=True, exist_ok=True)
    return pack_study(plan, results, folder, last_state=True)


def take_up(plan: Plan, results: Path) -> tuple[Plan, str]:
    """Take the runs of a study's record that it lacks and that fit it as it is now.

    Call it while no other start computes the study.

    Parameters
    ----------
    plan : Plan
        Of a study of any place: those of users have no record.
    results : Path

    Returns
    -------
    plan : Plan
        The same with the rounds of the record.
    said : str
        What was taken; empty where nothing was.

    Raises
    ------
    BadInputError
        Where a pack cannot be read.
    """
    shipped = plan.study.path.resolve().parent == (SHIPPED / "config" / "studies").resolve()
    packs = sorted((RECORDS / plan.study.name).glob(f"*{SUFFIX}")) if shipped else []
    folder, unpacked = results / plan.study.name, Unpacked(plan.study.name)
    template_hash = template_hashes()
    for path in packs:
        with open_pack(path) as pack:
            if ROUNDS_FILE in pack.listed.files:
                take(pack, folder, (), lambda place, part: "", unpacked)
                plan = open_plan(plan.study.path, results)
            missing = {
                run.place: run
                for run in _missing(plan, results)
                if pack.listed.identities.get(run.place)
                == f"{scenario_hash(run.scenario)} {template_hash(run)}"
            }

            def judge(place: str, part: Path, runs: dict[str, Run] = missing) -> str:
                return unusable(runs[place], part, template_hash)

            take(pack, folder, missing, judge, unpacked)
    taken = len(unpacked.taken)
    return plan, f"{taken} runs taken from the record of {plan.study.name}" if taken else ""


def _missing(plan: Plan, results: Path) -> Iterator[Run]:
    """Runs that a start would compute, and fills that are not here."""
    lacks = plan.lacks(results)
    yield from (run for run in plan.runs if lacks.get(run.run, WHOLE).need is Need.COMPUTE)
    folder = results / plan.study.name
    yield from (fill for fill in plan.fills if wants_fill(folder / fill.place))
