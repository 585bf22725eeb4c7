"""Put the runs of a pack into a folder of results; what is whole there already stays."""

from __future__ import annotations

import contextlib
import os
import shutil
import time
from pathlib import Path

from sandmould.bad_input import BadInputError
from sandmould.definition.run import FILLS
from sandmould.digest import file_digest
from sandmould.execution.locks import is_locked, take_turn
from sandmould.execution.packs.archive import AT_END, SCENARIO_FILE, Pack, open_pack, reasons_lines
from sandmould.runs.files import replaced
from sandmould.runs.manifest import DECK_FILE, OUTCOME_FILE
from sandmould.runs.products import LAST_WORK
from sandmould.study.plan.build_plan import writing
from sandmould.study.plan.lacking import Need, lack_of, template_hashes
from sandmould.study.plan.plan_files import read_run
from sandmould.study.rounds.round_log import ROUNDS_FILE, RoundLog, log_of

_WORK = "work"


def unpack(path: Path, results: Path) -> str:
    """Take the runs of a pack that are not here yet, while no start computes the study.

    Says what was taken, what was not and why.

    Raises
    ------
    BadInputError
        Where the file is no pack of ours or is damaged, or the disk takes no more. No run is taken
        then.
    """
    with open_pack(path) as pack, take_turn(results / pack.study) or contextlib.nullcontext():
        left = _take(pack, results / pack.study)
        taken = list(left.values()).count("")
        reasons = {run: why for run, why in left.items() if why}
        lines = [f"{pack.study}: {taken} runs taken", *reasons_lines(reasons, "not taken")]
        return "\n".join(lines)


def _take(pack: Pack, folder: Path) -> dict[str, str]:
    """Put runs and fills into ``results/<study>``; why a run was not taken, or nothing, by name.

    Of a fill its cost is taken, not the state that runs go on from, which engines read unchecked.
    """
    part, judge = folder / "unpacking.partial", _Judge(pack.study)
    wanted = [place for place in sorted(pack.runs) if not judge.is_here(folder, place)]
    left = {Path(place).name: "here already" for place in pack.runs if place not in wanted}
    names = [n for p in wanted for n in pack.runs[p] if not _fill(p) or Path(n).name in AT_END]
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(part, ignore_errors=True)
        try:
            pack.extract([*names, *({ROUNDS_FILE} & pack.files.keys())], part)
            if ROUNDS_FILE in pack.files:
                left |= _take_rounds((part / ROUNDS_FILE).read_bytes(), folder / ROUNDS_FILE)
            for place in wanted:
                left[Path(place).name] = why = judge.why_left(part, folder, place)
                if not why:
                    _move(part / place, folder / place)
        finally:
            shutil.rmtree(part, ignore_errors=True)
    fills = {Path(place).name for place in pack.runs if _fill(place)}
    return {name: why for name, why in left.items() if name not in fills}


class _Judge:
    """Judges what lies in the folders of runs, as a start does."""

    def __init__(self, study: str) -> None:
        self._study, self._template_hash = study, template_hashes()

    def is_here(self, folder: Path, place: str) -> bool:
        """Whether a folder of results has a run at its end, or a fill that is begun."""
        here = folder / place
        if _fill(place):
            return (here / OUTCOME_FILE).exists() or (here / _WORK).exists()
        return not self._why_computed(here, place)

    def why_left(self, part: Path, folder: Path, place: str) -> str:
        """Why a run that was unpacked is not taken; empty where it is."""
        here, there = folder / place, part / place
        if is_locked(here):
            return "it is being computed here"
        if _fill(place):
            return ""
        if (here / _WORK).exists() and _deck(here) not in ("", _deck(there)):
            return "begun here with another deck: remove its folder to take the packed one"
        why = self._why_computed(there, place)
        return why and f"a start would compute it: {why}"

    def _why_computed(self, folder: Path, place: str) -> str:
        """Why a start would compute the run whose files lie in a folder; opens no file it names."""
        try:
            run = read_run(folder / SCENARIO_FILE)
        except BadInputError:
            return f"its {SCENARIO_FILE} cannot be read by this version"
        if (run.study, run.place) != (self._study, place):
            return f"its {SCENARIO_FILE} is that of another run"
        lack = lack_of(run, folder, self._template_hash)
        return lack.why or "it is not at its end" if lack.need is Need.COMPUTE else ""


def _fill(place: str) -> bool:
    return place.startswith(f"{FILLS}/")


def _deck(folder: Path) -> str:
    return file_digest(folder / DECK_FILE) if (folder / DECK_FILE).is_file() else ""


def _take_rounds(text: bytes, path: Path) -> dict[str, str]:
    """Take the bytes of a ``rounds.json`` that begins as ours; why not, where others were taken."""
    theirs = log_of(text)
    ours = log_of(path.read_bytes()) if path.is_file() else RoundLog(theirs.basis)
    both = min(len(theirs.rounds), len(ours.rounds))
    if theirs.basis != ours.basis or theirs.rounds[:both] != ours.rounds[:both]:
        return {path.name: "rounds chose other runs here"}
    if len(theirs.rounds) > both or not path.is_file():
        with replaced(path) as partial:
            partial.write_bytes(text)
    return {}


def _move(part: Path, place: Path) -> None:
    """Put whole files into a run's folder, its outcome last, as a run does at its end.

    All have one time: Snakemake computes what is older than what it is made from.
    """
    now = time.time()
    for path in part.rglob("*"):
        os.utime(path, (now, now))
    place.mkdir(parents=True, exist_ok=True)
    for name in (OUTCOME_FILE, _WORK, LAST_WORK):
        _remove(place / name)
    for path in sorted(part.iterdir(), key=lambda path: path.name == OUTCOME_FILE):
        _remove(place / path.name)
        os.replace(path, place / path.name)


def _remove(path: Path) -> None:
    shutil.rmtree(path, ignore_errors=True)
    path.unlink(missing_ok=True)
