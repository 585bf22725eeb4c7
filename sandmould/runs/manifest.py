"""What a run left behind: where it comes from, what it cost, and each file with its size.

What is lost or cut short later is seen by the sizes.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from sandmould.digest import file_digest
from sandmould.runs.files import write_text

MANIFEST_FILE = "products.json"
DECK_FILE = "deck.in"
LEFT_OUT = "left_out"
"""Step of files that a pack of the run did without: they are not missed, but cannot be measured."""
MEASURED_BY = "measured_by"
"""What names the code that took the measures."""
OLDER_ORIGIN, OLDER_COST = "provenance.json", "cost.tsv"
"""What runs of older times have beside it."""
Manifest = dict[str, dict[str, Any]]
Step = Literal["computed", "measured"]


def files_below(folder: Path, names: tuple[str, ...] | None = None) -> dict[str, int]:
    """Size of every file, in bytes, by its path from the folder.

    Parameters
    ----------
    folder : Path
    names : tuple of str, optional
        Files and folders that count; all unless given.
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
) -> None:
    """Write down what a step of a run left.

    ``computed`` begins anew, with the hash of the deck that was computed; ``measured`` adds to it.

    Parameters
    ----------
    folder : Path
    step : str
    sizes : mapping of str to int
        Bytes of each file.
    origin : mapping, optional
        Provenance of what was computed.
    cost : mapping, optional
        Its cost row.
    code : str, optional
        State of the code that measured.
    """
    if step == "computed":
        deck = folder / DECK_FILE
        tree: Manifest = {"deck": {DECK_FILE: file_digest(deck)}} if deck.is_file() else {}
        stated = {"origin": origin, "cost": cost}
        tree |= {name: dict(values) for name, values in stated.items() if values is not None}
    else:
        tree = (read_manifest(folder) or {}) | {MEASURED_BY: {"code_sha256": code}}
    write_text(folder / MANIFEST_FILE, json.dumps({**tree, step: sizes}, indent=1) + "\n")


def read_manifest(folder: Path) -> Manifest | None:
    """Files of each step with their sizes; None for a run of a time that wrote none.

    Raises
    ------
    OSError, ValueError
        When it cannot be read.
    """
    try:
        tree = json.loads((folder / MANIFEST_FILE).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    if not (isinstance(tree, dict) and all(isinstance(files, dict) for files in tree.values())):
        raise ValueError("no list of files by step")
    return tree


def read_origin(folder: Path) -> dict[str, Any]:
    """Provenance of a run; older ones have a file for it alone.

    Raises
    ------
    OSError, ValueError
        When it cannot be read.
    """
    manifest = read_manifest(folder)
    if manifest is not None and "origin" in manifest:
        return manifest["origin"]
    if manifest is None and not (folder / OLDER_ORIGIN).exists():
        raise FileNotFoundError(f"{MANIFEST_FILE} is missing")
    origin: dict[str, Any] = json.loads((folder / OLDER_ORIGIN).read_text(encoding="utf-8"))
    return origin


def read_cost(folder: Path) -> dict[str, Any]:
    """Cost row of a run; empty for one that has none, or has it in a table of its own.

    Raises
    ------
    OSError, ValueError
        When it cannot be read.
    """
    return (read_manifest(folder) or {}).get("cost", {})


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

    Parameters
    ----------
    folder : Path
    sizes : mapping of str to int
        Bytes of each file, by its path from the folder.
    """
    for name, size in sizes.items():
        try:
            now = (folder / name).stat().st_size
        except (OSError, ValueError):  # no file can have such a name
            return f"{name} is missing"
        if now != size:
            return f"{name} has {now} of {size} bytes"
    return ""
