"""What a run left behind: where it comes from, what it cost, and each file with size and hash.

What is lost or cut short later is seen by the sizes, at every start; all else by the hashes.
"""

from __future__ import annotations

import json
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from sandmould.digest import digest, file_digest
from sandmould.plain_file import read_json
from sandmould.runs.files import write_text

MANIFEST_FILE = "products.json"
OUTCOME_FILE = "outcome.json"
DECK_FILE = "deck.in"
LEFT_OUT = "left_out"
"""Step of files that a pack of the run did without: they are not missed, but cannot be measured."""
MEASURED_BY = "measured_by"
"""What names the code that took the measures."""
HASHES = "sha256"
"""Of each file that a step left, and of the outcome."""
SEAL = "seal"
"""Hash of all else that is written down."""
Manifest = dict[str, dict[str, Any]]
Step = Literal["computed", "measured"]


def files_below(folder: Path, names: tuple[str, ...] | None = None) -> dict[str, int]:
    """Size of every file, in bytes, by its path from the folder.

    ``names``: files and folders that count; all unless given.
    """
    places = folder.iterdir() if names is None else (folder / name for name in names)
    return {
        file.relative_to(folder).as_posix(): file.stat().st_size
        for place in places
        for file in _files(place)
    }


def _files(place: Path) -> Iterator[Path]:
    if place.is_dir():
        yield from (path for path in place.rglob("*") if path.is_file())
    elif place.is_file():
        yield place


def write_manifest(
    folder: Path,
    step: Step,
    sizes: Mapping[str, int],
    origin: Mapping[str, Any] | None = None,
    cost: Mapping[str, Any] | None = None,
    code: str = "",
    outcome: str = "",
) -> None:
    """Write down what a step of a run left, with the hashes of the files.

    ``computed`` begins anew, with the hash of the deck that was computed; ``measured`` adds to it.

    ``origin``, ``cost``: provenance and cost row of what was computed; ``code``: state of the code
    that measured; ``outcome``: what the outcome's file will hold.
    """
    if step == "computed":
        deck = folder / DECK_FILE
        tree: Manifest = {"deck": {DECK_FILE: file_digest(deck)}} if deck.is_file() else {}
        stated = {"origin": origin, "cost": cost}
        tree |= {name: dict(values) for name, values in stated.items() if values is not None}
    else:
        known = read_manifest(folder) if (folder / MANIFEST_FILE).exists() else {}
        tree = known | {MEASURED_BY: {"code_sha256": code}}
    hashes = {OUTCOME_FILE: digest(outcome)} if outcome else {}
    hashes |= {name: file_digest(folder / name) for name in sizes}
    save_manifest(folder, {**tree, step: dict(sizes), HASHES: tree.get(HASHES, {}) | hashes})


def save_manifest(folder: Path, tree: Manifest) -> None:
    """Write what is written down of a run, and seal it."""
    sealed = tree | {SEAL: {MANIFEST_FILE: _seal_of(tree)}}
    write_text(folder / MANIFEST_FILE, json.dumps(sealed, indent=1) + "\n")


def _seal_of(tree: Manifest) -> str:
    rest = {name: part for name, part in tree.items() if name != SEAL}
    return digest(json.dumps(rest, sort_keys=True))


def read_manifest(folder: Path) -> Manifest:
    """Files of each step with their sizes, provenance and cost.

    Raises
    ------
    OSError, ValueError
        When it cannot be read.
    """
    tree = read_json(folder / MANIFEST_FILE)
    if not (isinstance(tree, dict) and all(isinstance(files, dict) for files in tree.values())):
        raise ValueError("no list of files by step")
    return tree


def deck_damage(folder: Path, manifest: Manifest) -> str:
    """Say that the deck is missing or was changed since it was computed; empty where it is not."""
    deck = folder / DECK_FILE
    if not deck.is_file():
        return f"{DECK_FILE} is missing"
    known = manifest.get("deck", {}).get(DECK_FILE)
    changed = known is not None and known != file_digest(deck)
    return f"{DECK_FILE} was changed by hand" if changed else ""


def damage(folder: Path, sizes: Mapping[str, Any]) -> str:
    """Say which file is missing or has another size; empty where all are as they were left.

    ``sizes``: bytes of each file, by its path from the folder.
    """
    for name, size in sizes.items():
        try:
            now = (folder / name).stat()
        except (OSError, ValueError):  # no file can have such a name
            return f"{name} is missing"
        if not stat.S_ISREG(now.st_mode):
            return f"{name} is no plain file"
        if now.st_size != size:
            return f"{name} has {now.st_size} of {size} bytes"
    return ""


def change(folder: Path, manifest: Manifest) -> str:
    """Say which file of a run without ``damage`` is another than it left; empty where none is."""
    if manifest.get(SEAL, {}).get(MANIFEST_FILE) != _seal_of(manifest):
        return f"{MANIFEST_FILE} is not as the run wrote it"
    for name in (OUTCOME_FILE, *listed_files(manifest)):
        try:
            now = file_digest(folder / name)
        except OSError as error:
            now = str(error)
        if now != manifest.get(HASHES, {}).get(name):
            return f"{name} is not as the run wrote it"
    return ""


def listed_files(manifest: Manifest) -> dict[str, Any]:
    """Size of each file that the steps of a run left."""
    return manifest.get("computed", {}) | manifest.get("measured", {})
