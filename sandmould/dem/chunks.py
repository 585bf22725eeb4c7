"""Chunks: grains stored one after the other, which one thread computes.

A chunk writes to its own grains alone. What it puts on grains of later chunks goes to slots of its
own and is added by their chunk afterwards, in a fixed order: results do not depend on how threads
are scheduled, nor on their number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sandmould.arrays import Places
from sandmould.compiled import njit
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.neighbours import Pairs
from sandmould.dem.vectors import OPTIONS

CHUNK = 4096
"""Grains of a chunk."""


class Chunks(NamedTuple):
    """Parts of the grains that are computed side by side, and what crosses between them."""

    bound: Ints
    """(c + 1,) int64: first grain of each chunk."""
    first_slot: Ints
    """(c + 1,) int64: first slot of each chunk."""
    grain: Places
    """(q,) uint32: the grain of a later chunk that a slot belongs to."""
    incoming: Places
    """(q,) uint32: slots in the order of the chunks of their grains."""
    first_incoming: Ints
    """(c + 1,) int64: where the slots for each chunk begin in that order."""
    force: Floats
    """(q, d) float64, N."""
    moment: Floats
    """(q, s) float64, N m."""


def chunk_bounds(grains: int) -> Ints:
    """Split grains into chunks of about ``CHUNK``; how many depends on the scene alone.

    A chunk fits into a core's own cache, and few of its pairs cross to another. Their number is
    even, so that two threads share them evenly.
    """
    chunks = max(1, 2 * round(grains / (2 * CHUNK)))
    return np.linspace(0, grains, chunks + 1).astype(np.int64)


@njit(**OPTIONS)
def _crossing(bound: Ints, pairs: Pairs) -> tuple[Ints, Places]:
    first_slot = np.zeros(len(bound), dtype=np.int64)
    grain = np.empty(len(pairs.other), dtype=np.uint32)
    slots = 0
    for c in range(len(bound) - 1):
        end = bound[c + 1]
        for k in range(pairs.start[bound[c]], pairs.start[end]):
            if pairs.other[k] >= end:
                grain[slots] = pairs.other[k]
                slots += 1
        first_slot[c + 1] = slots
    return first_slot, grain[:slots].copy()


def split(grains: Grains, pairs: Pairs) -> Chunks:
    """Make the chunks of a list of pairs."""
    n, d = grains.position.shape
    bound = chunk_bounds(n)
    first_slot, grain = _crossing(bound, pairs)
    chunk = np.searchsorted(bound, grain, side="right") - 1
    incoming = np.argsort(chunk, kind="stable").astype(np.uint32)
    first_incoming = np.searchsorted(chunk[incoming], np.arange(len(bound)))
    force = np.zeros((len(grain), d))
    moment = np.zeros((len(grain), grains.spin.shape[1]))
    return Chunks(bound, first_slot, grain, incoming, first_incoming, force, moment)
