"""A run that goes on from the end of a fill: one that it shares with others, or its own."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from pathlib import Path

from sandmould.definition.run import FILLS, Run
from sandmould.engines import registry
from sandmould.engines.driver import Driver, Opening
from sandmould.engines.durations import cost_before, run_s
from sandmould.engines.program import Program, build_program
from sandmould.runs import checkpoint_folders as checkpoints
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import SAND_TABLES, Computed, Cost


def lay_fill(run: Run, folder: Path, program: Program) -> Computed | None:
    """Lay the end of its fill into the folder of a run that has not begun.

    A fill that cannot be used is told on standard error, and the run fills by itself.

    ``folder``: ``results/<study>/runs/<run>``; the fills of the study lie beside the runs.

    Gives how the run ends where the fill failed: as that did.
    """
    if not run.fill:
        return None
    world = registry.communicator_of(run.scenario)
    if world is None:
        is_root, failed = True, _lay(run, folder, program)
    else:  # one process lays the files for all
        is_root = world.rank == 0
        failed = world.bcast(_lay(run, folder, program) if is_root else None, root=0)
    if failed is None:
        return None
    cost = replace(cost_before(run.scenario), fill=run.fill)
    return Computed(failed, cost, is_root)


def _lay(run: Run, folder: Path, program: Program) -> RunOutcome | None:
    work, fill = folder / "work", folder.parent.parent / FILLS / run.fill
    if any(work.glob("checkpoint_[ab]")):
        return None
    try:
        ended = RunOutcome.read(fill / "outcome.json")
        work.mkdir(parents=True, exist_ok=True)
        for name in SAND_TABLES:  # in place of its own: it writes on in them
            if (fill / name).exists():
                shutil.copyfile(fill / name, work / name)
        if ended.outcome is not Outcome.FINISHED:
            detail = f"in the fill {run.fill}, which it shares: {ended.detail}"
            return replace(ended, detail=detail, planned_s=run_s(program))
        _lay_checkpoint(run, fill / checkpoints.END_CHECKPOINT, work, program.fill_stages)
    except (OSError, ValueError, KeyError, TypeError) as error:
        why = f"the fill {run.fill} cannot be used ({error}), and the run fills by itself"
        print(f"{run.run}: {why}", file=sys.stderr)
    return None


def _lay_checkpoint(run: Run, source: Path, work: Path, stages: int) -> None:
    """Give a run the checkpoint of its fill as its newest; ``ValueError`` where that is no good.

    It pays for what it computes itself, and has the steps, the grains and the largest overlap of
    the whole.
    """
    mark = checkpoints.read_mark(source, scenario_hash(run.scenario.before_vibration))
    taken = Cost(**mark.cost)
    cost = replace(
        cost_before(run.scenario),
        steps=taken.steps,
        grains=taken.grains,
        largest_overlap_fraction=taken.largest_overlap_fraction,
        fill=run.fill,
    )
    own_hash = scenario_hash(run.scenario)
    mark = replace(mark, scenario_hash=own_hash, cost=cost.row(), shared_stages=stages)
    checkpoints.lay(source, work / "checkpoint_a", mark)


def fill_apart(run: Run, folder: Path, program: Program, opening: Opening) -> Computed | None:
    """Compute the fill of a run as a shared fill is computed, and lay its end as a checkpoint.

    So a run whose scenario has ``rest.shaken_check_every_s`` ends alike whether it shares its fill
    or not.

    Gives how the run ends where its fill did not finish; None once it may vibrate.
    """
    work, run_hash = folder / "work", scenario_hash(run.scenario)
    newest, _ = checkpoints.newest_checkpoint(work)
    if newest is not None and newest[1].scenario_hash == run_hash:
        return None
    fill = run.scenario.before_vibration
    driver = Driver(build_program(fill), folder, run.run, scenario_hash(fill), opening, True)
    ended = driver.run()
    if ended.outcome is not Outcome.FINISHED:
        return Computed(replace(ended, planned_s=run_s(program)), driver.cost, driver.is_root)
    end = work / checkpoints.END_CHECKPOINT
    checkpoints.seal(end, replace(checkpoints.read_mark(end), scenario_hash=run_hash))
    for name in ("checkpoint_a", "checkpoint_b"):
        shutil.rmtree(work / name, ignore_errors=True)
    end.rename(work / "checkpoint_a")
    return None
