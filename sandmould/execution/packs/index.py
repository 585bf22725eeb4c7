"""What a pack of runs holds: its index, which is read and judged before anything else of it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, ValidationError

from sandmould.definition.run import FILLS, RUN_NAME
from sandmould.digest import digest
from sandmould.runs.manifest import DECK_FILE, MANIFEST_FILE
from sandmould.scenario.quantity import NAME, Section
from sandmould.study.rounds.round_log import ROUNDS_FILE

INDEX_FILE = "pack.json"
MOST_FILES = 1_000_000
MOST_BYTES = 500 * 10**9
MOST_FILE_BYTES = 8**11 - 1
"""More does not fit into the header of a tar archive."""
MOST_INDEX_BYTES = 2 * 10**8
OUTCOME_FILE = "outcome.json"
AT_END = ("scenario.yaml", DECK_FILE, OUTCOME_FILE, MANIFEST_FILE)
"""Files that every run has at its end."""
WORK = "work"
"""Folder of a run that is not at its end: its checkpoints and its tables so far."""
_NEVER = ("last_work", "lock")
_NAME_BYTES = 200


class PackedFile(Section):
    """One file of a pack."""

    size: Annotated[int, Field(ge=0, le=MOST_FILE_BYTES)]
    """In bytes."""
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class PackedRun(Section):
    """One run of a pack, or a fill that runs of it share."""

    at_end: bool
    """Or it is a checkpoint to go on from."""
    is_fill: bool = False
    scenario_sha256: Annotated[str, Field(max_length=64)] = ""
    template_sha256: Annotated[str, Field(max_length=64)] = ""
    """Both as the provenance has them; of a run at its end."""
    files: Annotated[dict[str, PackedFile], Field(min_length=1)]
    """By path from the run's folder."""

    @property
    def bytes(self) -> int:
        """Room that its files need."""
        return sum(file.size for file in self.files.values())

    def place(self, name: str) -> str:
        """Where it lies in the folder of its study."""
        return f"{FILLS if self.is_fill else 'runs'}/{name}"


class PackIndex(Section):
    """All that a pack holds, in the order in which it holds it."""

    format: Literal["sandmould pack 1"] = "sandmould pack 1"
    study: Annotated[str, Field(pattern=NAME, max_length=_NAME_BYTES)]
    rounds: PackedFile | None = None
    """The rounds of the study, where it has any."""
    runs: dict[Annotated[str, Field(pattern=f"^{RUN_NAME}$", max_length=_NAME_BYTES)], PackedRun]

    @property
    def bytes(self) -> int:
        """Room that all files need."""
        return sum(run.bytes for run in self.runs.values())

    @property
    def digest(self) -> str:
        """Hash of all that the pack holds."""
        return digest(index_text(self))

    def members(self) -> Iterator[Member]:
        """All files in order."""
        if self.rounds:
            yield Member("", "", ROUNDS_FILE, self.rounds)
        for name, run in self.runs.items():
            for path, file in run.files.items():
                yield Member(name, run.place(name), path, file)


class Member(NamedTuple):
    """A file with its place."""

    run: str
    """Empty for a file of the study."""
    place: str
    """Of the run in the folder of the study."""
    path: str
    file: PackedFile

    def name(self, study: str) -> str:
        """As the archive has it."""
        return "/".join(filter(None, (study, self.place, self.path)))


def index_text(index: PackIndex) -> str:
    """An index as JSON."""
    return json.dumps(index.model_dump(mode="json"), indent=1) + "\n"


def read_index(text: bytes) -> PackIndex:
    """Read an index that may come from anywhere.

    Raises
    ------
    ValueError
        With what is wrong with it, in a few words.
    """
    try:
        index = PackIndex.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        place = ".".join(str(part) for part in first["loc"])[:_NAME_BYTES]
        raise ValueError(f"its index is none of ours ({place!r}: {first['msg']})") from None
    number = sum(len(run.files) for run in index.runs.values())
    if number > MOST_FILES or index.bytes > MOST_BYTES:
        raise ValueError(f"it says that it holds {number} files of {index.bytes} bytes")
    for name, run in index.runs.items():
        if wrong := _wrong_files(run):
            raise ValueError(f"run {name} {wrong}")
    return index


def _wrong_files(run: PackedRun) -> str:
    """What keeps the files of a run from being put into its folder; empty where nothing does."""
    if run.at_end and (missing := [name for name in AT_END if name not in run.files]):
        return f"lacks {missing[0]}"
    folders = {str(above) for path in run.files for above in PurePosixPath(path).parents}
    for path in run.files:
        if not may_travel(path, run.at_end):
            return f"has a file of the name {path[:_NAME_BYTES]!r}"
        if path in folders:
            return f"has a file and a folder of the name {path!r}"
    return ""


def may_travel(path: str, at_end: bool) -> bool:
    """Whether a file of this path belongs into a run's folder: no way leads out of it."""
    parts = path.split("/")
    harmless = all(
        part.isprintable() and not part.startswith(".") and "\\" not in part
        and 0 < len(part.encode()) <= _NAME_BYTES
        for part in parts
    )  # fmt: skip
    if not harmless or path.endswith((".partial", "_again.txt")) or parts[0].startswith(_NEVER):
        return False
    return (
        (parts[0] != WORK and not re.match("checkpoints_of_", path))
        if at_end
        else (parts[0] == WORK and len(parts) > 1)
    )


def same_computation(run: PackedRun, origin: Mapping[str, object]) -> bool:
    """Whether a run of a pack is of the scenario, deck and solver that a provenance names."""
    return (run.scenario_sha256, run.template_sha256) == (
        origin.get("scenario_sha256"),
        origin.get("template_sha256"),
    )
