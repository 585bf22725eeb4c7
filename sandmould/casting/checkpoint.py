"""The checkpoint of a run of casting: one file, whole or not trusted."""

from __future__ import annotations

import hashlib
import io
import os
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

EVERY_S = 20.0
"""Wall time between checkpoints: what a killed run loses at most, beside one step or record."""
_DIGEST_BYTES = hashlib.sha256().digest_size


class Checkpoint:
    """Arrays of a run after the SHA-256 of their bytes, replaced as a whole."""

    def __init__(self, path: Path, computed_hash: str) -> None:
        """Keep a run at a path.

        Parameters
        ----------
        path : Path
        computed_hash : str
            Tells this run from one of another scenario or solver.
        """
        self._path, self._hash = path, computed_hash
        self._due_s = time.monotonic() + EVERY_S

    def newest(self) -> dict[str, Any] | None:
        """What an earlier process of the same run kept, as arrays; None where there is none.

        A file that is damaged or of another run is not used, and that is said on standard error.
        """
        if not self._path.exists():
            return None
        try:
            return self._read()
        except ValueError as error:
            print(
                f"checkpoint {self._path} cannot be used: {error}; the run begins again",
                file=sys.stderr,
            )
            return None

    def _read(self) -> dict[str, Any]:
        """Arrays of the file; a ValueError says why it is not trusted."""
        whole = self._path.read_bytes()
        digest, body = whole[:_DIGEST_BYTES], whole[_DIGEST_BYTES:]
        if hashlib.sha256(body).digest() != digest:
            raise ValueError("its bytes do not match their hash")
        with np.load(io.BytesIO(body)) as kept:
            arrays = dict(kept)
        if arrays.pop("computed_hash") != self._hash:
            raise ValueError("it is of another scenario or solver")
        return arrays

    def keep(self, arrays: Callable[[], Mapping[str, Any]]) -> None:
        """Write what the run is made of where it is due."""
        if time.monotonic() < self._due_s:
            return
        file = io.BytesIO()
        np.savez(file, computed_hash=self._hash, **arrays())
        body = file.getbuffer()
        partial = self._path.with_name(f"{self._path.name}.partial")
        with partial.open("wb") as out:
            out.write(hashlib.sha256(body).digest())
            out.write(body)
        os.replace(partial, self._path)
        self._due_s = time.monotonic() + EVERY_S
