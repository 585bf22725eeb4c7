"""Hashes of texts and files: what tells one state of a thing from another."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

SHORT = 12
"""Digits of a hash that names a state of some sources."""


def digest(*parts: str | bytes) -> str:
    """SHA-256 of texts or bytes joined, in hexadecimal digits."""
    joined = b"".join(part.encode() if isinstance(part, str) else part for part in parts)
    return hashlib.sha256(joined).hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 of a file.

    Raises
    ------
    OSError
        When it cannot be read.
    """
    return digest(path.read_bytes())


def sources_digest(paths: Iterable[Path], *parts: str) -> str:
    """Short hash of texts and, after them, of files in the order of their paths."""
    return digest(*parts, *(path.read_bytes() for path in sorted(paths)))[:SHORT]
