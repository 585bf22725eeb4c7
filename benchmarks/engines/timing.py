"""How the speed measurements take time: side by side in rounds, medians of ratios."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import quantile_test


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    rounds: int = 9
    block_s: float = 0.5
    """Length of one timed block."""
    discs: tuple[int, ...] = (2_500, 20_000)
    spheres: int = 8_000
    thread_discs: int = 64_000
    tile: int = 10_000
    """Discs of the bed that larger ones are copied from."""
    scale_discs: tuple[int, ...] = (10_000, 30_000, 100_000, 300_000, 1_000_000)
    scale_spheres: tuple[int, ...] = (8_000, 32_000, 96_000, 304_000)
    fractions: tuple[float, ...] = (0.05, 0.1, 0.2, 0.4, 0.8)
    """Time steps over the critical one."""
    far_bytes: int = 1_500_000_000
    """Arrays of the bandwidth of memory: beyond all caches."""


QUICK = Extent(
    rounds=2,
    block_s=0.05,
    discs=(300, 600),
    spheres=300,
    thread_discs=10_000,
    tile=600,
    scale_discs=(600, 6_000),
    scale_spheres=(300, 3_000),
    fractions=(0.1, 0.8),
    far_bytes=30_000_000,
)
"""Enough to see that everything works; the numbers mean nothing."""


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this thread, and the processes it starts meanwhile, on one core."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def seconds(work: Callable[[], object]) -> float:
    """Wall time of a call."""
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def steps_lasting(advance: Callable[[int], object], block_s: float) -> int:
    """How many steps take so long; the steps tried on the way are the warm-up."""
    steps, took = 2, 0.0
    while took < 0.3 * block_s:
        steps *= 2
        begun = time.perf_counter()
        advance(steps)
        took = time.perf_counter() - begun
    return max(4, round(steps * block_s / took))


def interleaved(blocks: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """Measure A B C, A B C, ...: what slows the machine for a while slows all of them."""
    values: dict[str, list[float]] = {name: [] for name in blocks}
    for _ in range(rounds):
        for name, block in blocks.items():
            values[name].append(block())
    return values


def spread(values: Sequence[float]) -> dict[str, float]:
    """Median and range."""
    return {
        "median": float(np.median(values)),
        "least": float(np.min(values)),
        "most": float(np.max(values)),
    }


def ratio(over: Sequence[float], under: Sequence[float]) -> dict[str, float]:
    """Median and range of the ratios within each round."""
    return spread([a / b for a, b in zip(over, under, strict=True)])


def median_interval(values: Sequence[float]) -> dict[str, float]:
    """Median, and its 95 % interval by the ranks of the values: no shape of their spread is meant.

    Of fewer than six values neither end of such an interval is known: both are NaN.
    """
    # A pair; the type stubs of SciPy call it a float.
    interval: Any = quantile_test(values, p=0.5).confidence_interval(0.95)
    return {
        "median": float(np.median(values)),
        "low": float(interval.low),
        "high": float(interval.high),
    }
