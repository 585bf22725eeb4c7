"""Chunks: grains stored one after the other, which one thread computes.

A chunk writes to its own grains alone. What it puts on grains of later chunks goes to slots of its
own and is added by their chunk afterwards, in a fixed order: results do not depend on how threads
are scheduled, nor on their number.
"""

from __future__ import annotations

import numpy as np

from sandmould.compiled import njit
from sandmould.dem.grains import Ints
from sandmould.dem.neighbours import Pairs
from sandmould.dem.vectors import OPTIONS

CHUNK = 4096
"""Grains of a chunk."""


def chunk_bounds(grains: int) -> Ints:
    """Split grains into chunks of about ``CHUNK``; how many depends on the scene alone.

    A chunk fits into a core's own cache, and few of its pairs cross to another. Their number is
    even, so that two threads share them evenly.

    Returns
    -------
    (c + 1,) int64
        First grain of each chunk.
    """
    chunks = max(1, 2 * round(grains / (2 * CHUNK)))
    return np.linspace(0, grains, chunks + 1).astype(np.int64)


@njit(**OPTIONS)
def chunk_of(bound: Ints, grain: int) -> int:
    """Chunk of a grain."""
    c = grain * (len(bound) - 1) // bound[-1]
    while bound[c + 1] <= grain:
        c += 1
    while bound[c] > grain:
        c -= 1
    return c


@njit(**OPTIONS)
def farthest_chunk(bound: Ints, pairs: Pairs) -> int:
    """How many chunks later the second grain of a pair lies at most."""
    farthest = 0
    for c in range(len(bound) - 1):
        last = bound[c]
        for k in range(pairs.start[bound[c]], pairs.start[bound[c + 1]]):
            last = max(last, np.int64(pairs.other[k]))
        if last > bound[c]:
            farthest = max(farthest, chunk_of(bound, last) - c)
    return farthest
