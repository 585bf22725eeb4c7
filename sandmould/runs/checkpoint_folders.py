"""Checkpoints that engines write to folders: two in turn, each whole or not there at all."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from sandmould.digest import file_digest
from sandmould.plain_file import read_json
from sandmould.runs.files import write_text

END_CHECKPOINT = "end_checkpoint"
"""Folder of the state at the end of a fill, from which runs go on."""
_FILLED = "fill_checkpoint"
"""Folder of the same in a run that may begin again from there."""

LAYOUT = 2
"""Of the files of checkpoints: raised when those of earlier versions cannot be read any more."""


@dataclass(frozen=True)
class CheckpointMark:
    """Where a run stood when a checkpoint was written."""

    scenario_hash: str
    stage: str
    steps: int
    snapshots: int
    """Snapshots written so far."""
    series_bytes: int
    loads_bytes: int
    """Sizes of the tables: what came after is written again."""
    cost: dict[str, Any]
    """The cost row so far."""
    shared_stages: int = 0
    """Stages at the beginning that another run has computed and pays for."""
    bed_limit_s: float | None = None
    """Exact critical step of the filled bed, where the run takes its step from it."""
    layout: int = 1
    """``LAYOUT`` of the version that wrote it."""
    table_bytes: int = 0
    """Size of the table of a vibrating table's periods; 0 where there is none yet."""


def _digests(folder: Path) -> dict[str, str]:
    return {
        p.name: file_digest(p)
        for p in sorted(folder.iterdir())
        if p.is_file() and not p.name.startswith("mark.json")
    }


def seal(folder: Path, mark: CheckpointMark) -> None:
    """Close a checkpoint folder: the mark with the files' hashes comes last."""
    tree = {"mark": asdict(mark) | {"layout": LAYOUT}, "sha256": _digests(folder)}
    text = json.dumps(tree)
    write_text(folder / "mark.json", text)


def lay(source: Path, target: Path, mark: CheckpointMark) -> None:
    """Make a checkpoint of the files of another one, which comes as a whole."""
    partial = empty(target.with_name(f"{target.name}_partial"))
    for file in source.iterdir():
        if file.name != "mark.json":
            _link(file, partial / file.name)
    seal(partial, mark)
    shutil.rmtree(target, ignore_errors=True)
    partial.rename(target)


def _link(source: Path, target: Path) -> None:
    """Give a file a second name; copy it where the file system has no such names."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def keep_filled(work: Path, newest: tuple[Path, CheckpointMark]) -> None:
    """Keep the end of the fill, which is the newest checkpoint."""
    lay(newest[0], work / _FILLED, newest[1])


def begin_again(work: Path, bed_limit_s: float, cost: dict[str, Any]) -> None:
    """Make the end of the fill the newest checkpoint, with another limit of the bed.

    Raises
    ------
    ValueError
        When it is missing or damaged.
    """
    mark = replace(read_mark(work / _FILLED), bed_limit_s=bed_limit_s, cost=cost)
    for name in ("checkpoint_a", "checkpoint_b"):
        shutil.rmtree(work / name, ignore_errors=True)
    lay(work / _FILLED, work / "checkpoint_a", mark)


def read_mark(folder: Path, scenario_hash: str = "") -> CheckpointMark:
    """Read the mark of a checkpoint whose files are all as they were sealed.

    Raises
    ------
    ValueError
        When the checkpoint is missing or damaged, of a version with other files, or not of the
        scenario of a hash that is given.
    """
    try:
        sealed = read_json(folder / "mark.json")
        if sealed["sha256"] != _digests(folder):
            raise ValueError("its files do not match their hashes")
        mark = CheckpointMark(**sealed["mark"])
        if mark.layout != LAYOUT:
            raise ValueError("another version of Sandmould wrote it")
        if scenario_hash not in ("", mark.scenario_hash):
            raise ValueError("it is of another scenario")
        return mark
    except (OSError, KeyError, TypeError) as error:
        raise ValueError(str(error)) from error


def next_folder(work: Path) -> Path:
    """Give an empty folder for the next checkpoint, keeping the newest sealed one."""
    newest = newest_checkpoint(work)[0]
    other = "b" if newest is not None and newest[0].name == "checkpoint_a" else "a"
    return empty(work / f"checkpoint_{other}")


def empty(folder: Path) -> Path:
    """Make a folder, or empty the one that is there."""
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    return folder


def set_aside(work: Path, mark: CheckpointMark) -> Path:
    """Move both checkpoints of another scenario out of the work folder, which is swept later."""
    aside = work.parent / f"checkpoints_of_{mark.scenario_hash[:12]}"
    aside.mkdir(exist_ok=True)
    for folder in (work / "checkpoint_a", work / "checkpoint_b"):
        if folder.is_dir() and not (aside / folder.name).exists():
            folder.rename(aside / folder.name)
    return aside


def newest_checkpoint(work: Path) -> tuple[tuple[Path, CheckpointMark] | None, list[str]]:
    """Find the newest whole checkpoint.

    Returns
    -------
    newest : (folder, mark) or None
    damaged : list of str
        One sentence for each checkpoint that cannot be used.
    """
    whole: list[tuple[Path, CheckpointMark]] = []
    damaged: list[str] = []
    for folder in (work / "checkpoint_a", work / "checkpoint_b"):
        if not folder.is_dir():
            continue
        try:
            whole.append((folder, read_mark(folder)))
        except ValueError as error:
            damaged.append(f"checkpoint {folder.name} cannot be used: {error}")
    return max(whole, key=lambda item: item[1].steps, default=None), damaged
