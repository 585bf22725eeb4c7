"""The verdict: what is planted is found, and no more is claimed than the runs carry."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from sandmould.statistics.contrasts import Spread
from sandmould.statistics.evidence import left_out_counts, one_way_runs
from sandmould.statistics.mean_tests import alike_pvalue, compare_means
from sandmould.statistics.verdict import compare_settings, further_replicates, rank_runs

KEY = "vibration.0.frequency_hz"
FILL = "tube_fill_fraction"


def table(values: Mapping[float, Sequence[float | None]]) -> pd.DataFrame:
    """A summary with one replicate a value; None is a run that failed."""
    return pd.DataFrame(
        [
            {
                "run": f"f{f:g}_r{r}",
                KEY: f,
                "replicate": r,
                "seed": 100 + r,
                "outcome_code": 0 if v is not None else 310,
                FILL: np.nan if v is None else v,
            }
            for f, row in values.items()
            for r, v in enumerate(row, start=1)
        ]
    )


WINNER = table({25: [0.30, 0.32, 0.31], 50: [0.60, 0.63, 0.61], 100: [0.40, 0.43, 0.395]})


def test_planted_winner_is_resolved() -> None:
    verdict = compare_settings(WINNER, [KEY], FILL)
    assert verdict.resolved
    assert verdict.best is not None
    assert verdict.runner_up is not None
    assert (verdict.best.label, verdict.runner_up.label) == ("50 Hz", "100 Hz")
    assert verdict.difference == pytest.approx(0.61333 - 0.40833, abs=1e-4)


def test_interval_by_hand() -> None:
    # Each replicate shifts all settings, so what it shifts drops out: residuals of the two-way
    # table of 3 settings and 3 replicates have (3 - 1)(3 - 1) degrees of freedom.
    verdict = compare_settings(WINNER, [KEY], FILL)
    fills = np.array([[0.30, 0.32, 0.31], [0.60, 0.63, 0.61], [0.40, 0.43, 0.395]])
    left = fills - fills.mean(axis=1)[:, None] - fills.mean(axis=0)[None, :] + fills.mean()
    shared = math.sqrt(float((left**2).sum()) / 4 * 2 / 3)
    own = float((fills[1] - fills[2]).std(ddof=1)) / math.sqrt(3)
    assert own < shared
    reach = stats.studentized_range.ppf(0.95, 3, 4) / math.sqrt(2) * shared
    apart = float((fills[1] - fills[2]).mean())
    assert verdict.ci == pytest.approx((apart - reach, apart + reach))
    assert verdict.p == pytest.approx(
        stats.studentized_range.sf(math.sqrt(2) * apart / shared, 3, 4), rel=1e-6
    )


def test_spread_that_replicates_share_is_taken_out() -> None:
    shared = [0.0, 0.2, 0.4]
    paired = table(
        {25: shared, 50: [v + d for v, d in zip(shared, (0.04, 0.05, 0.06), strict=True)]}
    )
    assert compare_settings(paired, [KEY], FILL).resolved
    unlike = paired.assign(seed=range(6))
    verdict = compare_settings(unlike, [KEY], FILL)
    assert not verdict.resolved


def test_settings_of_unlike_replicates_are_compared_by_the_spread_of_all() -> None:
    summary = table({25: [0.30, 0.32, 0.31, None], 50: [0.40, None, 0.45, 0.41]})
    verdict = compare_settings(summary, [KEY], FILL)
    expected = stats.ttest_ind([0.40, 0.45, 0.41], [0.30, 0.32, 0.31])
    assert verdict.p == pytest.approx(expected.pvalue)
    assert verdict.ci == pytest.approx(tuple(expected.confidence_interval(0.95)))


def test_tie_is_not_resolved() -> None:
    summary = table({25: [0.50, 0.53, 0.48], 50: [0.51, 0.50, 0.52], 100: [0.1, 0.2, 0.15]})
    verdict = compare_settings(summary, [KEY], FILL)
    assert not verdict.resolved
    assert [c.other for c in verdict.comparisons if not c.separated] == ["25 Hz"]
    assert verdict.ci[0] < 0 < verdict.ci[1]


def test_what_would_decide_is_told_where_two_settings_are_close() -> None:
    # Differences 0.1, 0.2 and 0.3: mean 0.2, standard deviation 0.1.
    verdict = compare_settings(table({25: [0.0, 0.0, 0.0], 50: [0.1, 0.2, 0.3]}), [KEY], FILL)
    half = float(stats.t.ppf(0.975, 2)) * 0.1 / math.sqrt(3)
    assert not verdict.resolved
    # The interval's half width is 0.248; four replicates would have 0.215, five 0.192.
    assert verdict.best is not None
    assert further_replicates(verdict.comparisons, verdict.best) == 2
    assert math.ceil(3 * (half / 0.2) ** 2) - 3 == 2


def test_noise_alone_is_seldom_resolved() -> None:
    rng = np.random.default_rng(3)
    tries = [
        compare_settings(
            table({f: rng.normal(0.5, 0.02, 4).tolist() for f in (25, 50, 75, 100)}), [KEY], FILL
        )
        for _ in range(80)
    ]
    assert sum(v.resolved for v in tries) <= 6


def test_single_replicates_are_not_resolved() -> None:
    verdict = compare_settings(table({25: [0.1], 50: [0.9]}), [KEY], FILL)
    assert not verdict.resolved
    assert verdict.best is not None
    assert math.isnan(verdict.best.sd)
    assert math.isnan(verdict.p)


def test_identical_replicates_are_no_replicates() -> None:
    verdict = compare_settings(table({25: [0.1, 0.1, 0.1], 50: [0.9, 0.9, 0.9]}), [KEY], FILL)
    assert not verdict.resolved


def test_setting_too_thin_to_test_does_not_block_but_is_told() -> None:
    summary = pd.concat([WINNER, table({75: [0.59]})], ignore_index=True)
    # its mean is the second highest: nothing is resolved against it
    assert not compare_settings(summary, [KEY], FILL).resolved
    low = pd.concat([WINNER, table({75: [0.2]})], ignore_index=True)
    verdict = compare_settings(low, [KEY], FILL)
    assert verdict.resolved


def test_all_failed() -> None:
    verdict = compare_settings(table({25: [None, None], 50: [None, None]}), [KEY], FILL)
    assert verdict.best is None
    assert not verdict.resolved
    assert rank_runs(table({25: [None]}), FILL) == {}


LOOPS = table({25: [0.30, 0.32, 0.31, 0.9], 50: [0.60, 0.63, 0.61, 0.62], 100: [0.95] * 4}).assign(
    pattern_loop=["holds"] * 3 + ["lags"] + ["one way"] + ["holds"] * 3
    + ["cycles", "diverged", "diverged", "lags"]
)  # fmt: skip


def test_runs_whose_loop_fails_enter_no_mean_and_no_recommendation() -> None:
    verdict = compare_settings(LOOPS, [KEY], FILL)
    assert verdict.best is not None
    assert verdict.best.label == "50 Hz"
    assert [(s.n, s.planned) for s in verdict.settings] == [(3, 4), (4, 4), (0, 4)]
    assert verdict.settings[0].mean == pytest.approx(0.31)
    assert left_out_counts(LOOPS, FILL) == {"lags": 2, "cycles": 1, "diverged": 2}
    assert one_way_runs(LOOPS) == 1
    assert "f100_r1" not in rank_runs(LOOPS, FILL).values()


def test_a_study_of_the_loop_itself_counts_runs_whose_loop_fails() -> None:
    summary = LOOPS.rename(columns={FILL: "pattern_residual_fraction"})
    verdict = compare_settings(summary, [KEY], "pattern_residual_fraction")
    assert [s.n for s in verdict.settings] == [4, 4, 4]


def test_finished_runs_without_a_value_are_not_called_unfinished() -> None:
    summary = table({25: [0.1, None], 50: [0.2, 0.3]})
    assert left_out_counts(summary, "pipe_fill_fraction") == {"did not finish": 1, "no value": 3}


def test_measure_that_no_run_has() -> None:
    assert compare_settings(WINNER, [KEY], "pipe_fill_fraction").best is None


def test_one_setting_has_nothing_to_compare_with() -> None:
    summary = table({50: [0.4, 0.41, 0.42]}).drop(columns=KEY)
    verdict = compare_settings(summary, [], FILL)
    assert verdict.settings[0].n == 3
    assert verdict.settings[0].ci_half_width == pytest.approx(
        stats.t.ppf(0.975, 2) * 0.01 / math.sqrt(3)
    )


def test_unlike_replicates_are_compared_within_them() -> None:
    # From the third filling on all fill more. 50 Hz is the better one in each that it has.
    fills = {
        25: [0.302, 0.299, 0.401, 0.400],
        50: [0.338, 0.341, 0.439, 0.442],
        75: [0.330, 0.331, 0.429, 0.430, 0.431, 0.430],
    }
    verdict = compare_settings(table(fills), [KEY], FILL)
    assert verdict.best is not None
    assert verdict.best.label == "50 Hz"
    assert verdict.best.mean < verdict.settings[2].mean
    assert verdict.difference == pytest.approx(0.01, abs=0.002)
    assert verdict.resolved


def test_smaller_can_be_better() -> None:
    verdict = compare_settings(WINNER, [KEY], FILL, "smaller")
    assert verdict.resolved
    assert verdict.best is not None
    assert verdict.best.label == "25 Hz"
    assert verdict.ci[1] < 0
    assert rank_runs(WINNER, FILL, "smaller") == {
        "best": "f25_r1", "median": "f100_r1", "worst": "f50_r2",
    }  # fmt: skip


def test_settings_of_several_keys_and_of_words() -> None:
    second = WINNER.assign(**{"vibration.0.hold": "velocity"})
    both = pd.concat([WINNER.assign(**{"vibration.0.hold": "acceleration"}), second])
    verdict = compare_settings(both.reset_index(drop=True), [KEY, "vibration.0.hold"], FILL)
    assert len(verdict.settings) == 6
    assert verdict.settings[0].label == "frequency 25 Hz, hold acceleration"
    assert not verdict.resolved


def test_runs_are_ranked() -> None:
    assert rank_runs(WINNER, FILL) == {"best": "f50_r2", "median": "f100_r1", "worst": "f25_r1"}
    assert rank_runs(table({25: [0.1]}), FILL) == {"best": "f25_r1"}
    assert rank_runs(table({25: [0.1, None, 0.2]}), FILL) == {"best": "f25_r3", "worst": "f25_r1"}


@pytest.mark.parametrize("in_blocks", [True, False])
def test_intervals_and_p_values_are_those_of_the_formulae(in_blocks: bool) -> None:
    """The spread from a least-squares fit of settings and replicates, on random tables."""
    rng = np.random.default_rng(11)
    for n, number in product((2, 3, 5), (2, 3, 4)):
        rows = {f: rng.normal(0.4 + 0.1 * rng.random(), 0.02, n) for f in range(25, 25 + number)}
        summary = table({f: row.tolist() for f, row in rows.items()})
        if not in_blocks:
            summary["seed"] = range(len(summary))
        in_setting = np.repeat(np.eye(number), n, axis=0)
        in_replicate = np.tile(np.eye(n), (number, 1))
        design = np.hstack([in_setting, in_replicate]) if in_blocks else in_setting
        fills = np.concatenate(list(rows.values()))
        fitted = design @ np.linalg.lstsq(design, fills)[0]
        df = len(fills) - np.linalg.matrix_rank(design)
        shared = math.sqrt(float(((fills - fitted) ** 2).sum()) / df * 2 / n)
        verdict = compare_settings(summary, [KEY], FILL)
        best = verdict.best
        assert best is not None
        x = rows[int(best.values[KEY])]
        for comparison in verdict.comparisons:
            (y,) = (v for f, v in rows.items() if f"{f} Hz" == comparison.other)
            own = math.sqrt((x - y).var(ddof=1) / n if in_blocks
                            else (x.var(ddof=1) + y.var(ddof=1)) / n)  # fmt: skip
            error, apart = max(shared, own), x.mean() - y.mean()
            reach = stats.studentized_range.ppf(0.95, number, df) / math.sqrt(2) * error
            p = stats.studentized_range.sf(math.sqrt(2) * apart / error, number, df)
            assert comparison.ci == pytest.approx((apart - reach, apart + reach), rel=1e-6)
            assert comparison.p == pytest.approx(p, rel=1e-5)


def test_one_constant_side_is_compared_with_the_other() -> None:
    summary = table({25: [0.3, 0.3, 0.3], 50: [0.6, 0.63, 0.62]})
    summary["seed"] = range(6)
    (comparison,) = compare_settings(summary, [KEY], FILL).comparisons
    error = np.std([0.6, 0.63, 0.62], ddof=1) / math.sqrt(3)
    reach = stats.t.ppf(0.975, 4) * error
    apart = (0.6 + 0.63 + 0.62) / 3 - 0.3
    assert comparison.ci == pytest.approx((apart - reach, apart + reach), rel=1e-9)


def test_calm_settings_do_not_lend_their_calm_to_others() -> None:
    # Ten empty tubes scatter by nothing. The two best scatter by 0.05 and are alike.
    calm = {f: [0.0, 0.001, 0.0] for f in range(10, 20)}
    verdict = compare_settings(table(calm | {50: [0.55, 0.45, 0.5], 60: [0.5, 0.6, 0.55]}), [KEY],
                               FILL)  # fmt: skip
    assert not verdict.resolved
    assert [c.other for c in verdict.comparisons if not c.separated] == ["50 Hz"]


def test_one_wild_setting_hides_no_difference_of_calm_ones() -> None:
    fills = {"20": [0.30, 0.31, 0.29, 0.32], "30": [0.50, 0.52, 0.51, 0.50], "90": [9, -5, 6, -8]}
    spread = Spread.of({label: pd.Series(values, dtype=float) for label, values in fills.items()})
    _, test = spread.compare("30", "20")
    assert test is not None
    assert test.pvalue < 0.01
    assert test.df < 4


def test_unlike_spreads_are_told_as_scipy_tells_them() -> None:
    drawn = np.random.default_rng(4)
    samples = [drawn.normal(0.0, sd, n) for sd, n in ((1.0, 4), (3.0, 6), (0.5, 3))]
    assert alike_pvalue(samples) == pytest.approx(stats.bartlett(*samples).pvalue, rel=1e-9)
    # one without scatter tells nothing
    assert alike_pvalue([*samples, np.zeros(4)]) == alike_pvalue(samples)
    assert alike_pvalue([np.zeros(4), samples[0]]) == 1.0


def test_three_replicates_of_six_settings_rule_some_out() -> None:
    # One setting is better by 2.5 standard deviations of a run. python -m benchmarks.comparisons
    # finds 0.31 of the others ruled out; tests in pairs with Bonferroni's factor rule out 0.10.
    rng = np.random.default_rng(5)
    ruled_out = []
    for _ in range(40):
        fills = {f: rng.normal(0.5, 0.02, 3) + 0.05 * (f == 50) for f in range(20, 80, 10)}
        summary = table({f: fill.tolist() for f, fill in fills.items()})
        ruled_out += [c.separated for c in compare_settings(summary, [KEY], FILL).comparisons]
    assert np.mean(ruled_out) > 0.2


@pytest.mark.parametrize("paired", [True, False])
def test_means_are_tested_as_scipy_tests_them(paired: bool) -> None:
    drawn = np.random.default_rng(0)
    first = pd.Series(drawn.normal(size=5))
    second = pd.Series(drawn.normal(1.0, 2.0, 5 if paired else 7))
    second.index += 0 if paired else 10
    test, is_paired = compare_means(first, second) or pytest.fail("not tested")
    known = stats.ttest_rel if paired else partial(stats.ttest_ind, equal_var=False)
    result = known(first, second)
    assert is_paired is paired
    assert (test.pvalue, test.df) == pytest.approx((result.pvalue, result.df))
    assert test.confidence_interval(0.9) == pytest.approx(result.confidence_interval(0.9))


def test_values_far_apart_are_compared_by_their_logarithms() -> None:
    energies_j = {5.0: (1.0, 1.2, 0.9), 10.0: (6.0, 7.5, 7.0), 20.0: (4e5, 6e5, 5e5)}
    summary = table(energies_j).rename(columns={FILL: "kinetic_j"})
    verdict = compare_settings(summary, [KEY], "kinetic_j")
    assert verdict.by_factor
    assert verdict.resolved
    mean = {at: np.exp(np.mean(np.log(own))) for at, own in energies_j.items()}
    factors = [c.difference for c in verdict.comparisons]
    assert factors == pytest.approx([mean[20.0] / mean[10.0], mean[20.0] / mean[5.0]])
    assert all(c.ci[0] < c.difference < c.ci[1] for c in verdict.comparisons)
    # a share, a value at zero and one run each are told as they are
    assert not compare_settings(table({5.0: (1e-4, 2e-4), 9.0: (0.5, 0.6)}), [KEY], FILL).is_wide
    for values in ({5.0: (0.0, 1.0), 9.0: (900.0, 990.0)}, {5.0: (1.0,), 9.0: (900.0,)}):
        of = table(values).rename(columns={FILL: "kinetic_j"})
        assert not compare_settings(of, [KEY], "kinetic_j").by_factor
