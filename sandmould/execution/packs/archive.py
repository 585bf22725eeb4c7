"""The file of a pack: a zip of run folders as they lie below ``results``, and one manifest.

Anybody's ``unzip`` shows and unpacks it. It may come from anywhere: its names and sizes are judged
before anything is written, its hashes before anything is taken.
"""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.run import FILLS, RUN_NAME
from sandmould.digest import file_digest
from sandmould.runs.files import write_zip
from sandmould.runs.manifest import DECK_FILE, MANIFEST_FILE, OUTCOME_FILE
from sandmould.scenario.quantity import NAME
from sandmould.study.rounds.round_log import ROUNDS_FILE

SUFFIX = ".zip"
SCENARIO_FILE = "scenario.yaml"
AT_END = (SCENARIO_FILE, DECK_FILE, OUTCOME_FILE, MANIFEST_FILE)
"""Files that every run has at its end."""
_FORMAT = "sandmould pack 2"
_PACK_MANIFEST = "manifest.json"
_MOST_BYTES = 10**8
"""Of the manifest, which is read as a whole."""
_LISTED = 6
_IN_A_RUN = re.compile(
    rf"((?:runs|{FILLS})/{RUN_NAME})/(?!work/|last_work/|lock)(?:[^./\\][^/\\]*/)*[^./\\][^/\\]*"
)
_BROKEN = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, RuntimeError,
           LookupError, TypeError, AttributeError, ValueError, MemoryError)  # fmt: skip
"""What reading a damaged zip may raise, and making sense of its manifest."""


def place_of(name: str) -> str:
    """Folder of the run or the fill that a file belongs to; empty where it must not travel.

    No name leads out of the run's folder, nor to what a start of the run goes on from.
    """
    found = _IN_A_RUN.fullmatch(name)
    return found[1] if found and name.isprintable() else ""


def reasons_lines(reasons: Mapping[str, str], head: str) -> Iterator[str]:
    """A line a reason, with the first of the runs that have it."""
    for why in dict.fromkeys(reasons.values()):
        runs = [run for run, its in reasons.items() if its == why]
        more = f" and {len(runs) - _LISTED} more" if len(runs) > _LISTED else ""
        yield f"  {head}: {', '.join(runs[:_LISTED])}{more}, {why}"


def write_pack(study: str, files: Mapping[str, Path], work: Path) -> Path:
    """Write a pack of files by their paths into a folder; the same files give the same bytes."""
    listed = {
        name: {"size": path.stat().st_size, "sha256": file_digest(path)}
        for name, path in sorted(files.items())
    }
    tree = {"format": _FORMAT, "study": study, "files": listed}
    (work / _PACK_MANIFEST).write_text(json.dumps(tree, indent=1) + "\n", encoding="utf-8")
    members = {f"{study}/{name}": path for name, path in files.items()}
    write_zip(work / "pack", members | {_PACK_MANIFEST: work / _PACK_MANIFEST})
    return work / "pack"


class Pack:
    """A pack that is read: the zip holds what its manifest names, under names that may travel."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        """Judge names and sizes; ``ValueError`` says what is wrong, in a few words."""
        self._archive = archive
        with archive.open(_PACK_MANIFEST) as file:
            tree = json.loads(file.read(_MOST_BYTES))
        if tree["format"] != _FORMAT or not re.fullmatch(NAME, tree["study"]):
            raise ValueError(f"its {_PACK_MANIFEST} is none of ours")
        self.study: str = tree["study"]
        self.files = {name: str(file["sha256"]) for name, file in tree["files"].items()}
        """Hash of each file, by its path from the folder of the study."""
        self.runs: dict[str, list[str]] = {}
        """Files of each run or fill, by its place."""
        for name in self.files.keys() - {ROUNDS_FILE}:
            if not (place := place_of(name)):
                raise ValueError(f"{name[:200]!r} in it is no file of a run")
            self.runs.setdefault(place, []).append(name)
        named = {f"{self.study}/{name}": file["size"] for name, file in tree["files"].items()}
        held = {head.filename: head.file_size for head in archive.infolist()}
        held.pop(_PACK_MANIFEST)
        if odd := sorted(name for name, _ in held.items() ^ named.items()):
            raise ValueError(f"{odd[0][:200]!r} is not as its {_PACK_MANIFEST} says")

    def extract(self, names: Iterable[str], folder: Path) -> None:
        """Write files below a folder; ``ValueError`` where one is damaged."""
        for name in names:
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            with self._archive.open(f"{self.study}/{name}") as file, target.open("wb") as out:
                shutil.copyfileobj(file, out)
            if file_digest(target) != self.files[name]:
                raise ValueError(f"{name!r} does not match its hash")


@contextlib.contextmanager
def open_pack(path: Path) -> Iterator[Pack]:
    """Open a pack; what is wrong with it becomes one ``BadInputError``."""
    try:
        if path.exists() and not path.is_file():
            raise ValueError("it is no plain file")
        with zipfile.ZipFile(path) as archive:
            yield Pack(archive)
    except _BROKEN as error:
        valid = f"a whole pack of runs, as sandmould pack writes it: {error}"
        raise BadInputError([Problem("FILE", str(path), valid)]) from None
