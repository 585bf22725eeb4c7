"""The loop's own error, window by window: residual, balances of force and energy."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.pattern_fe.coupling.body import StaticSolution

Array = NDArray[np.float64]
CONVERGENCE_LOG = "pattern.tsv"


@dataclass(frozen=True)
class WindowEntry:
    """One window of the loop; a field is a column."""

    time_s: float
    window_s: float
    passes: int
    """Iterations: times that the window was computed."""
    factor: float
    """Relaxation factor of the next displacement."""
    gain: float
    """Last measured one; NaN in other schemes than the measured one."""
    residual_m: float
    """Root of the mean square over the vertices of the displacement that the loads give less the
    one at the interface."""
    displacement_m: float
    """The same of the displacement at the interface."""
    largest_m: float
    """Largest displacement of a vertex at the interface."""
    load_n: float
    """Size of the sand's mean force on the pattern."""
    imbalance_n: float
    """Size of the sum of that force and the reaction of the supports."""
    moment_left_n_m: float
    """Size of the moment of both about the origin; NaN where the pattern's solution lacks it."""
    work_j: float
    """Work of the sand on the interface since the run began."""
    energy_j: float
    """Elastic energy of the pattern at rest under the loads."""
    solve_s: float
    """Wall time of the pattern's participant."""
    contact_n: float
    """Size of the force of floor, walls and obstacles on the pattern."""
    contact_j: float
    """Work against these forces on the interface since the run began: none where the pattern
    rests on them, some where the interface comes after the solution that touches already."""


def rms_m(displacement_m: Array) -> float:
    """Root of the mean square length of vectors, (n, d) float64, m."""
    return float(np.sqrt((displacement_m**2).sum(axis=1).mean()))


def work_of(load_n: Array, moved_m: Array) -> float:
    """Work of the mean loads of a window on the way of the vertices in it, J.

    ``load_n``, ``moved_m``: (nv, d) float64, N and m.
    """
    return float((load_n * moved_m).sum())


def force_n(contact_n: Array | None) -> float:
    """Size of the sum of forces of contact, N."""
    return 0.0 if contact_n is None else float(np.linalg.norm(contact_n.sum(axis=0)))


def imbalance_n(load_n: Array, solution: StaticSolution) -> float:
    """Size of what loads and reaction leave, N."""
    return float(np.linalg.norm(load_n.sum(axis=0) + solution.reaction_n))


class ConvergenceLog:
    """Table of entries of one kind; a resumed run cuts it back to its checkpoint."""

    def __init__(
        self, path: Path, trusted_bytes: int | None = None, kind: type[Any] = WindowEntry
    ) -> None:
        """Open the table.

        ``trusted_bytes``: length of what a checkpoint vouches for; without it the table begins
        anew. ``kind``: frozen dataclass of the entries, a column a field.
        """
        header = "\t".join(field.name for field in fields(kind)) + "\n"
        if trusted_bytes is None:
            path.write_text(header, encoding="utf-8")
        self._file: TextIO = path.open("r+", encoding="utf-8")
        self._file.truncate(trusted_bytes or len(header))
        self._file.seek(trusted_bytes or len(header))

    def write(self, entry: Any) -> None:
        """Append a row."""
        row = (str(v) if isinstance(v, int) else f"{v:.9g}" for v in astuple(entry))
        self._file.write("\t".join(row) + "\n")

    def size(self) -> int:
        """Flush, and give the length in bytes."""
        self._file.flush()
        return self._file.tell()

    def close(self) -> None:
        """Close the table."""
        self._file.close()


def read_convergence_log(path: Path) -> pd.DataFrame:
    """All rows of a run; columns as the fields of what was written."""
    return pd.read_csv(path, sep="\t")
