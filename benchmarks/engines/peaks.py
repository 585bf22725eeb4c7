"""What one core can do at best: bandwidth, multiply-add, division and square root."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.engines.timing import interleaved, seconds, spread

Floats = NDArray[np.float64]
_DEGREE = 16
_SMALL = 2_048
"""Numbers that fit into the first cache."""


@njit(fastmath=True)
def _triad(a: Floats, b: Floats, c: Floats, times: int) -> None:
    """STREAM's triad: two numbers read, one written."""
    for _ in range(times):
        for i in range(len(a)):
            a[i] = b[i] + 1.5 * c[i]


@njit(fastmath={"contract"})
def _scalar_multiply_add(s: float, t: float, times: int) -> float:
    """Twelve chains side by side, too many for any one to wait: 24 operations a time."""
    a = b = c = d = e = f = 1.0
    g = h = i = j = k = m = 0.5
    for _ in range(times):
        a, b, c, d = a * s + t, b * s + t, c * s + t, d * s + t
        e, f, g, h = e * s + t, f * s + t, g * s + t, h * s + t
        i, j, k, m = i * s + t, j * s + t, k * s + t, m * s + t
        s, t = t, s
    return a + b + c + d + e + f + g + h + i + j + k + m


@njit(fastmath={"contract"})
def _vector_multiply_add(x: Floats, y: Floats, s: float, times: int) -> None:
    """Polynomials by Horner's rule, a vector of them at a time: 2 x 16 operations a number."""
    for _ in range(times):
        for i in range(len(x)):
            v = x[i]
            p = v
            for _ in range(_DEGREE):
                p = p * v + s
            y[i] = p


@njit(error_model="numpy")
def _roots(x: Floats, times: int) -> float:
    """Square roots that do not wait for each other."""
    a = b = 0.0
    for _ in range(times):
        for i in range(0, len(x), 2):
            a += math.sqrt(x[i])
            b += math.sqrt(x[i + 1])
    return a + b


@njit(error_model="numpy")
def _quotients(x: Floats, times: int) -> float:
    """Divisions that do not wait for each other."""
    a = b = 0.0
    for _ in range(times):
        for i in range(0, len(x), 2):
            a += 1.0 / x[i]
            b += 1.0 / x[i + 1]
    return a + b


def bandwidth(total_bytes: int, rounds: int, block_s: float = 0.05) -> dict[str, float]:
    """GB/s of the triad over three arrays of so many bytes together, 24 bytes counted a number."""
    n = max(64, total_bytes // 24)
    a, b, c = np.zeros(n), np.ones(n), np.ones(n)
    _triad(a, b, c, 1)
    times = max(1, round(block_s / max(seconds(lambda: _triad(a, b, c, 1)), 1e-7)))
    times = max(1, round(times * block_s / seconds(lambda: _triad(a, b, c, times))))
    rates = [24e-9 * n * times / seconds(lambda: _triad(a, b, c, times)) for _ in range(rounds)]
    return spread(rates)


def vector_bits() -> int:
    """Width of the registers in which the compiled polynomials multiply and add."""
    code = "".join(_vector_multiply_add.inspect_asm().values())
    registers = set(re.findall(r"vfn?m(?:add|sub)\d+pd\s.*?%([xyz])mm", code))
    return max(({"x": 128, "y": 256, "z": 512}[letter] for letter in registers), default=64)


def measure_peaks(rounds: int, times: int) -> dict[str, Any]:
    """Peaks of this core, all in one process and in turns.

    Parameters
    ----------
    rounds : int
    times : int
        Passes over the small array in one block.
    """
    x, y = np.full(_SMALL, 1.25), np.zeros(_SMALL)
    numbers = times * _SMALL

    def block(work: Callable[[], object], operations: int) -> Callable[[], float]:
        work()
        return lambda: 1e9 * seconds(work) / operations

    blocks = {
        "scalar_ns_per_flop": block(lambda: _scalar_multiply_add(0.5, 0.25, numbers), 24 * numbers),
        "vector_ns_per_flop": block(
            lambda: _vector_multiply_add(x, y, 0.25, times), 2 * _DEGREE * numbers
        ),
        "ns_per_root": block(lambda: _roots(x, times), numbers),
        "ns_per_quotient": block(lambda: _quotients(x, times), numbers),
    }
    peaks = {name: spread(values) for name, values in interleaved(blocks, rounds).items()}
    return {**peaks, "vector_bits": vector_bits()}
