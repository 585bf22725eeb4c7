"""Put the runs of a pack into a folder of results; what lies there already stays."""

from __future__ import annotations

import contextlib
import os
import shutil
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.run import FILL, FILLS, Run
from sandmould.digest import file_digest
from sandmould.execution.locks import is_locked, take_turn
from sandmould.execution.packs.archive import (
    AT_END,
    OUTCOME_FILE,
    SCENARIO_FILE,
    WORK,
    Pack,
    PackedFile,
    identity_of,
    is_at_end,
    open_pack,
    reasons_lines,
)
from sandmould.execution.packs.rounds import merge_rounds
from sandmould.kinds.registry import kind_of
from sandmould.runs.checkpoint_folders import END_CHECKPOINT
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import DECK_FILE, read_origin
from sandmould.runs.products import LAST_WORK
from sandmould.scenario.yaml_text import is_of_a_plan
from sandmould.study.plan.build_plan import writing
from sandmould.study.plan.lacking import UNREADABLE, Need, lack_of, template_hashes
from sandmould.study.plan.plan_files import read_run
from sandmould.study.rounds.round_log import ROUNDS_FILE

_COMPARED = ("series.tsv", "measures.tsv")
_BUSY = "being computed here"
_REMOVE = "remove its folder to take the packed one"


@dataclass
class Unpacked:
    """What became of the runs of a pack."""

    study: str
    taken: list[str] = field(default_factory=list)
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
        more = {"checkpoints taken": self.checkpoints, "here already": self.there}
        parts = [f"{len(runs)} {what}" for what, runs in more.items() if runs]
        lines = [", ".join([f"{self.study}: {len(self.taken)} runs taken", *parts])]
        other = dict.fromkeys(self.other_digits, "ours stay")
        lines += reasons_lines(other, "computed here and there with other digits")
        lines += reasons_lines(self.left, "not taken")
        return "\n".join([*lines, *([f"  {self.rounds}"] if self.rounds else [])])


def unpack(path: Path, results: Path, checkpoints: bool = False) -> Unpacked:
    """Take the runs of a pack that are not here yet, while no start computes the study.

    Parameters
    ----------
    path : Path
    results : Path
        Folder of all results.
    checkpoints : bool
        Whether runs that are not at their end are taken, and the states of fills: engines read
        their files, so they should come from somebody you trust.

    Raises
    ------
    BadInputError
        Where the file is no pack of ours or is damaged, or the disk takes no more. No run is taken
        then.
    """
    with open_pack(path) as pack, take_turn(results / pack.study) or contextlib.nullcontext():
        folder, unpacked = results / pack.study, Unpacked(pack.study)
        chosen = [p for p in pack.runs if _is_wanted(pack, p, folder, checkpoints, unpacked)]
        template_hash = template_hashes()

        def judge(place: str, part: Path) -> str:
            return _judged(pack.study, place, part, template_hash)

        take(pack, folder, chosen, judge, unpacked, states=checkpoints)
        return unpacked


def take(
    pack: Pack,
    folder: Path,
    places: Iterable[str],
    judge: Callable[[str, Path], str],
    unpacked: Unpacked,
    *,
    states: bool = False,
) -> None:
    """Put runs and fills into ``results/<study>``, once the files of all are whole.

    Parameters
    ----------
    pack : Pack
    folder : Path
    places : iterable of str
    judge : callable
        Why a run at its end that lies in a folder is not taken; empty where it is.
    unpacked : Unpacked
        Takes what became of each run.
    states : bool
        Whether a fill is taken with the state that runs go on from, or for its cost alone.

    Raises
    ------
    ValueError, BadInputError
        Where the pack is damaged, or does not fit on the disk.
    """
    part = folder / "unpacking.partial"
    files = {
        place: [path for path in pack.runs[place] if states or path in AT_END or not _fill(place)]
        for place in places
    }
    needed = sum(pack.runs[place][path].size for place, paths in files.items() for path in paths)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(part, ignore_errors=True)
        if needed > (free := shutil.disk_usage(folder).free):
            valid = f"a folder with {needed / 1e9:.1f} GB of room: it has {free / 1e9:.1f}"
            raise BadInputError([Problem("results", str(folder), valid)])
        try:
            pack.extract({ROUNDS_FILE} & set(pack.listed.files), part)
            for place, paths in files.items():
                pack.extract((f"{place}/{path}" for path in paths), part)
            if (part / ROUNDS_FILE).exists():
                unpacked.rounds = merge_rounds((part / ROUNDS_FILE).read_bytes(), folder)
            for place, paths in files.items():
                at_end, name = OUTCOME_FILE in paths, Path(place).name
                if why := (judge(place, part / place) if at_end else ""):
                    unpacked.left[name] = why
                elif is_locked(folder / place):
                    unpacked.left[name] = _BUSY
                else:
                    _move(part / place, folder / place)
                    if not _fill(place):
                        (unpacked.taken if at_end else unpacked.checkpoints).append(name)
        finally:
            shutil.rmtree(part, ignore_errors=True)


def unusable(run: Run, folder: Path, template_hash: Callable[[Run], str]) -> str:
    """Why a start would compute a run at its end that lies in a folder; empty where it would not.

    A fill without the state that runs go on from tells its cost alone.
    """
    if run.part != FILL or (folder / END_CHECKPOINT).exists():
        lack = lack_of(run, folder, template_hash)
        return f"a start would compute it: {lack.why}" if lack.need is Need.COMPUTE else ""
    with contextlib.suppress(*UNREADABLE):
        of = read_origin(folder)["scenario_sha256"]
        if is_at_end(folder) and of == scenario_hash(run.scenario):
            return ""
    return "it is not told what it cost"


def wants_fill(place: Path) -> bool:
    """Whether a fill is taken: one that is here, or on its way, stays."""
    return not (is_at_end(place) or (place / WORK).exists() or is_locked(place))


def _judged(study: str, place: str, part: Path, template_hash: Callable[[Run], str]) -> str:
    """Why a run is not taken that may come from anywhere.

    Files that a scenario names are not opened: whether a deck of the user's own is the same is for
    the start to say.
    """
    path = part / SCENARIO_FILE
    try:
        if not is_of_a_plan(path.read_bytes()):
            return f"its {SCENARIO_FILE} is not as a plan writes it"
        run = read_run(path)
    except (BadInputError, FileNotFoundError):
        return f"its {SCENARIO_FILE} cannot be read by this version"
    if (run.study, run.place) != (study, place):
        return f"its {SCENARIO_FILE} is that of another run"

    def stated(_: Run) -> str:
        return str(read_origin(part)["template_sha256"])

    own = kind_of(run.scenario).planning.program is not None
    return unusable(run, part, stated if own else template_hash)


def _fill(place: str) -> bool:
    return place.startswith(f"{FILLS}/")


def _move(part: Path, place: Path) -> None:
    """Put whole files into a run's folder, its outcome last, as a run does at its end.

    All have one time: Snakemake computes what is older than what it is made from.
    """
    now = time.time()
    for path in part.rglob("*"):
        os.utime(path, (now, now))
    place.mkdir(parents=True, exist_ok=True)
    for name in (OUTCOME_FILE, WORK, LAST_WORK):
        _remove(place / name)
    for path in sorted(part.iterdir(), key=lambda path: path.name == OUTCOME_FILE):
        _remove(place / path.name)
        os.replace(path, place / path.name)


def _remove(path: Path) -> None:
    shutil.rmtree(path, ignore_errors=True)
    path.unlink(missing_ok=True)


def _is_wanted(pack: Pack, place: str, folder: Path, checkpoints: bool, unpacked: Unpacked) -> bool:
    """Whether a run or a fill is taken; why a run is not goes to what became of it."""
    files, here = pack.runs[place], folder / place
    at_end, is_begun = OUTCOME_FILE in files, (here / WORK).exists()
    if _fill(place):
        return at_end and wants_fill(here)
    same = pack.listed.identities.get(place) == identity_of(here)
    if is_at_end(here) and (same or not at_end):
        unpacked.there.append(here.name)
        if any(_differs(here / table, files) for table in _COMPARED):
            unpacked.other_digits.append(here.name)
        return False
    why = ""
    if is_at_end(here):
        why = f"at its end here with another scenario, deck or solver: {_REMOVE}"
    elif is_locked(here):
        why = _BUSY
    elif at_end and is_begun and _differs(here / DECK_FILE, files):
        why = f"begun here with another deck: {_REMOVE}"
    elif not at_end and not checkpoints:
        why = "not at its end: --checkpoints takes its checkpoint (docs/trust.md)"
    elif not at_end and is_begun:
        why = "begun here as well"
    unpacked.left |= {here.name: why} if why else {}
    return not why


def _differs(path: Path, files: Mapping[str, PackedFile]) -> bool:
    """Whether a file that is here is another in a pack."""
    packed = files.get(path.name)
    return packed is not None and path.is_file() and file_digest(path) != packed.sha256
