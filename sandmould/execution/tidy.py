"""Run folders of a study that is no longer as it was: which they are, and removing them."""

from __future__ import annotations

import os
import re
import shutil
import stat
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from sandmould.definition.run import FILLS, RUN_NAME
from sandmould.execution.locks import is_locked
from sandmould.study.plan.build_plan import Plan
from sandmould.study.plan.ownership import owner_path
from sandmould.study.plan.plan_files import STUDY_FILE

_BLOCK_BYTES = 512
"""Unit in which the system counts the blocks of a file."""


@dataclass(frozen=True)
class Leftovers:
    """Run folders that the study no longer lists."""

    removable: tuple[Path, ...]
    kept: dict[Path, str]
    """Those that something else uses, and what does."""
    freed_bytes: int
    """Of the disk, when the removable ones are gone."""


def orphans(plan: Plan, results: Path) -> list[Path]:
    """Folders of runs and fills of a study that its file no longer leads to.

    Folders whose names are not those of runs are the user's own.
    """
    study = results / plan.study.name
    wanted = {study / run.place for run in (*plan.runs, *plan.fills)}
    places = (study / name for name in ("runs", FILLS))
    return [
        folder
        for place in places
        for folder in sorted(place.iterdir() if place.is_dir() else ())
        if folder not in wanted and re.fullmatch(RUN_NAME, folder.name) and folder.is_dir()
    ]


def leftovers(plan: Plan, results: Path) -> Leftovers:
    """Sort the orphans of a study into those that can go and those that are in use."""
    found = orphans(plan, results)
    kept = _uses(found, plan, results) if found else {}
    removable = tuple(folder for folder in found if folder not in kept)
    return Leftovers(removable, kept, freed_bytes(removable))


def freed_bytes(folders: Iterable[Path]) -> int:
    """Disk that removing folders frees: a file with another name elsewhere frees nothing."""
    entries = (path.lstat() for folder in folders for path in (folder, *_below(folder)))
    return sum(
        _BLOCK_BYTES * e.st_blocks for e in entries if e.st_nlink == 1 or stat.S_ISDIR(e.st_mode)
    )


def _below(folder: Path) -> Iterator[Path]:
    """All that lies in a folder; links are not followed."""
    if folder.is_symlink():
        return
    for place, folders, files in os.walk(folder):
        yield from (Path(place, name) for name in (*folders, *files))


def _uses(found: list[Path], plan: Plan, results: Path) -> dict[Path, str]:
    """Which orphans are in use, and by what."""
    uses = {folder: "it is being computed" for folder in found if is_locked(folder)}
    for file in _study_files(plan, results):
        try:
            text = file.read_text(encoding="utf-8")
        except (OSError, ValueError):
            continue
        uses |= {folder: f"{file} names it" for folder in found if folder.name in text}
    real = {folder.resolve(): folder for folder in found}
    for place in results.glob("*/runs/*"):
        if place in found:
            continue
        for path in (place, *_below(place)):
            if path.is_symlink():
                target = path.resolve()
                uses |= {
                    folder: f"{path} leads there"
                    for real_folder, folder in real.items()
                    if target.is_relative_to(real_folder)
                }
    return uses


def _study_files(plan: Plan, results: Path) -> set[Path]:
    """Files of studies that may name files of a run: planned ones, and those beside them."""
    planned = set(results.glob(f"*/{STUDY_FILE}"))
    owners = {owner_path(folder.parent) for folder in planned} | {plan.study.path}
    files = {path for path in owners if path is not None}
    beside = {path for file in files for path in file.parent.glob("*.yaml")}
    return planned | files | beside | set(Path().glob("*.yaml"))


def remove(plan: Plan, results: Path, folders: Iterable[Path]) -> None:
    """Remove run folders with their logs and marks; a link goes without what it leads to."""
    study = results / plan.study.name
    for folder in folders:
        if folder.is_symlink():
            folder.unlink()
        else:
            shutil.rmtree(folder)
        for log in (study / "logs").glob(f"*_{folder.name}.*"):
            log.unlink()
        (study / "batches" / f"{folder.name}.done").unlink(missing_ok=True)
