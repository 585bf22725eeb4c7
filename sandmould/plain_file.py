"""Files in whose place anything may lie: what is no plain file is refused, never waited for."""

from __future__ import annotations

import errno
import json
import stat
from pathlib import Path
from typing import Any

UNREADABLE = (OSError, ValueError, LookupError, TypeError, AttributeError)
"""What reading a broken file may raise, and making sense of what it holds."""


def read_plain(path: Path) -> str:
    """Text of a file, in UTF-8.

    Raises
    ------
    OSError
        When it cannot be read. A pipe or a device never can: reading it might not end.
    ValueError
        When it is not UTF-8.
    """
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "it is no plain file", str(path))
    return path.read_text(encoding="utf-8")


def read_json(path: Path) -> Any:
    """Values of a JSON file.

    Raises
    ------
    OSError, ValueError
        When it cannot be read, or is no JSON.
    """
    try:
        return json.loads(read_plain(path))
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
