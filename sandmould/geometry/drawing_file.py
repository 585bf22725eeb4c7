"""A file that draws a solid: its hash, and what is wrong with it.

Apart from what reads such a file: that takes longer to import than most studies to plan.
"""

from __future__ import annotations

import stat
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sandmould.digest import file_digest
from sandmould.limits import DRAWING_BYTES

STEP_SUFFIXES = (".step", ".stp")
TOLD_UNIT = (*STEP_SUFFIXES, ".3mf")
"""Endings of files that tell their own unit: they are read in metres."""

LARGEST = 1e30
"""Coordinates from here on are no drawing, and their squares no numbers."""


class MeshFileError(ValueError):
    """A file that bounds no solid; its text says what would be valid."""


def is_step(path: Path) -> bool:
    """Whether a file's name says that it is a STEP file."""
    return path.suffix.lower() in STEP_SUFFIXES


def tells_unit(path: Path) -> bool:
    """Whether a file's name says that it tells its own unit."""
    return path.suffix.lower() in TOLD_UNIT


def check_numbers(values: NDArray[np.float64], what: str) -> None:
    """Refuse rows of coordinates that are nowhere.

    Raises
    ------
    MeshFileError
    """
    nowhere = ~(np.abs(values.reshape(len(values), -1)) < LARGEST).all(axis=1)
    if nowhere.any():
        place = f"{what} {int(nowhere.argmax()) + 1} of {len(values)} has another"
        raise MeshFileError(f"vertices that are finite numbers below {LARGEST:g}; {place}")


def file_hash(path: Path) -> str:
    """SHA-256 of a file.

    Raises
    ------
    MeshFileError
        When it cannot be read, or is a folder, a device or too large.
    """
    try:
        what = path.stat()
        if not stat.S_ISREG(what.st_mode):
            raise MeshFileError("a file; here is a folder or a device")
        if what.st_size > DRAWING_BYTES.most:
            raise MeshFileError(f"a file {DRAWING_BYTES.sentence(what.st_size)}")
        return file_digest(path)
    except OSError as error:
        reason = error.strerror or "it cannot be read"
        raise MeshFileError(f"a readable file ({reason})") from error
