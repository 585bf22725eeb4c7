"""The checkpoint of a run whose state is arrays: one file, whole or not trusted."""

from __future__ import annotations

import io
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.digest import digest
from sandmould.runs.files import replaced

INTERVAL_S = 20.0
"""Wall time between checkpoints: what a killed run loses at most, beside one step or record."""
_DIGEST_BYTES = 32


class CheckpointFile:
    """Arrays of a run after the SHA-256 of their bytes, replaced as a whole."""

    def __init__(self, path: Path, computed_hash: str) -> None:
        """Belong to a run.

        ``computed_hash``: tells this run from one of another scenario or solver.
        """
        self._path, self._hash = path, computed_hash
        self._due_s = time.monotonic() + INTERVAL_S

    def read(self) -> dict[str, Any] | None:
        """Arrays that an earlier process of the same run wrote; None where there are none.

        A file that is damaged or of another run is not used, and that is said on standard error.
        """
        if not self._path.exists():
            return None
        try:
            return self._arrays()
        except ValueError as error:
            print(
                f"checkpoint {self._path} cannot be used: {error}; the run begins again",
                file=sys.stderr,
            )
            return None

    def _arrays(self) -> dict[str, Any]:
        """Arrays of the file; a ValueError says why it is not trusted."""
        whole = self._path.read_bytes()
        body = whole[_DIGEST_BYTES:]
        if digest(body) != whole[:_DIGEST_BYTES].hex():
            raise ValueError("its bytes do not match their hash")
        with np.load(io.BytesIO(body), allow_pickle=False) as file:
            arrays = dict(file)
        if arrays.pop("computed_hash") != self._hash:
            raise ValueError("it is of another scenario or solver")
        return arrays

    def write_when_due(self, arrays: Callable[[], Mapping[str, Any]]) -> None:
        """Write what the run is made of once the interval has passed."""
        if time.monotonic() < self._due_s:
            return
        file = io.BytesIO()
        np.savez(file, computed_hash=self._hash, **arrays())
        body = file.getvalue()
        with replaced(self._path) as partial, partial.open("wb") as out:
            out.write(bytes.fromhex(digest(body)))
            out.write(body)
        self._due_s = time.monotonic() + INTERVAL_S
