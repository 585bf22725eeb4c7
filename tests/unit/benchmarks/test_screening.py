"""A screen of properties, on planted fills."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
import pytest

from benchmarks.frequency_law.screening import PROPERTIES, STUDIES, effects_of, told
from benchmarks.frequency_law.series import FREQUENCY, MEASURE
from sandmould import ROOT
from sandmould.definition.sweep import Point
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

COLUMN_HZ = 171.0
FREQUENCIES_HZ = (15, 26, 44, 75, 130, 220)
WALLS, LONGER, GRAINS = (list(PROPERTIES)[n] for n in (3, 5, 4))


def levels() -> list[tuple[int, ...]]:
    """Of the shipped study: a 2^(7-3) design of resolution IV."""
    return [
        (a, b, c, d, a ^ b ^ c, b ^ c ^ d, a ^ c ^ d)
        for a, b, c, d in itertools.product((0, 1), repeat=4)
    ]


def planted(noise: float) -> pd.DataFrame:
    """Wall friction lowers the high end by 0.1, a longer shake moves the top an octave down."""
    rng, rows = np.random.default_rng(3), []
    for level in levels():
        scene = dict(zip(PROPERTIES, level, strict=True))
        top_hz = 60.0 / 2 ** scene[LONGER]
        for replicate, hz in itertools.product((1, 2, 3, 4), FREQUENCIES_HZ):
            fill = 0.6 - 0.05 * np.log2(hz / top_hz) ** 2
            fill -= 0.1 * scene[WALLS] * (hz == FREQUENCIES_HZ[-1])
            row: Point = {**scene, "replicate": replicate, FREQUENCY: hz}
            rows.append({**row, MEASURE: fill + noise * rng.normal()})
    return pd.DataFrame(rows)


def test_planted_effects_are_found_with_their_place() -> None:
    found = effects_of(planted(0.01), COLUMN_HZ)
    walls, longer = PROPERTIES[WALLS], PROPERTIES[LONGER]
    assert found["high"].effects[walls] == pytest.approx(0.1, abs=found["high"].half_width)
    assert set(told(found["high"])) == {walls, longer}
    assert told(found["low"]) == [longer]
    assert found["place"].effects[longer] == pytest.approx(-1.0, abs=0.1)
    assert told(found["place"]) == [longer]
    assert found["low"].effects[PROPERTIES[GRAINS]] == pytest.approx(0.0, abs=0.02)


def test_the_top_of_chance_alone_is_not_above_the_ends() -> None:
    flat = planted(0.0).assign(**{MEASURE: np.random.default_rng(5).normal(0.5, 0.05, 384)})
    found = effects_of(flat, COLUMN_HZ)
    # two means of 64 fillings of 0.05: their difference is known to 0.009
    assert abs(found["low"].mean) < 0.02
    assert abs(found["high"].mean) < 0.02


@pytest.mark.parametrize("study", STUDIES)
def test_the_shipped_study_is_that_design(study: str) -> None:
    runs = expand(open_study(ROOT / "config" / "studies" / f"{study}.yaml"))
    first = runs[0].parameters
    found = {tuple(int(run.parameters[p] != first[p]) for p in PROPERTIES) for run in runs}
    assert found == set(levels())
