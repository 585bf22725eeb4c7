"""Differences within blocks: those of a least-squares fit, and where blocks are left out."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from sandmould.statistics.contrasts import Contrasts, Spread
from sandmould.statistics.mean_tests import compare_means


def fills(
    blocks: dict[str, list[int]], shift: NDArray[np.float64] | None = None, seed: int = 1
) -> dict[str, pd.Series[float]]:
    """Values of settings in their blocks, each block with its shift."""
    rng = np.random.default_rng(seed)
    return {
        label: pd.Series(
            i + (0.0 if shift is None else shift[at]) + 0.1 * rng.normal(size=len(at)), index=at
        )
        for i, (label, at) in enumerate(blocks.items())
    }


AFTER_ROUNDS = {"a": [0, 1, 2], "b": [0, 1, 2, 3, 4, 5], "c": [1, 2, 3, 4, 5, 6], "d": [0, 2]}


@pytest.mark.parametrize("shift_sd", [0.1, 100.0])
def test_differences_and_their_errors_are_those_of_generalized_least_squares(
    shift_sd: float,
) -> None:
    values = fills(AFTER_ROUNDS, shift_sd * np.array([-1.0, 0.3, 1.2, 0.8, -0.4, -0.6, 0.1]))
    place = np.concatenate([np.full(len(v), i) for i, v in enumerate(values.values())])
    block = np.concatenate([v.index for v in values.values()])
    value = np.concatenate(list(values.values()))
    of_setting, of_block = np.eye(4)[place], np.eye(7)[block]
    both = np.hstack([of_setting, of_block])

    def squares(design: NDArray[np.float64]) -> float:
        return float(((value - design @ np.linalg.lstsq(design, value)[0]) ** 2).sum())

    df = len(value) - np.linalg.matrix_rank(both)
    variance = squares(both) / df
    # Henderson's third: what blocks explain after the settings, against what it is expected to be.
    rest = np.eye(len(value)) - of_setting @ np.linalg.pinv(of_setting)
    rank = np.linalg.matrix_rank(both) - 4
    shifts = (squares(of_setting) - squares(both) - rank * variance) / np.trace(
        of_block.T @ rest @ of_block
    )
    assert shifts > 0.0
    weight = np.linalg.inv(variance * np.eye(len(value)) + shifts * of_block @ of_block.T)
    covariance = np.linalg.inv(of_setting.T @ weight @ of_setting)
    means = covariance @ (of_setting.T @ weight @ value)
    spread = Spread.of(values)
    assert spread.in_blocks
    assert (spread.contrasts.df, spread.contrasts.sd) == pytest.approx((df, math.sqrt(variance)))
    for first, second in (("a", "b"), ("d", "c")):
        weights = np.eye(4)["abcd".index(first)] - np.eye(4)["abcd".index(second)]
        difference, test = spread.compare(first, second)
        assert test is not None
        assert difference == pytest.approx(weights @ means, abs=1e-6)
        assert spread.mean(first) - spread.mean(second) == pytest.approx(difference, abs=1e-6)
        x, y = values[first], values[second]
        shared = x.index.intersection(y.index)
        own = (x - y).loc[shared].std() / math.sqrt(2.0)
        scale = math.sqrt(weights @ covariance @ weights / variance)
        assert test.error == pytest.approx(scale * max(math.sqrt(variance), own), rel=1e-4)


def test_fillings_that_shift_nothing_leave_the_plain_means() -> None:
    # Residuals of the settings whose sum over each filling is zero.
    values = {
        label: pd.Series(i + 0.1 * np.array([1.0, -1.0, 0.5]) * sign, index=[0, 1, 2])
        for i, (label, sign) in enumerate({"a": 1.0, "b": -1.0, "c": 0.0}.items())
    }
    values["b"][3] = values["b"].mean()
    spread = Spread.of(values)
    assert spread.in_blocks
    assert spread.compare("b", "a")[0] == pytest.approx(values["b"].mean() - values["a"].mean())


@pytest.mark.parametrize(
    ("blocks", "why"),
    [
        ({"a": [0, 1, 2], "b": [3, 4, 5]}, "no block in common"),
        ({"a": [0, 1], "b": [0, 1], "c": [2, 3], "d": [2, 3]}, "two groups that nothing links"),
        ({"a": [0, 1], "b": [0, 1], "c": list(range(12))}, "11 of 13 degrees of freedom taken"),
    ],
)
def test_blocks_that_do_not_help_are_left_out(blocks: dict[str, list[int]], why: str) -> None:
    values = fills(blocks)
    spread = Spread.of(values)
    assert not spread.in_blocks, why
    assert spread.contrasts.df == sum(len(v) - 1 for v in values.values())
    assert spread.mean("b") == pytest.approx(values["b"].mean())
    difference, test = spread.compare("b", "a")
    welch = compare_means(values["b"], values["a"])
    assert test is not None
    assert difference == pytest.approx(values["b"].mean() - values["a"].mean())
    plain = spread.contrasts.sd * math.sqrt(1 / len(values["b"]) + 1 / len(values["a"]))
    assert welch is not None
    assert test.error == pytest.approx(max(plain, welch[0].error))


def test_settings_that_nothing_links_have_no_difference() -> None:
    setting, block = np.array([0, 0, 1, 1, 2, 2]), np.array([0, 1, 0, 1, 2, 3])
    contrasts = Contrasts(setting, block, np.arange(6.0))
    assert not contrasts.are_linked
    assert contrasts.difference(1, 0)[0] == pytest.approx(2.0)
    assert all(math.isnan(x) for x in contrasts.difference(2, 0))


def test_rounds_tell_more_where_fillings_shift_all_settings() -> None:
    # One setting is better by 2.5 standard deviations of a run, and a filling shifts all by 0.8.
    # python -m benchmarks.comparisons finds how many of the others are ruled out.
    rng = np.random.default_rng(3)
    ruled_out: dict[bool, list[bool]] = {True: [], False: []}
    for _ in range(40):
        shift = 0.8 * rng.normal(size=8)
        values = {
            f"{i}": pd.Series(2.5 * (i == 5) + shift[:n] + rng.normal(size=n), index=range(n))
            for i, n in enumerate((3, 3, 3, 3, 8, 8))
        }
        for within in (True, False):
            used = values if within else {
                label: v.set_axis([f"{label} {i}" for i in v.index]) for label, v in values.items()
            }  # fmt: skip
            spread = Spread.of(used)
            assert spread.in_blocks is within
            tests = [spread.compare("5", other)[1] for other in values if other != "5"]
            ruled_out[within] += [t.confidence_interval(0.95)[0] > 0 for t in tests if t]
    assert np.mean(ruled_out[True]) > np.mean(ruled_out[False]) + 0.1
