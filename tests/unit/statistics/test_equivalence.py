"""Two one-sided t tests: intervals worked out by hand, and no agreement out of a wide spread."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from sandmould.statistics.equivalence import MOST_REPLICATES, POWER, agree, classify_interval

T_95_OF_2 = 2.919986
"""95 % point of Student's t with two degrees of freedom, as tables print it."""


def values(numbers: Sequence[float], first_block: int = 1) -> pd.Series:
    """Values of replicates that share their seeds by number."""
    blocks = [(r, 100 + r) for r in range(first_block, first_block + len(numbers))]
    return pd.Series(numbers, index=pd.Index(blocks, tupleize_cols=False))


FIRST = values([0.501, 0.622, 0.403])
SECOND = values([0.500, 0.620, 0.400])
"""Differences 0.001, 0.002, 0.003: mean 0.002, standard deviation 0.001."""
REACH = T_95_OF_2 * 0.001 / math.sqrt(3)


def test_interval_of_pairs_by_hand() -> None:
    found = agree(FIRST, SECOND, 0.005)
    assert found.paired
    assert found.n == 3
    assert found.difference == pytest.approx(0.002)
    assert found.means == pytest.approx((0.508667, 0.506667), abs=1e-6)
    assert found.ci == pytest.approx((0.002 - REACH, 0.002 + REACH), rel=1e-6)


def test_verdict_is_that_of_two_one_sided_tests() -> None:
    apart = FIRST - SECOND
    for margin in (0.0025, 0.0035, 0.0036, 0.0037, 0.004):
        above = stats.ttest_1samp(apart, -margin, alternative="greater").pvalue
        below = stats.ttest_1samp(apart, margin, alternative="less").pvalue
        both = max(above, below) < 0.05
        assert (agree(FIRST, SECOND, margin).verdict == "equivalent") == both
    assert agree(FIRST, SECOND, 0.0037).verdict == "equivalent"


def test_interval_wholly_outside_is_different_whichever_way() -> None:
    assert agree(FIRST, SECOND, 0.0003).verdict == "different"
    assert agree(SECOND, FIRST, 0.0003).verdict == "different"


def test_wide_spread_is_no_agreement_however_near_the_means() -> None:
    found = agree(values([0.4, 0.5, 0.6]), values([0.6, 0.5, 0.4]), 0.03)
    assert found.difference == pytest.approx(0.0)
    assert found.verdict == "not resolved"
    assert found.more is not None
    assert found.more > 100
    assert found.note == f"about {found.more} further runs of each would be needed"


def test_difference_that_is_seen_but_within_the_margin_is_equivalent() -> None:
    found = agree(FIRST, SECOND, 0.01)
    assert found.ci[0] > 0
    assert found.verdict == "equivalent"


def test_estimate_of_replicates_is_what_resolves_it() -> None:
    rng = np.random.default_rng(5)
    few = values((0.5 + 0.02 * np.array([-1.2, 0.3, 0.9])).tolist())
    found = agree(few, values([0.5, 0.5, 0.5]), 0.02)
    assert found.verdict == "not resolved"
    assert found.more is not None
    many = found.n + found.more
    spread = float((few - 0.5).std(ddof=1))
    tries = [
        agree(values(rng.normal(0.5, spread, many).tolist()), values([0.5] * many), 0.02).verdict
        for _ in range(400)
    ]
    assert tries.count("equivalent") / 400 == pytest.approx(POWER, abs=0.07)


def test_estimate_towards_a_difference_and_none_on_the_margin() -> None:
    # mean 0.02, margin 0.01: more replicates will show a difference
    found = agree(values([0.49, 0.52, 0.55]), values([0.5, 0.5, 0.5]), 0.01)
    assert found.verdict == "not resolved"
    assert found.more is not None
    on_margin = agree(values([0.49, 0.52, 0.55]), values([0.5, 0.5, 0.5]), 0.02)
    assert on_margin.more is None
    assert on_margin.note.startswith(f"more than {MOST_REPLICATES} further runs")


def test_only_common_replicates_are_paired() -> None:
    lacking = SECOND.iloc[:2]
    found = agree(FIRST, lacking, 0.005)
    assert found.paired
    assert found.n == 2
    assert found.difference == pytest.approx(0.0015)
    alone = agree(FIRST, SECOND.iloc[:1], 0.005)
    assert alone.verdict == "not tested"
    assert alone.note == "only one pair of finished runs"


def test_replicates_with_other_seeds_are_compared_by_welch() -> None:
    first, second = values([0.50, 0.52, 0.51, 0.53]), values([0.51, 0.53, 0.5], first_block=9)
    found = agree(first, second, 0.03)
    expected = stats.ttest_ind(first, second, equal_var=False).confidence_interval(0.9)
    assert not found.paired
    assert found.n == 3
    assert found.ci == pytest.approx(tuple(expected))
    assert found.verdict == "equivalent"


def test_same_values_in_every_pair_agree_exactly() -> None:
    found = agree(FIRST, FIRST, 0.005)
    assert found.verdict == "equivalent"
    assert found.ci == (0.0, 0.0)
    assert found.note == "the same to round-off in every pair"


def test_pairs_apart_by_the_same_amount_are_judged_by_it() -> None:
    assert agree(FIRST + 0.25, FIRST, 0.005).verdict == "different"


def test_replicates_that_do_not_differ_prove_nothing() -> None:
    found = agree(values([0.5, 0.5, 0.5]), values([0.5, 0.5, 0.5]), 0.005)
    assert found.verdict == "not tested"
    assert "check that the seed reaches the sand" in found.note


def test_nothing_on_one_side_is_not_tested() -> None:
    found = agree(FIRST, values([]), 0.005)
    assert found.verdict == "not tested"
    assert found.note == "no finished run on one side"
    assert math.isnan(found.difference)


@pytest.mark.parametrize(
    ("ci", "judged"),
    [
        ((-0.9, 0.9), "equivalent"),
        ((-1.0, 0.9), "not resolved"),
        ((0.5, 1.5), "not resolved"),
        ((-2.0, 2.0), "not resolved"),
        ((1.1, 1.5), "different"),
        ((-1.5, -1.1), "different"),
    ],
)
def test_interval_inside_outside_or_across(ci: tuple[float, float], judged: str) -> None:
    assert classify_interval(ci, 1.0) == judged
