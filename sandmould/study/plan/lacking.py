"""What a run lacks: the one answer by which starts and batches compute, and status counts."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import IntEnum
from pathlib import Path

from sandmould.definition.run import FILL, Run
from sandmould.kinds.registry import kind_of
from sandmould.plain_file import UNREADABLE
from sandmould.runs.checkpoint_folders import END_CHECKPOINT, read_mark
from sandmould.runs.files import write_text
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import (
    LEFT_OUT,
    MANIFEST_FILE,
    MEASURED_BY,
    Manifest,
    damage,
    deck_damage,
    read_manifest,
)
from sandmould.runs.outcome import Outcome, RunOutcome

LISTED = 12


class Need(IntEnum):
    """What a run needs; the larger includes the smaller."""

    NOTHING = 0
    MEASURE = 1
    COMPUTE = 2


@dataclass(frozen=True)
class Lack:
    """What a run needs and why."""

    need: Need
    why: str = ""
    """Empty for a run that was never at its end."""


WHOLE = Lack(Need.NOTHING)
_NOTE = {Need.COMPUTE: "compute_again.txt", Need.MEASURE: "measure_again.txt"}
"""File of a run's folder that tells Snakemake: a job runs again when one of its inputs is newer."""


def lack_of(run: Run, folder: Path, template_hash: Callable[[Run], str] | None = None) -> Lack:
    """Say what a run lacks, from what lies in its folder.

    A failed run lacks nothing: it has its outcome, and only ``sandmould again`` forgets that.

    ``template_hash``: hash of what turns a run into its deck, for a caller that keeps it; see
    ``Planning``.
    """
    wanted = template_hash or _template_hash
    try:
        outcome = RunOutcome.read(folder / "outcome.json").outcome
    except FileNotFoundError:
        known = (folder / MANIFEST_FILE).exists()
        return Lack(Need.COMPUTE, "outcome.json is missing" if known else "")
    except UNREADABLE:
        return Lack(Need.COMPUTE, "outcome.json cannot be read")
    try:
        manifest = read_manifest(folder)
        origin = manifest["origin"]
        if origin["scenario_sha256"] != scenario_hash(run.scenario):
            return Lack(Need.COMPUTE, "it is of another scenario")
        if origin["template_sha256"] != wanted(run):
            return Lack(Need.COMPUTE, "its deck or its solver has changed since")
    except FileNotFoundError:
        return Lack(Need.COMPUTE, f"{MANIFEST_FILE} is missing")
    except UNREADABLE:
        return Lack(Need.COMPUTE, f"{MANIFEST_FILE} cannot be read")
    lack = _lack_of_files(run, folder, manifest)
    if lack.need is Need.MEASURE and outcome is Outcome.BAD_INPUT:
        return Lack(Need.COMPUTE, lack.why)  # it may have been the measures that it ended for
    return lack if run.part != FILL or lack.need is Need.COMPUTE else _lack_of_end(run, folder)


def _lack_of_end(fill: Run, folder: Path) -> Lack:
    """What is wrong with the state that runs go on from; a fill that failed has none."""
    if RunOutcome.read(folder / "outcome.json").outcome is not Outcome.FINISHED:
        return WHOLE
    try:
        mark = read_mark(folder / END_CHECKPOINT)
    except ValueError as error:
        return Lack(Need.COMPUTE, f"{END_CHECKPOINT} cannot be used: {error}")
    if mark.scenario_hash != scenario_hash(fill.scenario):
        return Lack(Need.COMPUTE, f"{END_CHECKPOINT} is of another scenario")
    return WHOLE


def _lack_of_files(run: Run, folder: Path, manifest: Manifest) -> Lack:
    """What is lost of the files of a run that ended."""
    if why := deck_damage(folder, manifest) or damage(folder, manifest.get("computed", {})):
        return Lack(Need.COMPUTE, why)
    if "measured" not in manifest:
        why = "computed, but its measures are not taken yet"
    else:
        why = damage(folder, manifest["measured"]) or _measured_otherwise(run, manifest)
    if why and LEFT_OUT in manifest:
        return Lack(Need.COMPUTE, f"{why}, and its snapshots were left out of a pack")
    return Lack(Need.MEASURE, why) if why else WHOLE


def _measured_otherwise(run: Run, manifest: Manifest) -> str:
    """Say that a run that can be measured again was measured otherwise than it would be today."""
    code = manifest.get(MEASURED_BY, {}).get("code_sha256")
    if LEFT_OUT in manifest or code == kind_of(run.scenario).planning.measured_by(run.scenario):
        return ""
    return "it is measured otherwise since"


def _template_hash(run: Run) -> str:
    return kind_of(run.scenario).planning.template_hash(run.scenario)


def lacks(runs: Iterable[Run], folder: Path) -> dict[str, Lack]:
    """What each of some runs lacks, by its name; whole ones are left out."""
    template_hash = template_hashes()
    found = {run.run: lack_of(run, folder / run.place, template_hash) for run in runs}
    return {run: lack for run, lack in found.items() if lack.need}


def template_hashes() -> Callable[[Run], str]:
    """Hash of what turns a run into its deck, for many runs."""
    hashes: dict[tuple[Path, ...], str] = {}

    def template_hash(run: Run) -> str:
        # By the files that it is made from: reading them for each run took longer than all else.
        # A program of the user's is made for each run, and was read when it was planned.
        planning = kind_of(run.scenario).planning
        if planning.program is not None:
            return planning.template_hash(run.scenario)
        sources = tuple(planning.sources(run.scenario))
        if sources not in hashes:
            hashes[sources] = _template_hash(run)
        return hashes[sources]

    return template_hash


def note_lacks(runs: Iterable[Run], found: dict[str, Lack], folder: Path) -> str:
    """Write for Snakemake which runs of a study need what, where it would not see that by itself.

    What is missing before anything was collected it sees. Later it takes no notice of a missing
    file whose successors are there, and never of a damaged one. A note of a run that lacks nothing
    any more is removed: it may be newer than a deck that was rendered before it.

    ``found``: what those that are not whole lack, see ``lacks``.

    Says which runs are computed or measured again, and why; empty where none is.
    """
    begun = (folder / "summary.tsv").exists() or (folder / "batches").exists()
    for each in runs:
        run, lack = folder / each.place, found.get(each.run, WHOLE)
        for need, note in _NOTE.items():
            if need is not lack.need:
                (run / note).unlink(missing_ok=True)
        if not lack.need:
            continue
        if begun or any((run / file).exists() for file in ("deck.in", "outcome.json")):
            # The time makes each note differ: an input that says the same is no reason to compute.
            now = datetime.now(UTC).isoformat()
            run.mkdir(parents=True, exist_ok=True)
            write_text(run / _NOTE[lack.need], f"{now} {lack.why or 'it was not at its end'}\n")
    return _told(found)


def notes_of(run_folder: str, *needs: Need) -> list[str]:
    """Notes that a job takes as inputs, those that are there: of what it does for a run."""
    notes = (Path(run_folder) / _NOTE[need] for need in needs)
    return [str(note) for note in notes if note.exists()]


def _told(found: dict[str, Lack]) -> str:
    """Which runs are computed or measured again, and why; runs never at their end left out."""
    verbs = {Need.COMPUTE: "computed again", Need.MEASURE: "measured again"}
    lines = [f"{verbs[lack.need]}: {name} ({lack.why})" for name, lack in found.items() if lack.why]
    more = [f"... and {len(lines) - LISTED} more"] if len(lines) > LISTED else []
    return "\n".join([*lines[:LISTED], *more])
