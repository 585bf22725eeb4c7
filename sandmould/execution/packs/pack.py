"""Pack the runs of a study that are at their end, and checkpoints of the others on request."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.run import FILLS, LAST_MEASURED
from sandmould.digest import digest
from sandmould.engines.snapshot_file import OLDER, SNAPSHOTS, SnapshotFile, stored_snapshots
from sandmould.execution.locks import is_locked
from sandmould.execution.packs.archive import (
    AT_END,
    OUTCOME_FILE,
    SUFFIX,
    WORK,
    PackList,
    identity_of,
    is_at_end,
    may_travel,
    open_pack,
    reasons_lines,
    write_pack,
)
from sandmould.runs.formatting import size_text
from sandmould.runs.manifest import LEFT_OUT, MANIFEST_FILE, Manifest, read_manifest
from sandmould.study.plan.build_plan import Plan, writing
from sandmould.study.plan.lacking import WHOLE, Need
from sandmould.study.rounds.round_log import ROUNDS_FILE

_DIGITS = 8
_COLOURS = 32


@dataclass(frozen=True)
class Packed:
    """What became of packing a study."""

    path: Path
    listed: PackList
    left_out: Mapping[str, str]
    """Runs that are not in the pack, and why."""

    @property
    def bytes(self) -> int:
        """Room that its files need."""
        return sum(file.size for file in self.listed.files.values())

    def text(self) -> str:
        """What a person should know."""
        runs = self.listed.runs().items()
        ends = [OUTCOME_FILE in files for place, files in runs if not place.startswith(FILLS)]
        checkpoints = f" and {ends.count(False)} checkpoints" if False in ends else ""
        size = f"{size_text(self.path.stat().st_size)}, unpacked {size_text(self.bytes)}"
        first = f"{self.path}: {sum(ends)} runs{checkpoints}, {size}"
        return "\n".join([first, *reasons_lines(self.left_out, "left out")])


def pack(
    plan: Plan,
    results: Path,
    target: Path | None = None,
    *,
    last_state: bool = False,
    checkpoints: bool = False,
) -> Packed:
    """Pack a study.

    Parameters
    ----------
    plan : Plan
    results : Path
    target : Path, optional
        File to write. A folder, made where a name has no ending, takes one more file, of what no
        pack of the study in it holds.
    last_state : bool
        Whether snapshots before the last and exports are left out: films and pictures of earlier
        moments are not to be had from such a run any more, its tables are. Its own picture has
        few colours.
    checkpoints : bool
        Whether runs that were stopped go along, and with the fills that runs share the states that
        other runs go on from. Of a fill its cost goes along in any case.

    Raises
    ------
    BadInputError
        Where there is nothing to pack, or the file cannot be written.
    """
    study = plan.study.name
    target = target or Path(f"{study}_runs{SUFFIX}")
    if not target.suffix and not target.exists():
        with writing(target.parent, "--output"):
            target.mkdir()
    if not target.is_dir() and target.suffix != SUFFIX:
        valid = f"a folder, or a file whose name ends in {SUFFIX}"
        raise BadInputError([Problem("--output", str(target), valid)])
    place = target if target.is_dir() else target.parent
    partial = place / f"{study}.partial"
    with tempfile.TemporaryDirectory() as changed, writing(place, "--output"):
        there = packed_in(target, study) if target.is_dir() else {}
        anew = Path(changed) if last_state else None
        files, identities, left_out = _chosen(plan, results, there, checkpoints, anew)
        try:
            listed = write_pack(study, files, identities, partial)
            if target.is_dir():
                target /= f"{study}_{digest(listed.model_dump_json())[:_DIGITS]}{SUFFIX}"
            os.replace(partial, target)
        finally:
            partial.unlink(missing_ok=True)
    return Packed(target, listed, left_out)


def packed_in(folder: Path, study: str) -> dict[str, str]:
    """Identities of runs at their end that the packs of a study in a folder hold, by place."""
    found: dict[str, str] = {}
    for path in sorted(folder.glob(f"{study}_*{SUFFIX}")):
        with open_pack(path) as packed:
            found |= packed.listed.identities if packed.study == study else {}
    return found


def _chosen(
    plan: Plan, results: Path, there: Mapping[str, str], checkpoints: bool, anew: Path | None
) -> tuple[dict[str, Path], dict[str, str], dict[str, str]]:
    """Files to pack by their paths, identities of runs at their end, and why others are left out.

    With a folder ``anew`` runs are packed in their last state; it takes what is written for that.
    """
    folder, lacks = results / plan.study.name, plan.lacks(results)
    files: dict[str, Path] = {}
    identities: dict[str, str] = {}
    left_out: dict[str, str] = {}
    fills: set[str] = set()
    for run in sorted(plan.runs, key=lambda run: run.run):
        where, at_end = folder / run.place, lacks.get(run.run, WHOLE).need is Need.NOTHING
        found = _found(where, at_end)
        if why := _left_out(where, lacks.get(run.run, WHOLE).need, found, checkpoints):
            left_out[run.run] = why
        elif at_end and there.get(run.place) == identity_of(where):
            left_out[run.run] = "packed already"
        else:
            if at_end:
                identities[run.place] = identity_of(where)
                found = found if anew is None else _last_state(where, found, anew / run.run)
            files |= {f"{run.place}/{path}": source for path, source in found.items()}
            fills |= {f"{FILLS}/{run.fill}"} if run.fill else set()
    if not files:
        most = max(left_out.values(), key=list(left_out.values()).count)
        valid = f"a study with runs to pack: those of {folder} are not ({most})"
        raise BadInputError([Problem("STUDY", plan.study.name, valid)])
    for fill in fills:
        # a damaged one is left out: its runs do not need it any more
        where, found = folder / fill, _found(folder / fill, at_end=True)
        if is_at_end(where) and set(AT_END) <= set(found) and there.get(fill) != identity_of(where):
            identities[fill] = identity_of(where)
            kept = found if checkpoints else AT_END
            files |= {f"{fill}/{path}": found[path] for path in kept}
    if (folder / ROUNDS_FILE).is_file():
        files[ROUNDS_FILE] = folder / ROUNDS_FILE
    return files, identities, left_out


def _left_out(place: Path, need: Need, found: Mapping[str, Path], checkpoints: bool) -> str:
    """Why a run is left out; empty where it is packed."""
    if need is Need.MEASURE:
        return "not measured: the next start does it"
    if need is Need.COMPUTE:
        if not checkpoints:
            return "not at their end"
        return "being computed" if is_locked(place) else "" if found else "not begun"
    manifest = read_manifest(place)
    if not manifest:
        return "of an older version, without a list of what it left"
    listed = {name for step in ("computed", "measured") for name in manifest.get(step, {})}
    lost = sorted(listed - set(found))
    return f"with a file that cannot be packed, {lost[0]!r}" if lost else ""


def _found(place: Path, at_end: bool) -> dict[str, Path]:
    """Files of a run's folder that may travel; what a link leads to is packed as a file."""
    start = place if at_end else place / WORK
    named = {f.relative_to(place).as_posix(): f for f in start.rglob("*") if f.is_file()}
    return {name: path for name, path in named.items() if may_travel(name, at_end)}


def _last_state(place: Path, files: Mapping[str, Path], anew: Path) -> dict[str, Path]:
    """Leave out what shows how a run came to its end, and say so in its list of products."""
    manifest = read_manifest(place) or {}
    anew.mkdir()
    older = sorted(name for name in files if name.startswith(f"{OLDER}/"))
    dropped = {*older[:-1], *(name for name in files if name.startswith("exports"))}
    if LAST_MEASURED in files:  # most of what a run weighs, in a fifth of its bytes
        with Image.open(files[LAST_MEASURED]) as picture:
            picture.convert("RGB").quantize(_COLOURS).save(anew / LAST_MEASURED, optimize=True)
    if SNAPSHOTS in files:
        last = SnapshotFile(anew, 0)
        for stored in stored_snapshots(place)[-1:]:
            last.append(stored.load())
        last.close()
    now = {path.name: path for path in anew.iterdir()}
    steps = {step: manifest[step] for step in ("computed", "measured") if step in manifest}
    left = {name: size for sizes in steps.values() for name, size in sizes.items()
            if name in dropped or name == SNAPSHOTS}  # fmt: skip
    kept: Manifest = manifest | {
        step: {
            name: now[name].stat().st_size if name in now else size
            for name, size in sizes.items()
            if name not in dropped
        }
        for step, sizes in steps.items()
    }
    if left:
        kept[LEFT_OUT] = {**left, **manifest.get(LEFT_OUT, {})}
    now[MANIFEST_FILE] = anew / MANIFEST_FILE
    now[MANIFEST_FILE].write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    return {name: path for name, path in files.items() if name not in dropped} | now
