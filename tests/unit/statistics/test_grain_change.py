"""What coarser grains change, and what that foretells, beside known answers."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import scipy

from sandmould.runs.outcome import Outcome
from sandmould.statistics.grain_change import FORETOLD, GrainChange, grain_changes, order_of
from sandmould.statistics.grain_check import FACTOR

KEY, FILL, PART = "vibration.0.frequency_hz", "tube_fill_fraction", "control: grain_scale x1.5"


def test_the_interval_is_that_of_students_test() -> None:
    rng = np.random.default_rng(1)
    own, coarser = rng.normal(0.5, 0.03, 5), rng.normal(0.4, 0.03, 4)
    found = GrainChange({KEY: 50.0}, FILL, own, coarser)
    exact = scipy.stats.ttest_ind(coarser, own).confidence_interval(0.95)
    assert found.ci == pytest.approx((exact.low, exact.high))
    assert found.is_seen == (exact.high < 0.0 or exact.low > 0.0)


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
def test_intervals_hold_as_often_as_they_say(order: float) -> None:
    """A fill that falls with the size of grains to some power, seen through the noise of runs.

    4 000 studies: a share of 0.95 is met within 0.01 (three standard errors), and the band, which
    is made for all orders, holds at least as often as it says.
    """
    at_none, a_size, sd = 0.7, 0.1, 0.03
    coarse, own, fine = (at_none - a_size * s**order for s in (FACTOR, 1.0, 1.0 / FACTOR))
    rng = np.random.default_rng(2)
    inside, held = 0, 0
    studies = 4000
    for _ in range(studies):
        found = GrainChange({}, FILL, rng.normal(own, sd, 5), rng.normal(coarse, sd, 4))
        low, high = found.ci
        inside += low <= coarse - own <= high
        low, high = found.finer
        held += low <= fine <= high
    assert inside / studies == pytest.approx(0.95, abs=0.01)
    assert held / studies > FORETOLD


def test_a_largest_distance_is_not_foretold_below_nothing() -> None:
    own, coarse = np.array([1.0, 9.0, 2.0]), np.array([8.0, 20.0, 12.0])
    assert GrainChange({}, "pattern_distance_largest_m", own, coarse).finer[0] == 0.0
    assert GrainChange({}, "pattern_tip_deflection_m", own, coarse).finer[0] < 0.0


def test_settings_are_compared_with_their_own() -> None:
    rows = [
        {"run": f"{part}{hz}{n}", "replicate": n, "part": part, KEY: hz, "outcome": "finished",
         "outcome_code": int(Outcome.FINISHED), FILL: fill + 0.01 * n}
        for part, hz, fill in [("sweep", 25, 0.3), ("sweep", 50, 0.6), ("sweep", 100, 0.5),
                               (PART, 50, 0.5), (PART, 100, 0.2)]
        for n in (1, 2, 3)
    ]  # fmt: skip
    best, rival = grain_changes(pd.DataFrame(rows), [KEY], [FILL, "not_measured"], PART)
    assert (best.values, rival.values) == ({KEY: 50}, {KEY: 100})
    assert (best.change, rival.change) == pytest.approx((-0.1, -0.3))
    assert order_of(best, rival, "larger") == "same"
    assert order_of(rival, best, "larger") == "other"
    assert order_of(best, rival, "smaller") == "other"
    assert order_of(best, best, "larger") == ""
    assert not list(grain_changes(pd.DataFrame(rows[:9]), [KEY], [FILL], PART))
