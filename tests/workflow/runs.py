"""Runs as the workflow makes them: planned in a folder, computed, and killed at a checkpoint."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from sandmould.definition.run import Run
from sandmould.engines.driver import Driver
from sandmould.engines.program import Program, build_program
from sandmould.engines.registry import engine_of
from sandmould.engines.snapshot import Snapshot, stored_snapshots
from sandmould.execution.jobs import compute_batch
from sandmould.execution.pool import do, start_server
from sandmould.execution.simulate import render_run
from sandmould.execution.simulate import simulate as simulate_run
from sandmould.kinds.sand.execution import SandExecution
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.outcome import RunOutcome
from sandmould.runs.products import finish
from sandmould.scenario.scenario import Scenario
from tests.planned import write_plan

SOON: dict[str, Any] = {"rms_speed_m_s": 0.05, "load_tolerance": 0.1, "checks": 3}
"""Rest that a bed finds soon, in a third of the steps: for runs asked about other things."""


def run_folder(scenario: Scenario, folder: Path) -> Path:
    """Plan and render one run, as the workflow does."""
    run = Run("test", "one", {}, 1, scenario, {})
    write_plan([run], folder)
    render_run(folder / "runs" / "one")
    return folder / "runs" / "one"


def simulating(folder: Path) -> list[str]:
    """Give the command that computes a run."""
    return [sys.executable, "-m", "sandmould.execution.simulate", str(folder)]


def simulate(folder: Path, largest_file_bytes: int | None = None) -> int:
    """Compute a run in a process of its own; no file may grow larger than asked."""
    if largest_file_bytes is None:
        logs = folder.parent.parent / "logs"
        logs.mkdir(exist_ok=True)
        start_server([folder])  # a fork has loaded what a new process imports for seconds
        return do(simulate_run, folder, log=logs / "simulate.log").status
    limits = (largest_file_bytes,) * 2

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)

    ran = subprocess.run(simulating(folder), capture_output=True, text=True, preexec_fn=limit)
    return ran.returncode


def computed(scenario: Scenario, folder: Path) -> Path:
    """Plan, render and compute one run without a stop."""
    folder = run_folder(scenario, folder)
    assert simulate(folder) == 0
    return folder


def compute_all(folders: Sequence[Path], log: Path, side_by_side: int = 1) -> None:
    """Render, compute and measure runs as one job does."""
    compute_batch(folders, str(log), 1, "mpiexec", side_by_side)


def kill_at_a_checkpoint(
    command: list[str], folder: Path, runs: str = ".", limit_s: float = 60.0
) -> None:
    """Start a command in a folder and kill it as soon as one of its runs has left a checkpoint.

    Parameters
    ----------
    command : list of str
    folder : Path
        Working folder of the command.
    runs : str
        Pattern of the folders of runs, from there.
    limit_s : float
        How long to wait for the checkpoint.
    """
    process = subprocess.Popen(
        command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    deadline = time.monotonic() + limit_s
    while not list(folder.glob(f"{runs}/work/checkpoint_*/mark.json")):
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()


def kill_after_a_checkpoint(folder: Path) -> None:
    """Start a run and kill it as soon as it has left a checkpoint."""
    kill_at_a_checkpoint(simulating(folder), folder)
    assert not (folder / "outcome.json").exists()
    marks = [json.loads(p.read_text())["mark"] for p in folder.glob("work/checkpoint_*/mark.json")]
    assert max(m["steps"] for m in marks) > 0


def drive(
    scenario: Scenario,
    folder: Path,
    driver_of: Callable[[Program, Path, str, str], Driver] = Driver,
) -> RunOutcome:
    """Compute a run in this process, with a driver of another kind where one is given."""
    program = build_program(scenario)
    engine_of(scenario).write_deck(program, {}, folder, "test", "test")
    driver = driver_of(program, folder, "test", scenario_hash(scenario))
    outcome = driver.run()
    if not outcome.outcome.restartable:
        execution = SandExecution()
        execution.complete(scenario, folder / "work")
        finish(folder, execution.products, outcome, driver.cost, {})
    return outcome


def last_snapshot(folder: Path) -> Snapshot:
    return stored_snapshots(folder)[-1].load()
