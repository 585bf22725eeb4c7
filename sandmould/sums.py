"""Sums with the same last digit on every Python."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from functools import reduce


def added(numbers: Iterable[float]) -> float:
    """Numbers added one after the other: since Python 3.12 ``sum`` makes up for round-off."""
    return reduce(operator.add, numbers, 0.0)
