"""The loop's own error, window by window: residual, balances of force and energy."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pattern_fe.coupling.body import Answer

Array = NDArray[np.float64]
LEDGER = "pattern.tsv"


@dataclass(frozen=True)
class Entry:
    """One window of the loop."""

    time_s: float
    window_s: float
    passes: int
    """Times that the window was computed."""
    factor: float
    """Share of the residual that is gone next."""
    gain: float
    """Last measured one; none but in the measured scheme."""
    residual_m: float
    """Root of the mean square over the vertices of answered less shown displacement."""
    displacement_m: float
    """The same of the displacement that the sand saw."""
    largest_m: float
    """Largest displacement of a vertex that the sand saw."""
    load_n: float
    """Size of the sand's mean force on the pattern."""
    imbalance_n: float
    """Size of the sum of that force and the reaction of the supports."""
    moment_left_n_m: float
    """Size of the moment of both about the origin; none of a body that does not tell."""
    work_j: float
    """Work of the sand on the surface that it saw, since the run began."""
    energy_j: float
    """Elastic energy of the pattern as it answered."""
    solve_s: float
    """Wall time of the pattern's part."""


def rms_m(displacement_m: Array) -> float:
    """Root of the mean square length of vectors, (n, d) float64, m."""
    return float(np.sqrt((displacement_m**2).sum(axis=1).mean()))


def work_of(load_n: Array, moved_m: Array) -> float:
    """Work of the mean loads of a window on the way of the vertices in it, J.

    Parameters
    ----------
    load_n, moved_m : (nv, d) float64, N and m
    """
    return float((load_n * moved_m).sum())


def imbalance_n(load_n: Array, answer: Answer) -> float:
    """Size of what loads and reaction leave, N."""
    return float(np.linalg.norm(load_n.sum(axis=0) + answer.reaction_n))


class Ledger:
    """Table of rows of one kind; a resumed run cuts it back to its checkpoint."""

    def __init__(
        self, path: Path, trusted_bytes: int | None = None, kind: type[Any] = Entry
    ) -> None:
        """Open the table.

        Parameters
        ----------
        path : Path
        trusted_bytes : int, optional
            Length of what a checkpoint vouches for; none begins anew.
        kind : type
            Frozen dataclass of the rows, a column a field.
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


def read_ledger(path: Path) -> pd.DataFrame:
    """All rows of a run; columns as the fields of what was written."""
    return pd.read_csv(path, sep="\t")
