"""Pack the runs of a study that are at their end, and checkpoints of the others on request."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.run import FILLS, LAST_MEASURED
from sandmould.engines.snapshot_file import OLDER, SNAPSHOTS, SnapshotFile, stored_snapshots
from sandmould.execution.packs.archive import Archive, Source, write_archive
from sandmould.execution.packs.index import (
    AT_END,
    OUTCOME_FILE,
    WORK,
    Member,
    PackedRun,
    PackIndex,
    may_travel,
    same_computation,
)
from sandmould.execution.process import is_locked
from sandmould.runs.formatting import size_text
from sandmould.runs.manifest import LEFT_OUT, MANIFEST_FILE, Manifest, read_manifest, read_origin
from sandmould.runs.outcome import RunOutcome
from sandmould.study.plan.build_plan import Plan
from sandmould.study.plan.lacking import UNREADABLE, WHOLE, Need
from sandmould.study.rounds.round_log import ROUNDS_FILE

SUFFIX = ".tar.xz"
_DIGITS = 8
_COLOURS = 32


@dataclass(frozen=True)
class Packed:
    """What became of packing a study."""

    path: Path
    index: PackIndex
    left_out: Mapping[str, str]
    """Runs that are not in the pack, and why."""

    def text(self) -> str:
        """What a person should know."""
        ends = [run.at_end for run in self.index.runs.values() if not run.is_fill]
        at_end, more = sum(ends), ends.count(False)
        checkpoints = f" and {more} checkpoints" if more else ""
        size = f"{size_text(self.path.stat().st_size)}, unpacked {size_text(self.index.bytes)}"
        lines = [f"{self.path}: {at_end} runs{checkpoints}, {size}"]
        reasons: dict[str, list[str]] = {}
        for run, why in self.left_out.items():
            reasons.setdefault(why, []).append(run)
        for why, runs in reasons.items():
            names = ", ".join(runs[:3]) + (", ..." if len(runs) > 3 else "")
            lines.append(f"  left out: {len(runs)}, {why} ({names})")
        return "\n".join(lines)


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
        File to write; a folder takes one more file, of what no pack of the study in it holds.
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
        Where there is nothing to pack, or a file cannot be packed.
    """
    folder = results / plan.study.name
    target = target or Path(f"{plan.study.name}_runs{SUFFIX}")
    there = packed_in(target, plan.study.name) if target.is_dir() else {}
    runs: dict[str, PackedRun] = {}
    sources: dict[tuple[str, str], Source] = {}
    left_out: dict[str, str] = {}
    lacks = plan.lacks(results)
    for name in sorted(run.run for run in plan.runs):
        need, place = lacks.get(name, WHOLE).need, folder / "runs" / name
        why, files = _files(place, need, last_state, checkpoints)
        if need is Need.NOTHING and not why:
            origin = read_origin(place)
            if name in there and same_computation(there[name], origin):
                why = f"packed in {target} already"
        if why:
            left_out[name] = why
            continue
        runs[name] = _packed_run(place, need is Need.NOTHING, files)
        sources |= {(name, path): source for path, source in files.items()}
    if not runs:
        most = max(left_out.values(), key=list(left_out.values()).count)
        valid = f"a study with runs to pack: those of {folder} are not ({most})"
        raise BadInputError([Problem("STUDY", plan.study.name, valid)])
    for fill in {run.fill for run in plan.runs if run.fill and run.run in runs}:
        place = folder / FILLS / fill
        files = _files_of_fill(place, checkpoints)
        if not files or (fill in there and same_computation(there[fill], read_origin(place))):
            continue
        runs[fill] = _packed_run(place, True, files, is_fill=True)
        sources |= {(fill, path): source for path, source in files.items()}
    rounds = Source(folder / ROUNDS_FILE)
    index = PackIndex(
        study=plan.study.name,
        rounds=rounds.packed() if (folder / ROUNDS_FILE).is_file() else None,
        runs=dict(sorted(runs.items())),
    )
    if target.is_dir():
        target = target / f"{plan.study.name}_{index.digest[:_DIGITS]}{SUFFIX}"

    def source_of(member: Member) -> Source:
        return sources[member.run, member.path] if member.run else rounds

    try:
        write_archive(index, source_of, target)
    except ValueError as error:
        valid = f"a study whose files can be packed: {error}"
        raise BadInputError([Problem("STUDY", plan.study.name, valid)]) from None
    return Packed(target, index, left_out)


def packed_in(folder: Path, study: str) -> dict[str, PackedRun]:
    """Runs at their end that the packs of a study in a folder hold."""
    found: dict[str, PackedRun] = {}
    for path in sorted(folder.glob(f"{study}_*{SUFFIX}")):
        try:
            with path.open("rb") as file:
                index = Archive(path, file).index
        except ValueError as error:
            valid = f"a pack of runs that can be read: {error}"
            raise BadInputError([Problem("FILE", str(path), valid)]) from None
        if index.study == study:
            found |= {name: run for name, run in index.runs.items() if run.at_end}
    return found


def _packed_run(
    place: Path, at_end: bool, files: Mapping[str, Source], is_fill: bool = False
) -> PackedRun:
    origin = read_origin(place) if at_end else {}
    return PackedRun(
        at_end=at_end,
        is_fill=is_fill,
        scenario_sha256=origin.get("scenario_sha256", ""),
        template_sha256=origin.get("template_sha256", ""),
        files={path: files[path].packed() for path in sorted(files)},
    )


def _files(
    place: Path, need: Need, last_state: bool, checkpoints: bool
) -> tuple[str, dict[str, Source]]:
    """Why a run is left out, or its files by their path from its folder."""
    if need is Need.MEASURE:
        return "not measured: the next start does it", {}
    if need is Need.NOTHING:
        manifest = read_manifest(place) or {}
        if not manifest:
            return "of an older version, without a list of what it left", {}
        files = dict(_found(place, at_end=True))
        listed = {name for step in ("computed", "measured") for name in manifest.get(step, {})}
        if lost := sorted(listed - set(files)):
            return f"with a file that cannot be packed, {lost[0]!r}", {}
        return "", _last_state(place, files, manifest) if last_state else files
    if not checkpoints:
        return "not at their end", {}
    if is_locked(place):
        return "being computed", {}
    files = dict(_found(place, at_end=False))
    return ("", files) if files else ("not begun", {})


def _files_of_fill(place: Path, checkpoints: bool) -> dict[str, Source]:
    """What tells the cost of a fill, and all that runs go on from where that is asked for.

    Nothing of a fill that is not at its end or is damaged: its runs do not need it any more.
    """
    try:
        RunOutcome.read(place / OUTCOME_FILE)
        read_origin(place)
    except UNREADABLE:
        return {}
    files = dict(_found(place, at_end=True))
    if any(name not in files for name in AT_END):
        return {}
    return files if checkpoints else {name: files[name] for name in AT_END}


def _found(place: Path, at_end: bool) -> Iterator[tuple[str, Source]]:
    """Files of a run's folder that may travel; what a link leads to is packed as a file."""
    start = place if at_end else place / WORK
    for path in start.rglob("*"):
        name = path.relative_to(place).as_posix()
        if path.is_file() and may_travel(name, at_end):
            yield name, Source(path)


def _last_state(place: Path, files: Mapping[str, Source], manifest: Manifest) -> dict[str, Source]:
    """Leave out what shows how a run came to its end, and say so in its list of products."""
    older = sorted(name for name in files if name.startswith(f"{OLDER}/"))
    dropped = {*older[:-1], *(name for name in files if name.startswith("exports"))}
    changed = {name: _few_colours(files[name]) for name in (LAST_MEASURED,) if name in files}
    if SNAPSHOTS in files:
        changed[SNAPSHOTS] = _last_snapshot(place)
    kept: Manifest = {
        step: {
            name: changed[name].packed().size if name in changed else size
            for name, size in sizes.items()
            if name not in dropped
        }
        for step, sizes in manifest.items()
    }
    left = {
        name: size
        for step in ("computed", "measured")
        for name, size in manifest.get(step, {}).items()
        if name in dropped or name == SNAPSHOTS
    }
    if left:
        kept[LEFT_OUT] = {**left, **manifest.get(LEFT_OUT, {})}
    text = json.dumps(kept, indent=1) + "\n"
    return {
        **{name: source for name, source in files.items() if name not in dropped},
        **changed,
        MANIFEST_FILE: Source(text=text.encode()),
    }


def _last_snapshot(place: Path) -> Source:
    """The file of a run's snapshots with the last alone."""
    with tempfile.TemporaryDirectory() as folder:
        file = SnapshotFile(Path(folder), 0)
        for stored in stored_snapshots(place)[-1:]:
            file.append(stored.load())
        file.close()
        return Source(text=(Path(folder) / SNAPSHOTS).read_bytes())


def _few_colours(picture: Source) -> Source:
    """A picture in a fifth of its bytes: it would be most of what a run weighs."""
    out = io.BytesIO()
    with Image.open(io.BytesIO(b"".join(picture.chunks()))) as image:
        image.convert("RGB").quantize(_COLOURS).save(out, "png", optimize=True)
    return Source(text=out.getvalue())
