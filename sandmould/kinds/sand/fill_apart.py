"""A run that fills by itself and goes on with other checks once it vibrates."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from sandmould.definition.run import Run
from sandmould.engines.driver import Driver, Opening
from sandmould.engines.durations import run_s
from sandmould.engines.program import Program, build_program
from sandmould.runs import checkpoint_folders as checkpoints
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.outcome import Outcome
from sandmould.runs.products import Computed


def fill_apart(run: Run, folder: Path, program: Program, opening: Opening) -> Computed | None:
    """Compute the fill of a run as a shared fill is computed, and lay its end as a checkpoint.

    So a run ends alike whether it shares its fill or not.

    Parameters
    ----------
    run : Run
        Whose scenario has ``rest.shaken_check_every_s``.
    folder : Path
        Of the run.
    program : Program
        Of the run's scenario.
    opening : callable
        Opens a session.

    Returns
    -------
    Computed or None
        How the run ends where its fill did not finish; None once it may vibrate.
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
