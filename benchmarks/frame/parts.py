"""Parts of a benchmark on disk: one that was stopped goes on from there."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from sandmould.digest import SHORT, digest
from sandmould.runs.files import write_text


class Parts:
    """Values by name, each in a file of its own as soon as it is there.

    Parameters
    ----------
    folder : Path
    origin : mapping, optional
        What the values depend on besides their names, such as machine and commit. A part of
        another origin is not seen.

    Attributes
    ----------
    restored_s : float, s
        What the parts took that were read back.
    """

    def __init__(self, folder: Path, origin: Mapping[str, Any] | None = None) -> None:
        self.folder = folder
        self._origin = json.dumps(origin or {}, sort_keys=True)
        self.restored_s = 0.0

    def path(self, name: str) -> Path:
        """File of a part."""
        key = digest(f"{self._origin}\n{name}")[:SHORT]
        return self.folder / f"{re.sub('[^a-z0-9]+', '_', name.lower())[:40]}_{key}.json"

    def get(self, name: str, measure: Callable[[], Any]) -> Any:
        """Read a part back, or measure and keep it; a damaged file is measured again.

        Parameters
        ----------
        name : str
        measure : callable
            Gives what JSON can hold.
        """
        path = self.path(name)
        try:
            stored = json.loads(path.read_text(encoding="utf-8"))
            self.restored_s += stored["took_s"]
        except (FileNotFoundError, json.JSONDecodeError):
            begun = time.perf_counter()
            value = measure()
            text = json.dumps({"took_s": time.perf_counter() - begun, "value": value})
            self.folder.mkdir(parents=True, exist_ok=True)
            write_text(path, text)
            stored = json.loads(text)
        return stored["value"]

    def remove(self) -> None:
        """Remove all parts of the folder, whatever their origin."""
        for path in self.folder.glob("*.json"):
            path.unlink()
