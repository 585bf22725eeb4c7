"""Put the runs of a pack into a folder of results; what lies there already stays."""

from __future__ import annotations

import collections
import contextlib
import itertools
import os
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sandmould.bad_input import BadInputError, Problem
from sandmould.digest import file_digest
from sandmould.execution.packs.archive import Archive
from sandmould.execution.packs.index import (
    AT_END,
    OUTCOME_FILE,
    WORK,
    Member,
    PackedRun,
    same_computation,
)
from sandmould.execution.packs.rounds import merge_rounds
from sandmould.execution.process import is_locked, take_turn
from sandmould.runs.manifest import read_manifest, read_origin
from sandmould.runs.outcome import RunOutcome
from sandmould.study.plan.lacking import UNREADABLE

_PART = "unpacking.partial"
"""Folder of a run that its files are written to until all are whole."""
_COMPARED = ("series.tsv", "measures.tsv")
_LISTED = 6
_BUSY = "being computed here"


@dataclass
class Unpacked:
    """What became of the runs of a pack."""

    study: str
    taken: list[str] = field(default_factory=list)
    fills: list[str] = field(default_factory=list)
    """Those that runs share, each for its cost or whole."""
    checkpoints: list[str] = field(default_factory=list)
    there: list[str] = field(default_factory=list)
    """At their end here before."""
    other_digits: list[str] = field(default_factory=list)
    """Those of them whose tables differ."""
    left: dict[str, str] = field(default_factory=dict)
    """Other runs that were not taken, and why."""
    rounds: str = ""
    """What became of the rounds, if that is worth a word."""

    def text(self) -> str:
        """What a person should know."""
        parts = [f"{len(self.taken)} runs taken"]
        if self.checkpoints:
            parts.append(f"{len(self.checkpoints)} checkpoints taken")
        if self.there:
            parts.append(f"{len(self.there)} here already")
        lines = [f"{self.study}: {', '.join(parts)}"]
        if self.other_digits:
            lines.append(
                f"  computed here and there with other digits, ours stay: "
                f"{_names(self.other_digits)}"
            )
        reasons: dict[str, list[str]] = {}
        for run, why in self.left.items():
            reasons.setdefault(why, []).append(run)
        lines += [f"  not taken: {_names(runs)}, {why}" for why, runs in reasons.items()]
        return "\n".join([*lines, *([f"  {self.rounds}"] if self.rounds else [])])


def _names(runs: list[str]) -> str:
    more = len(runs) - _LISTED
    return ", ".join(runs[:_LISTED]) + (f" and {more} more" if more > 0 else "")


def unpack(path: Path, results: Path, checkpoints: bool = False) -> Unpacked:
    """Take the runs of a pack that are not here yet, while no start computes the study.

    Parameters
    ----------
    path : Path
    results : Path
        Folder of all results.
    checkpoints : bool
        Whether runs that are not at their end are taken: engines read their files, so they should
        come from somebody you trust.

    Raises
    ------
    BadInputError
        Where the file is no pack of ours or is damaged. Runs before the damage are taken.
    """
    with open_pack(path) as archive:
        folder = results / archive.index.study
        turn = take_turn(folder)
        try:
            unpacked = Unpacked(archive.index.study)

            def wanted(name: str, run: PackedRun) -> bool:
                place = folder / run.place(name)
                if run.is_fill:
                    return wants_fill(place)
                return _is_wanted(place, run, checkpoints, unpacked)

            place_runs(archive, folder, wanted, unpacked, checkpoints)
            return unpacked
        finally:
            if turn:
                turn.close()


@contextlib.contextmanager
def open_pack(path: Path) -> Iterator[Archive]:
    """Open a pack; what is wrong with it becomes one sentence."""
    try:
        with path.open("rb") as file:
            yield Archive(path, file)
    except ValueError as error:
        valid = f"a whole pack of runs, as sandmould pack writes it: {error}"
        raise BadInputError([Problem("FILE", str(path), valid)]) from None


def place_runs(
    archive: Archive,
    folder: Path,
    wanted: Callable[[str, PackedRun], bool],
    unpacked: Unpacked,
    checkpoints: bool = False,
) -> None:
    """Put runs into the results of a study, each once all of its files are whole.

    Parameters
    ----------
    archive : Archive
    folder : Path
        ``results/<study>``.
    wanted : callable
        Whether a run is taken, from its name and what the pack holds of it.
    unpacked : Unpacked
        Takes what became of each run.
    checkpoints : bool
        Whether a fill is taken with the state that runs go on from, or for its cost alone.

    Raises
    ------
    ValueError
        Where the archive is damaged.
    BadInputError
        Where it does not fit on the disk.
    """
    index = archive.index
    chosen = {name for name, run in index.runs.items() if wanted(name, run)}
    needed = sum(index.runs[name].bytes for name in chosen)
    folder.mkdir(parents=True, exist_ok=True)
    if needed > (free := shutil.disk_usage(folder).free):
        valid = f"a folder with {needed / 1e9:.1f} GB of room: it has {free / 1e9:.1f}"
        raise BadInputError([Problem("results", str(folder), valid)])
    for run, files in itertools.groupby(archive.members(), lambda item: item[0].run):
        if run in chosen:
            packed = index.runs[run]
            if packed.is_fill and not checkpoints:
                files = _of_its_cost(files)
            _take(folder / packed.place(run), packed, files, unpacked)
            chosen.remove(run)
            continue
        for _, chunks in files:
            if run:
                collections.deque(chunks, maxlen=0)
            else:
                unpacked.rounds = merge_rounds(b"".join(chunks), folder)
        if not chosen:
            return


def take_rounds(archive: Archive, folder: Path) -> bool:
    """Take the rounds of a pack alone; whether it has any."""
    if archive.index.rounds:
        _, chunks = next(archive.members())
        merge_rounds(b"".join(chunks), folder)
    return archive.index.rounds is not None


def _of_its_cost(
    files: Iterator[tuple[Member, Iterator[bytes]]],
) -> Iterator[tuple[Member, Iterator[bytes]]]:
    """Files of a fill that no engine reads."""
    for member, chunks in files:
        if member.path in AT_END:
            yield member, chunks
        else:
            collections.deque(chunks, maxlen=0)


def _take(
    place: Path,
    run: PackedRun,
    files: Iterator[tuple[Member, Iterator[bytes]]],
    unpacked: Unpacked,
) -> None:
    """Write a run's files beside what lies in its folder; once all are whole they move there."""
    part = place / _PART
    shutil.rmtree(part, ignore_errors=True)
    try:
        for member, chunks in files:
            (part / member.path).parent.mkdir(parents=True, exist_ok=True)
            with (part / member.path).open("wb") as out:
                out.writelines(chunks)
        if run.at_end:
            _check(part, run)
        if is_locked(place):
            unpacked.left[place.name] = _BUSY
        else:
            _move(part, place)
            ended = unpacked.fills if run.is_fill else unpacked.taken
            (ended if run.at_end else unpacked.checkpoints).append(place.name)
    finally:
        shutil.rmtree(part, ignore_errors=True)
        with contextlib.suppress(OSError):
            place.rmdir()  # of a damaged pack nothing stays


def _check(part: Path, run: PackedRun) -> None:
    """See that a run is what the index says."""
    try:
        RunOutcome.read(part / OUTCOME_FILE)
        read_manifest(part)
        same = same_computation(run, read_origin(part))
    except UNREADABLE:
        same = False
    if not same:
        raise ValueError(f"run {part.parent.name} is not what its index says")


def _move(part: Path, place: Path) -> None:
    """Put whole files into a run's folder, its outcome last, as a run does at its end.

    All have one time: Snakemake computes what is older than what it is made from.
    """
    now = time.time()
    for path in part.rglob("*"):
        os.utime(path, (now, now))
    for name in (OUTCOME_FILE, WORK, "last_work"):
        _remove(place / name)
    for path in sorted(part.iterdir(), key=lambda path: path.name == OUTCOME_FILE):
        _remove(place / path.name)
        os.replace(path, place / path.name)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _is_wanted(place: Path, run: PackedRun, checkpoints: bool, unpacked: Unpacked) -> bool:
    """Whether a run is taken; why not goes to what became of it."""
    name = place.name
    if _at_end(place):
        if not run.at_end:
            unpacked.there.append(name)
        elif not same_computation(run, _origin_or_none(place)):
            unpacked.left[name] = (
                "at its end here with another scenario, deck or solver: remove its folder to take "
                "the packed one"
            )
        else:
            unpacked.there.append(name)
            if any(_differs(place / table, run) for table in _COMPARED):
                unpacked.other_digits.append(name)
    elif is_locked(place):
        unpacked.left[name] = _BUSY
    elif run.at_end:
        return True
    elif not checkpoints:
        unpacked.left[name] = "not at its end: --checkpoints takes its checkpoint (docs/trust.md)"
    elif (place / WORK).exists():
        unpacked.left[name] = "begun here as well"
    else:
        return True
    return False


def wants_fill(place: Path) -> bool:
    """Whether a fill is taken: one that is here, or on its way, stays."""
    return not (_at_end(place) or (place / WORK).exists() or is_locked(place))


def _at_end(place: Path) -> bool:
    try:
        RunOutcome.read(place / OUTCOME_FILE)
    except UNREADABLE:
        return False
    return True


def _origin_or_none(place: Path) -> dict[str, Any]:
    with contextlib.suppress(*UNREADABLE):
        return read_origin(place)
    return {}


def _differs(table: Path, run: PackedRun) -> bool:
    packed = run.files.get(table.name)
    return packed is not None and table.is_file() and file_digest(table) != packed.sha256
