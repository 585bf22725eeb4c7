"""The end of one computation as the beginning of others: tables and checkpoint of a fill."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from sandmould.runs import checkpoint_folders as checkpoints
from sandmould.runs.products import Cost


def has_begun(work: Path) -> bool:
    """Whether a run has a checkpoint of its own, or one that was laid there."""
    return any(work.glob("checkpoint_[ab]"))


def lay_tables(source: Path, work: Path, names: Iterable[str]) -> None:
    """Give a run the tables that another one left, in place of its own: it writes on in them."""
    work.mkdir(parents=True, exist_ok=True)
    for name in names:
        if (source / name).exists():
            shutil.copyfile(source / name, work / name)


def lay_checkpoint(
    source: Path, work: Path, owner_hash: str, run_hash: str, cost: Cost, stages: int, fill: str
) -> None:
    """Give a run the checkpoint that another one left, as its newest.

    Parameters
    ----------
    source : Path
        Checkpoint folder.
    owner_hash : str
        Hash of the scenario that the checkpoint must be of.
    run_hash : str
        Hash of the scenario that goes on from it.
    cost : Cost
        Of the run before it has begun: it pays for what it computes itself, and has the steps,
        the grains and the largest overlap of the whole.
    stages : int
        That the other one has computed.

    Raises
    ------
    ValueError
        When the checkpoint is missing, damaged, or of another scenario.
    """
    mark = checkpoints.read_mark(source)
    if mark.scenario_hash != owner_hash:
        raise ValueError("it is of another scenario")
    taken = Cost(**mark.cost)
    cost = replace(
        cost,
        steps=taken.steps,
        grains=taken.grains,
        largest_overlap_fraction=taken.largest_overlap_fraction,
        fill=fill,
    )
    mark = replace(mark, scenario_hash=run_hash, cost=cost.row(), shared_stages=stages)
    checkpoints.lay(source, work / "checkpoint_a", mark)
