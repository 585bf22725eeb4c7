"""Runs that were planned under another name: one keeps the name that its folder has."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sandmould.bad_input import BadInputError
from sandmould.definition.run import RUN_NAME, Run
from sandmould.plain_file import UNREADABLE
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import MANIFEST_FILE, read_manifest
from sandmould.study.plan.plan_files import SCENARIO_FILE, read_run


def under_kept_names(runs: Sequence[Run], folder: Path) -> list[Run]:
    """Runs of a study, each by the name of the folder that holds it, where one does.

    A name begins with the swept keys, so it changes when a study sweeps one more; it ends with
    the replicate and the hash of the scenario, which stay.

    ``folder``: of the study's results.
    """
    places = folder / "runs"
    there = {path.name for path in places.iterdir()} if places.is_dir() else set()
    free = there - {run.run for run in runs}
    by_end = {_end(name): name for name in sorted(free) if re.fullmatch(RUN_NAME, name)}
    kept = []
    for run in runs:
        name = by_end.get(_end(run.run), "") if run.run not in there else ""
        if name and _scenario_hash(places / name) == scenario_hash(run.scenario):
            del by_end[_end(name)]
            run = replace(run, run=name)
        kept.append(run)
    return kept


def _end(name: str) -> str:
    """Replicate and hash, with which the name of a run ends."""
    return name.rpartition("_r")[2]


def _scenario_hash(folder: Path) -> str:
    """Of the run that lies in a folder; empty where that cannot be read."""
    try:
        if (folder / MANIFEST_FILE).exists():
            return str(read_manifest(folder)["origin"]["scenario_sha256"])
        return scenario_hash(read_run(folder / SCENARIO_FILE).scenario)
    except (BadInputError, *UNREADABLE):
        return ""
