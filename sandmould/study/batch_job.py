"""The job that computes a batch of runs, one after the other."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sandmould.scenario.bad_input import BadInputError
from sandmould.study.hashes import scenario_hash
from sandmould.study.kinds.kind import kind_of
from sandmould.study.launch import launch
from sandmould.study.moments import LAST_MEASURED
from sandmould.study.plan import read_run
from sandmould.study.simulate import measure_run, render_run


def is_current(folder: Path) -> bool:
    """Whether a run's folder holds an outcome, of its scenario and deck as they are now."""
    try:
        origin: dict[str, Any] = json.loads((folder / "provenance.json").read_text("utf-8"))
        scenario = read_run(folder / "scenario.yaml").scenario
        there = (folder / "outcome.json").exists()
    except (OSError, ValueError, BadInputError):
        return False
    wanted = scenario_hash(scenario), kind_of(scenario).template_hash(scenario)
    return there and (origin.get("scenario_sha256"), origin.get("template_sha256")) == wanted


def compute_batch(folders: Sequence[Path], logs: Path, ranks: int, mpi: str) -> None:
    """Compute and measure runs, those left out that are there already.

    Parameters
    ----------
    folders : sequence of Path
        Of the runs, each with its ``scenario.yaml``.
    logs : Path
    ranks : int
    mpi : str

    Raises
    ------
    SystemExit
        At the end, when a run stopped or broke: the same job continues it and redoes none.
    """
    stopped = []
    for folder in folders:
        try:
            _compute(folder, logs / f"simulate_{folder.name}.log", ranks, mpi)
        except (Exception, SystemExit) as stop:  # one bad run must not stop the others
            stopped.append(f"{folder.name}: {stop}")
    if stopped:
        raise SystemExit("\n".join(stopped))


def _compute(folder: Path, log: Path, ranks: int, mpi: str) -> None:
    """Do what is missing of one run."""
    if is_current(folder):
        print(f"{folder.name}: computed already", file=sys.stderr)
    else:
        for old in ("outcome.json", LAST_MEASURED):
            (folder / old).unlink(missing_ok=True)  # of another scenario or deck
        render_run(folder)
        launch(folder, log, ranks, mpi)
    if not (folder / LAST_MEASURED).exists():
        measure_run(folder)
