"""Runs that are asked for again: how they ended is forgotten, and the next start computes them."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path

from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.definition.run import FILLS
from sandmould.execution.locks import is_locked
from sandmould.plain_file import UNREADABLE
from sandmould.runs.manifest import MANIFEST_FILE
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.ownership import owner_path
from sandmould.study.plan.plan_files import read_run


def forget(names: Sequence[str], results: Path) -> list[Path]:
    """Forget how runs ended, whether they failed or finished.

    ``names``: those of runs, ``RUN``, ``STUDY/RUN`` or the path of a run's folder.

    Gives the files of their studies, whose next start computes them.

    Raises
    ------
    BadInputError
        Before anything is forgotten: where a run is unknown, is of several studies, is being
        computed, or its study's file is not there or leads to it no longer.
    """
    folders, problems = run_folders(names, results)
    studies: dict[Path, Path] = {}
    for study in dict.fromkeys(folder.parent.parent for folder in folders):
        path = owner_path(study)
        if path is None:
            valid = f"one whose study file is there: that of {study} is not"
            problems += [Problem("RUN", f.name, valid) for f in folders if study in f.parents]
        else:
            studies[study] = path
    plans = {study: {r.run for r in open_plan(p, results).runs} for study, p in studies.items()}
    for folder in folders:
        study = folder.parent.parent
        if study in plans and folder.name not in plans[study]:
            file = display_path(studies[study])
            valid = f"a run that {file} still leads to: sandmould run {file} computes what is new"
            problems.append(Problem("RUN", folder.name, valid))
        elif is_locked(folder):
            problems.append(Problem("RUN", folder.name, "a run that is not being computed"))
    if problems:
        raise BadInputError(problems)
    for folder in folders:
        for place in (folder, *_failed_fill(folder)):
            # The outcome first: without it the run counts as not at its end.
            for name in ("outcome.json", MANIFEST_FILE):
                (place / name).unlink(missing_ok=True)
    return list(dict.fromkeys(studies.values()))


def run_folders(names: Sequence[str], results: Path) -> tuple[list[Path], list[Problem]]:
    """Folders of runs by what a user calls them, see ``forget``, and a problem for each other."""
    problems: list[Problem] = []
    folders: dict[Path, None] = {}
    for name in names:
        found = _folders(name, results)
        if len(found) == 1:
            folders[found[0]] = None
        else:
            problems.append(Problem("RUN", name, _which(name, found, results)))
    return list(folders), problems


def _failed_fill(folder: Path) -> list[Path]:
    """The fill that a run goes on from, where that failed and so must be computed once more."""
    fill = folder.parent.parent / FILLS / read_run(folder / "scenario.yaml").fill
    try:
        failed = RunOutcome.read(fill / "outcome.json").outcome is not Outcome.FINISHED
    except UNREADABLE:
        return []
    return [fill] if failed else []


def _folders(name: str, results: Path) -> list[Path]:
    """Folders of a run; several where several studies have one of the name."""
    parts = [part for part in Path(name).parts if part not in ("runs", ".")]
    if not parts or parts[-1] in ("..", "/"):
        return []
    study, run = (parts[-2], parts[-1]) if len(parts) > 1 else ("", parts[-1])
    return [
        folder
        for folder in sorted(results.glob("*/runs/*"))
        if folder.name == run and study in ("", folder.parent.parent.name)
    ]


def _which(name: str, found: Sequence[Path], results: Path) -> str:
    """What would be valid in place of a name of no run, or of several."""
    if found:
        several = " or ".join(f"{folder.parent.parent.name}/{folder.name}" for folder in found)
        return f"{several}: several studies have a run of this name"
    known = sorted({folder.name for folder in results.glob("*/runs/*")})
    if not known:
        return f"a run of {results}, which has none"
    near = difflib.get_close_matches(Path(name).name, known, n=3, cutoff=0.5)
    return f"a run of {results}, such as {', '.join(near or known[:3])}"
