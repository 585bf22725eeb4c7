"""Errors and power of the comparison of settings: ``python -m benchmarks.comparisons``.

How many studies rule out a setting that is as good as the best, and how many settings that are
worse are ruled out. It prints the table of docs/explanation/statistics.md; nothing of it is
simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks.frame import table
from sandmould.scenario.module_main import run_main
from sandmould.statistics.settings import CONFIDENCE, MeanTest, Spread, compare_means

STUDIES = 2000
SIZES = ((2, 3), (4, 2), (4, 3), (4, 4), (4, 8), (6, 3), (12, 3), (12, 8))
BETTER_BY = 2.5
"""What the planted best is better by, in standard deviations of a run."""
Fills = NDArray[np.float64]
Judge = Callable[[Sequence["pd.Series[float]"], int], list[MeanTest | None]]


def as_now(fills: Sequence[pd.Series[float]], best: int) -> list[MeanTest | None]:
    """Each other setting against the best, as the report compares them."""
    spread = Spread.of(fills)
    return [spread.test(fills[best], other) for other in _others(fills, best)]


def in_pairs(fills: Sequence[pd.Series[float]], best: int) -> list[MeanTest | None]:
    """The same by Student's test of pairs."""
    return [(compare_means(fills[best], other) or (None,))[0] for other in _others(fills, best)]


def _others(fills: Sequence[pd.Series[float]], best: int) -> list[pd.Series[float]]:
    return [row for place, row in enumerate(fills) if place != best]


def ruled_out(judge: Judge, fills: Fills, level: float) -> list[bool]:
    """Whether each setting but the best is ruled out."""
    tests = judge([pd.Series(row) for row in fills], int(fills.mean(axis=1).argmax()))
    intervals = [test.confidence_interval(level) for test in tests if test is not None]
    return [low > 0 or high < 0 for low, high in intervals]


def spreads(settings: int) -> dict[str, Fills]:
    """Standard deviations of the settings' runs, mean one."""
    unlike = np.linspace(1.0, 3.0, settings)
    return {"alike": np.ones(settings), "1 to 3": unlike / unlike.mean()}


def shares(judge: Judge, sds: Fills, replicates: int) -> tuple[float, float]:
    """Studies of equal settings with one ruled out, and worse settings that are ruled out."""
    rng = np.random.default_rng(1)
    # Bonferroni's factor for the other settings; Tukey's test needs none.
    level = CONFIDENCE if judge is as_now else 1.0 - (1.0 - CONFIDENCE) / (len(sds) - 1)
    wrong, rightly = 0, []
    planted = np.zeros((len(sds), 1))
    planted[len(sds) // 2] = BETTER_BY
    for _ in range(STUDIES):
        noise = sds[:, None] * rng.standard_normal((len(sds), replicates))
        wrong += any(ruled_out(judge, noise, level))
        rightly += ruled_out(judge, planted + noise, level)
    return wrong / STUDIES, float(np.mean(rightly))


def main() -> None:
    """Plant, compare, print."""
    rows = []
    for settings, replicates in SIZES:
        for name, sds in spreads(settings).items():
            now, pairs = (shares(judge, sds, replicates) for judge in (as_now, in_pairs))
            rows.append(
                [
                    str(settings),
                    str(replicates),
                    name,
                    *(f"{100 * x:.0f} %" for x in (*now, *pairs)),
                ]
            )
    head = ["settings", "replicates", "spreads", "wrongly ruled out", "rightly ruled out",
            "in pairs: wrongly", "in pairs: rightly"]  # fmt: skip
    print(table(head, rows))


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.comparisons")
