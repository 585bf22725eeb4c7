"""The file of a pack: a zip of files as they lie below ``results``, and one list of them.

Anybody's ``unzip`` shows and unpacks it. It may come from anywhere: the list is judged before
anything else is read, and holds the size and the hash of each file.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import re
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.run import FILLS, RUN_NAME
from sandmould.runs.manifest import DECK_FILE, MANIFEST_FILE, read_origin
from sandmould.runs.outcome import RunOutcome
from sandmould.scenario.quantity import NAME, Section
from sandmould.study.plan.lacking import UNREADABLE
from sandmould.study.rounds.round_log import ROUNDS_FILE

SUFFIX = ".zip"
LIST_FILE = "manifest.json"
SCENARIO_FILE, OUTCOME_FILE = "scenario.yaml", "outcome.json"
AT_END = (SCENARIO_FILE, DECK_FILE, OUTCOME_FILE, MANIFEST_FILE)
"""Files that every run has at its end."""
WORK = "work"
"""Folder of a run that is not at its end: its checkpoints and its tables so far."""
_NEVER = ("last_work", "lock")
_CHUNK = 1 << 20
_LISTED = 6
_NAME_BYTES, _PATH_BYTES = 200, 1000
_MOST_FILES = 300_000
_MOST_BYTES = 500 * 10**9
_MOST_TEXT_BYTES = 10**8
"""Of what is read as a whole: a list of files, an outcome."""
_PLACE = re.compile(f"((?:runs|{FILLS})/{RUN_NAME})/(.+)")
_OLDER = b"\xfd7zXZ"
_TORN = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, RuntimeError)
"""What reading a damaged zip may raise beside ``ValueError``."""


class PackedFile(Section):
    """One file of a pack."""

    size: Annotated[int, Field(ge=0, le=_MOST_BYTES)]
    """In bytes."""
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class PackList(Section):
    """All that a pack holds beside this list."""

    format: Literal["sandmould pack 2"] = "sandmould pack 2"
    study: Annotated[str, Field(pattern=NAME, max_length=_NAME_BYTES)]
    files: dict[str, PackedFile]
    """By path from the folder of the study."""
    identities: dict[str, str]
    """Of runs at their end, by their place in it; see ``identity_of``."""

    def runs(self) -> dict[str, dict[str, PackedFile]]:
        """Files of each run or fill by its place; ``ValueError`` for a file that is of none."""
        runs: dict[str, dict[str, PackedFile]] = {}
        for name, file in self.files.items():
            if found := _PLACE.fullmatch(name):
                runs.setdefault(found[1], {})[found[2]] = file
            elif name != ROUNDS_FILE:
                raise ValueError(f"{name[:_NAME_BYTES]!r} in it is no file of a run")
        for place, files in runs.items():
            bad = [path for path in files if not may_travel(path, OUTCOME_FILE in files)]
            folders = {
                str(above) for path in files if not bad for above in PurePosixPath(path).parents
            }
            bad += folders & set(files)
            bad += [
                path for path in AT_END if path in files and files[path].size > _MOST_TEXT_BYTES
            ]
            if bad:
                name = f"{place}/{bad[0]}"
                raise ValueError(f"{name[:_NAME_BYTES]!r} in it is no file of a run")
        return runs


def may_travel(path: str, at_end: bool) -> bool:
    """Whether a file of this path belongs into a run's folder: no way leads out of it."""
    parts = path.split("/")
    harmless = len(path) <= _PATH_BYTES and all(
        part.isprintable() and not part.startswith(".") and "\\" not in part
        and 0 < len(part.encode()) <= _NAME_BYTES
        for part in parts
    )  # fmt: skip
    if not harmless or path.endswith((".partial", "_again.txt")) or parts[0].startswith(_NEVER):
        return False
    if at_end:
        return parts[0] != WORK and not path.startswith("checkpoints_of_")
    return parts[0] == WORK and len(parts) > 1


def is_at_end(folder: Path) -> bool:
    """Whether a run has an outcome that can be read."""
    with contextlib.suppress(*UNREADABLE):
        return RunOutcome.read(folder / OUTCOME_FILE) is not None
    return False


def identity_of(folder: Path) -> str:
    """Hashes of a run's scenario and of what turns it into a computation; empty where untold."""
    with contextlib.suppress(*UNREADABLE):
        origin = read_origin(folder)
        return f"{origin['scenario_sha256']} {origin['template_sha256']}"
    return ""


def reasons_lines(reasons: Mapping[str, str], head: str) -> Iterator[str]:
    """A line a reason, with the first of the runs that have it."""
    for why in dict.fromkeys(reasons.values()):
        runs = [run for run, its in reasons.items() if its == why]
        more = f" and {len(runs) - _LISTED} more" if len(runs) > _LISTED else ""
        yield f"  {head}: {', '.join(runs[:_LISTED])}{more}, {why}"


def write_pack(
    study: str, files: Mapping[str, Path], identities: Mapping[str, str], path: Path
) -> PackList:
    """Write a pack of files by their paths; the same files come to the same bytes."""
    with zipfile.ZipFile(path, "w") as archive:
        packed = {name: _add(archive, f"{study}/{name}", files[name]) for name in sorted(files)}
        in_order = dict(sorted(identities.items()))
        listed = PackList(study=study, files=packed, identities=in_order)
        archive.writestr(_head(LIST_FILE), listed.model_dump_json(indent=1) + "\n")
    return listed


def _head(name: str) -> zipfile.ZipInfo:
    """Head of a plain file without a time."""
    head = zipfile.ZipInfo(name)
    head.compress_type = zipfile.ZIP_DEFLATED
    head.create_system, head.external_attr = 3, 0o100644 << 16
    return head


def _add(archive: zipfile.ZipFile, name: str, source: Path) -> PackedFile:
    head, hashed = _head(name), hashlib.sha256()
    head.file_size = source.stat().st_size  # more than 2 GB need another form of head
    with source.open("rb") as file, archive.open(head, "w") as out:
        while chunk := file.read(_CHUNK):
            out.write(chunk)
            hashed.update(chunk)
    return PackedFile(size=head.file_size, sha256=hashed.hexdigest())


class Pack:
    """A pack that is read: its list is sound, and the zip holds what that names and no more."""

    def __init__(self, file: io.BufferedReader) -> None:
        """Judge all heads and the list; ``ValueError`` says what is wrong, in a few words."""
        size = file.seek(0, io.SEEK_END)
        with _reading("it is no zip, cut short or damaged"):
            self._archive = zipfile.ZipFile(file)
        heads = self._archive.infolist()
        if odd := [head.filename for head in heads if not _is_plain(head)]:
            raise ValueError(f"{odd[0][:_NAME_BYTES]!r} in it is no plain file")
        sizes = {head.filename: head.file_size for head in heads}
        unpacked = sum(head.file_size for head in heads)
        if len(heads) > _MOST_FILES or unpacked > _MOST_BYTES:
            raise ValueError(f"it says that it holds {len(heads)} files of {unpacked} bytes")
        if len(sizes) < len(heads) or sum(head.compress_size for head in heads) > size:
            raise ValueError("files in it lie over each other")
        if sizes.pop(LIST_FILE, _MOST_BYTES) > _MOST_TEXT_BYTES:
            raise ValueError(f"it has no {LIST_FILE}")
        try:
            self.listed = PackList.model_validate_json(b"".join(self._chunks(LIST_FILE)))
        except ValidationError as error:
            wrong = error.errors(include_url=False)[0]["msg"]
            raise ValueError(f"its {LIST_FILE} is none of ours ({wrong})") from None
        self.study, self.runs = self.listed.study, self.listed.runs()
        named = {f"{self.study}/{name}": file.size for name, file in self.listed.files.items()}
        if odd := [name for name, _ in sorted(sizes.items() ^ named.items())]:
            raise ValueError(f"{odd[0][:_NAME_BYTES]!r} is not as its {LIST_FILE} says")

    def extract(self, names: Iterable[str], folder: Path) -> None:
        """Write files below a folder; ``ValueError`` where one is damaged."""
        for name in names:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            hashed = hashlib.sha256()
            with (folder / name).open("wb") as out:
                for chunk in self._chunks(f"{self.study}/{name}"):
                    hashed.update(chunk)
                    out.write(chunk)
            if hashed.hexdigest() != self.listed.files[name].sha256:
                raise ValueError(f"{name!r} does not match its hash")

    def _chunks(self, name: str) -> Iterator[bytes]:
        with _reading(f"{name!r} is damaged"), self._archive.open(name) as file:
            while chunk := file.read(_CHUNK):
                yield chunk


def _is_plain(head: zipfile.ZipInfo) -> bool:
    """Whether a member is a plain file, in a form that takes little memory to unpack."""
    is_file = head.external_attr >> 28 in (0, 8) and not head.flag_bits & 1
    return is_file and head.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


@contextlib.contextmanager
def _reading(what: str) -> Iterator[None]:
    """Say what is wrong where a zip cannot be read."""
    try:
        yield
    except _TORN as error:
        raise ValueError(f"{what} ({error})") from None


class _CountedBytes(io.BufferedReader):
    """A file that gives no more at a time than the heads of a pack's files take."""

    def read(self, size: int | None = -1, /) -> bytes:
        """Read, as any file does."""
        if size is not None and size > _MOST_TEXT_BYTES:
            raise ValueError("it says that it holds more files than any pack does")
        return super().read(size)


@contextlib.contextmanager
def open_pack(path: Path) -> Iterator[Pack]:
    """Open a pack; what is wrong with it becomes one ``BadInputError``."""
    try:
        if path.exists() and not path.is_file():
            raise ValueError("it is no file")
        with _CountedBytes(io.FileIO(path)) as file:
            if file.peek(len(_OLDER)).startswith(_OLDER):
                raise ValueError("an older version wrote this one: pack the runs again")
            yield Pack(file)
    except ValueError as error:
        valid = f"a whole pack of runs, as sandmould pack writes it: {error}"
        raise BadInputError([Problem("FILE", str(path), valid)]) from None
