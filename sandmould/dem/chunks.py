"""Chunks: grains stored one after the other, which one thread computes.

A chunk writes to its own grains alone: results do not depend on how threads are scheduled, nor on
their number.
"""

from __future__ import annotations

import numpy as np

from sandmould.dem.grains import Ints

CHUNK = 4096
"""Grains of a chunk."""


def chunk_bounds(grains: int) -> Ints:
    """Split grains into chunks of about ``CHUNK``; how many depends on the scene alone.

    Their number is even, so that two threads share them evenly.

    Gives (c + 1,) int64; first grain of each chunk.
    """
    chunks = max(1, 2 * round(grains / (2 * CHUNK)))
    return np.linspace(0, grains, chunks + 1).astype(np.int64)
