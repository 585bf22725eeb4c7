"""Displacements of the pattern's surface over time, in one file that only grows."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SHAPES = "pattern_shapes.f8"


class ShapesFile:
    """Rows of time and displacements; a resumed run cuts it back to its checkpoint."""

    def __init__(self, path: Path, rows: int, vertices: int, dimension: int) -> None:
        """Open the file for appending after its trusted rows.

        ``rows``: those that a checkpoint vouches for; 0 begins anew.
        """
        self.rows = rows
        path.touch()
        self._file: BinaryIO = path.open("r+b")
        end = 8 * rows * (1 + vertices * dimension)
        self._file.truncate(end)
        self._file.seek(end)

    def write(self, time_s: float, displacement_m: Array) -> None:
        """Append a row."""
        np.concatenate([[time_s], displacement_m.ravel()]).astype("<f8").tofile(self._file)
        self.rows += 1

    def flush(self) -> None:
        """Hand all rows to the system."""
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
