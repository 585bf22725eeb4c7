"""Castings that need too many cells or records, or elements that their exchange refuses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from sandmould.casting.arpm import scene
from sandmould.casting.arpm.kernel import kernel_exchange
from sandmould.scenario.bad_input import Problem
from sandmould.scenario.limits import CELLS, RECORDS
from sandmould.scenario.solidification import Solidification


def limit_problems(scenario: Solidification) -> Iterator[Problem]:
    """List what a casting asks too much of, by its sizes and times alone."""
    sides_m = np.subtract(scenario.box.high_m, scenario.box.low_m)
    cells = math.prod((sides_m / scenario.element_m).tolist())
    yield from CELLS.problems("element_m", cells, scenario.element_m)
    records = scenario.until_s / scenario.record_s
    yield from RECORDS.problems("record_s", records, scenario.record_s)


def exchange_problems(scenario: Solidification) -> Iterator[Problem]:
    """Tell elements of several sizes that a kernel refuses, which the run would end by."""
    if scenario.exchange in scene.KERNEL_FORMS and scenario.layers and scenario.refuse_ratio:
        # what alike runs differ in otherwise is nothing to a kernel
        alike = scenario.model_copy(update={"seed": 1, "probes": (), "record_s": 1.0})
        if fault := _fault(alike):
            valid = f"ones that the kernel takes, or refuse_ratio: false ({fault})"
            yield Problem("layers", list(scenario.layers), valid)


@lru_cache(maxsize=8)
def _fault(scenario: Solidification) -> str:
    """Why a kernel refuses elements; nothing where it takes them."""
    elements, filling = scene.elements_of(scenario), scene.filling_of(scenario)
    try:
        kernel_exchange(elements, filling.conductivity_w_m_k, 0.0, scenario.kernel_size)
    except ValueError as error:
        return str(error)
    return ""
