"""LIGGGHTS's binary dump of all grains, every number exact."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from sandmould.geometry.geometry import Array

_HEADER = struct.Struct("=qq7i6dii")
"""Step, rows, triclinic, six kinds of boundary, six bounds, columns, processors."""


def read_grains(path: Path) -> Array:
    """Read a binary dump of one instant, written by one process.

    Gives (n, columns) float64; sorted by the first column, the ids.

    Raises
    ------
    ValueError
        When the file is cut short.
    """
    data = path.read_bytes()
    if len(data) < _HEADER.size + 4:
        raise ValueError(f"{path}: cut short")
    header = _HEADER.unpack_from(data)
    rows, columns = header[1], header[-2]
    values = np.frombuffer(data, dtype=np.float64, offset=_HEADER.size + 4)
    if columns < 1 or values.size != rows * columns:
        raise ValueError(f"{path}: {values.size} numbers instead of {rows} x {columns}")
    table = values.reshape(rows, columns)
    return table[np.argsort(table[:, 0])]
