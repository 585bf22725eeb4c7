"""Which study file a folder of results belongs to, so that two of one name do not share it."""

from __future__ import annotations

import os
from pathlib import Path

from sandmould import SHIPPED
from sandmould.bad_input import BadInputError, Problem
from sandmould.plain_file import read_plain
from sandmould.runs.files import write_text

OWNER_FILE = "study_file.txt"
"""In the folder of a study's results: the study's file as seen from the working folder."""
_STUDIES = SHIPPED / "config" / "studies"
_SHIPPED_TEXT = "shipped study "


def owner_text(path: Path) -> str:
    """A study's file as its results name it.

    Seen from the working folder, so that both can be moved together; a shipped study is named
    without its place, which differs from installation to installation.
    """
    real = path.resolve()
    if real.parent == _STUDIES.resolve():
        return f"{_SHIPPED_TEXT}{real.stem}"
    return Path(os.path.relpath(real, Path.cwd().resolve())).as_posix()


def owner_of(folder: Path) -> str | None:
    """What the results of a study name as its file; None where they name none."""
    try:
        return read_plain(folder / OWNER_FILE).strip() or None
    except (OSError, ValueError):
        return None


def shipped_name(owner: str | None) -> str:
    """Name of the shipped study that results belong to; empty where it is none of them."""
    is_shipped = owner is not None and owner.startswith(_SHIPPED_TEXT)
    return owner.removeprefix(_SHIPPED_TEXT) if owner is not None and is_shipped else ""


def owner_path(folder: Path) -> Path | None:
    """The file that the results of a study name; None where it is not named or not there."""
    text = owner_of(folder)
    if text is None:
        return None
    name = text.removeprefix(_SHIPPED_TEXT)
    path = Path(name) if name == text else _STUDIES / f"{name}.yaml"
    return path if path.is_file() else None


def check_owner(path: Path, folder: Path) -> None:
    """Refuse results that belong to another study file of the same name, while that is there.

    Raises
    ------
    BadInputError
        With the file that they belong to.
    """
    owner, own = owner_path(folder), owner_text(path)
    if owner is not None and owner_text(owner) != own:
        valid = (
            f"a study file of another name, since {folder} belongs to {owner_text(owner)}; "
            f"sandmould plan {path} --adopt takes it over"
        )
        raise BadInputError([Problem("STUDY", own, valid)])


def write_owner(path: Path, folder: Path) -> None:
    """Let the results of a study belong to a file from now on."""
    text = owner_text(path)
    if owner_of(folder) != text:
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / OWNER_FILE, f"{text}\n")
