"""Runs of a shipped study that are committed as packs: the next start takes them up."""

from __future__ import annotations

from pathlib import Path

from sandmould import ROOT, SHIPPED
from sandmould.execution.packs.index import PackedRun
from sandmould.execution.packs.pack import SUFFIX, Packed, pack
from sandmould.execution.packs.unpack import (
    Unpacked,
    open_pack,
    place_runs,
    take_rounds,
    wants_fill,
)
from sandmould.execution.process import is_locked
from sandmould.runs.hashing import scenario_hash
from sandmould.study.plan.build_plan import Plan, open_plan
from sandmould.study.plan.lacking import Need, template_hashes

RECORDS = ROOT / "docs" / "results"


def record_part(plan: Plan, results: Path) -> Packed:
    """Add a pack of the runs at their end to the record of a study.

    Raises
    ------
    BadInputError
        Where no run is at its end that is not in the record yet.
    """
    folder = RECORDS / plan.study.name
    folder.mkdir(parents=True, exist_ok=True)
    return pack(plan, results, folder, last_state=True)


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
    taken = 0
    folder = results / plan.study.name
    for path in packs:
        with open_pack(path) as archive:
            if take_rounds(archive, folder):
                plan = open_plan(plan.study.path, results)
        with open_pack(path) as archive:
            unpacked = Unpacked(plan.study.name)
            place_runs(archive, folder, _Wanted(plan, results), unpacked)
            taken += len(unpacked.taken)
    return plan, f"{taken} runs taken from the record of {plan.study.name}" if taken else ""


class _Wanted:
    """Asks whether a run of a pack is one that its study lacks."""

    def __init__(self, plan: Plan, results: Path) -> None:
        self._runs = {run.run: run for run in (*plan.runs, *plan.fills)}
        self._lacks = plan.lacks(results)
        self._folder = results / plan.study.name
        self._template_hash = template_hashes()

    def __call__(self, name: str, packed: PackedRun) -> bool:
        run, lack = self._runs.get(name), self._lacks.get(name)
        if run is None or not packed.at_end:
            return False
        place = self._folder / packed.place(name)
        if packed.is_fill:
            is_missing = wants_fill(place)
        else:
            is_missing = lack is not None and lack.need is Need.COMPUTE and not is_locked(place)
        return (
            is_missing
            and packed.scenario_sha256 == scenario_hash(run.scenario)
            and packed.template_sha256 == self._template_hash(run)
        )
