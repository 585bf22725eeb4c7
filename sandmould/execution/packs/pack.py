"""Pack the runs of a study that are at their end."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Container
from pathlib import Path

from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.definition.run import FILLS
from sandmould.digest import file_digest
from sandmould.engines.snapshot import SNAPSHOTS, SnapshotFile, stored_snapshots
from sandmould.execution.packs.archive import AT_END, SUFFIX, place_of, reasons_lines, write_pack
from sandmould.runs.formatting import listed, size_text
from sandmould.runs.manifest import (
    HASHES,
    LEFT_OUT,
    Manifest,
    change,
    listed_files,
    read_manifest,
    save_manifest,
)
from sandmould.study.plan.build_plan import Plan, writing
from sandmould.study.plan.trust import carried
from sandmould.study.rounds.round_log import ROUNDS_FILE

_EARLIER = (SNAPSHOTS, "exports")
"""How the names of files begin that show how a run came to its end."""


def pack(
    plan: Plan,
    results: Path,
    target: Path | None = None,
    *,
    last_state: bool = False,
    outside_files: bool = False,
) -> str:
    """Pack a study, without snapshots before the last and exports for its ``last_state`` alone.

    Films and pictures of earlier moments are not to be had from such runs any more, their tables
    are. Copies of files from outside the study's folder go along if ``outside_files`` asks so.

    Says what was packed, what was left out and why.

    Raises
    ------
    BadInputError
        Where there is nothing to pack, or the file cannot be written.
    """
    study, folder = plan.study.name, results / plan.study.name
    target = target or Path(f"{study}_runs{SUFFIX}")
    if target.suffix != SUFFIX:
        valid = f"a file whose name ends in {SUFFIX}"
        raise BadInputError([Problem("--output", str(target), valid)])
    lacks = plan.lacks(results)
    left_out = {run: lack.why or "not at its end" for run, lack in lacks.items()}
    files: dict[str, Path] = {}
    beyond: dict[str, str] = {}
    with (
        writing(target.parent, "--output"),
        tempfile.TemporaryDirectory(prefix=f"{study}.partial", dir=target.parent) as work,
    ):
        for run in plan.runs:
            if run.run in left_out:
                continue
            try:
                others = {} if outside_files else carried(plan.study, run.scenario)
                found = _files_of(folder / run.place, Path(work, run.run), last_state, others)
                beyond |= {n: p for n, p in others.items() if (folder / run.place / n).is_file()}
            except ValueError as error:
                left_out[run.run] = str(error)
                continue
            files |= {f"{run.place}/{name}": path for name, path in found.items()}
            if run.fill:  # for its cost: runs at their end need no more of it
                files |= {f"{FILLS}/{run.fill}/{n}": folder / FILLS / run.fill / n for n in AT_END}
        if not files:
            valid = f"a study with runs to pack: those of {folder} are not at their end"
            raise BadInputError([Problem("STUDY", study, valid)])
        files[ROUNDS_FILE] = folder / ROUNDS_FILE
        there = {name: path for name, path in files.items() if path.is_file()}
        os.replace(write_pack(study, there, Path(work)), target)
    of_study = {run.run: left_out[run.run] for run in plan.runs if run.run in left_out}
    number, size = len(plan.runs) - len(of_study), size_text(target.stat().st_size)
    lines = [f"{target}: {number} runs, {size}", *reasons_lines(of_study, "left out")]
    lines.append(f"Send {display_path(plan.study.path)} and the files that it names with it.")
    if beyond:
        lines.append(f"left out, from outside the study's folder: {listed([*beyond.values()])}")
    return "\n".join(lines)


def _files_of(place: Path, anew: Path, last_state: bool, others: Container[str]) -> dict[str, Path]:
    """Files of a run at its end, new ones in ``anew``; ``ValueError`` where it cannot be packed."""
    manifest = read_manifest(place)
    if why := change(place, manifest):
        raise ValueError(why)
    anew.mkdir()
    if last_state:
        manifest = _last_state(place, manifest, anew)
    if left := [name for name in manifest["computed"] if name in others]:
        sizes = {name: size for name, size in manifest["computed"].items() if name not in left}
        manifest = manifest | {"computed": sizes}
        save_manifest(anew, manifest)
    names = (*AT_END, *listed_files(manifest))
    if odd := [name for name in names if not place_of(f"runs/{place.name}/{name}")]:
        raise ValueError(f"with a file that cannot be packed, {odd[0]!r}")
    now = {name: place / name for name in names}
    return now | {path.name: path for path in anew.iterdir()}


def _last_state(place: Path, manifest: Manifest, anew: Path) -> Manifest:
    """Leave out what shows how a run came to its end, and write that down."""
    listed = listed_files(manifest)
    left = {name: size for name, size in listed.items() if name.startswith(_EARLIER)}
    kept = manifest | {
        step: {name: size for name, size in manifest[step].items() if name not in left}
        for step in ("computed", "measured")
    }
    if left:
        kept[LEFT_OUT] = {**left, **manifest.get(LEFT_OUT, {})}
    for stored in stored_snapshots(place)[-1:]:
        last = SnapshotFile(anew, 0)
        last.append(stored.load())
        last.close()
        kept["computed"][SNAPSHOTS] = (anew / SNAPSHOTS).stat().st_size
        kept[HASHES] = manifest.get(HASHES, {}) | {SNAPSHOTS: file_digest(anew / SNAPSHOTS)}
    save_manifest(anew, kept)
    return kept
