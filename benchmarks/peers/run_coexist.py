"""ACCES of coexist: its ``Access.learn``, with a scheduler that gets runs from the benchmark.

``Access`` starts a process a run and reads the error that this leaves in a file. The scheduler, its
public way to start runs elsewhere, gets the value, leaves the error in that file itself, and gives
a command that does nothing: an import of pandas a run would cost more than all the rest.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import tempfile
from pathlib import Path
from typing import Any

import coexist
import numpy as np
from coexist.schedulers import Scheduler
from jsonl_pipe import JsonlPipe, serve

SCRIPT = """\
# ACCESS PARAMETERS START
import coexist
parameters = coexist.create_parameters(
    variables = ["first", "second"], minimums = {low}, maximums = {high}, values = {values},
)
# ACCESS PARAMETERS END
error = None  # the scheduler writes it
"""
NEVER = 1e-9
"""Relative uncertainty at which it ends by itself when the problem says to go on."""


class FromBenchmark(Scheduler):
    """Runs that the benchmark makes."""

    def __init__(self, pipe: JsonlPipe, target: float) -> None:
        self.pipe, self.target = pipe, target
        self.access: coexist.Access | None = None

    def __repr__(self) -> str:
        return "FromBenchmark()"

    def schedule(self, dirpath: str, index: int) -> list[str]:
        """Get one value, and state the guesses when an epoch begins."""
        progress = self.access.progress
        if index and index % self.access.setup.population == 0:
            self.guess(progress.epochs[-1, :2])
        results = Path(dirpath) / "results"
        parameters = pickle.loads((results / f"parameters.{index}.pickle").read_bytes())
        value = self.pipe.ask(parameters["value"])
        if value is not None:
            error = pickle.dumps(abs(value - self.target))
            (results / f"result.{index}.pickle").write_bytes(error)
        return ["true"]

    def guess(self, favourite: np.ndarray) -> None:
        """State the optimiser's mean, its estimate, and the best point that was run, its result."""
        history = self.access.progress.history
        if np.isfinite(history[:, -1]).any():
            best = history[int(np.nanargmin(history[:, -1])), :2]
            self.pipe.guess({"estimate": favourite, "best run": best})


def solve(pipe: JsonlPipe, problem: dict[str, Any]) -> str:
    """Learn with the defaults: epochs of eight, and the first point of the start as its start."""
    scheduler = FromBenchmark(pipe, problem["target"])
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        text = SCRIPT.format(
            low=problem["low"], high=problem["high"], values=list(problem["start"][0])
        )
        Path("one.py").write_text(text, encoding="utf-8")
        scheduler.access = coexist.Access("one.py", scheduler)
        ends = {"target_sigma": NEVER} if problem["go_on"] else {}
        scheduler.access.learn(random_seed=problem["seed"], verbose=0, **ends)
        scheduler.guess(scheduler.access.progress.epochs[-1, :2])
    return "the optimiser stopped"


if __name__ == "__main__":
    # The command that does nothing is started eight times an epoch; one thread each is enough.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    serve(solve, ("coexist", "cma", "numpy", "scipy"))
