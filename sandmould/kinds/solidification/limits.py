"""Castings that need too many cells or records."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sandmould.bad_input import Problem
from sandmould.limits import CELLS, RECORDS
from sandmould.scenario.casting.solidification import Solidification


def limit_problems(scenario: Solidification) -> Iterator[Problem]:
    """List what a casting asks too much of, by its sizes and times alone."""
    sides_m = np.subtract(scenario.box.high_m, scenario.box.low_m)
    cells = math.prod((sides_m / scenario.element_m).tolist())
    yield from CELLS.problems("element_m", cells, scenario.element_m)
    records = scenario.until_s / scenario.record_s
    yield from RECORDS.problems("record_s", records, scenario.record_s)
