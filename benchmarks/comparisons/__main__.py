"""Errors and power of the comparison of settings: ``python -m benchmarks.comparisons``.

How many studies rule out a setting that is as good as the best, and how many settings that are
worse are ruled out. It prints the tables of docs/explanation/statistics.md; nothing of it is
simulated. Last it prints how much fillings shift all settings in the records of tubes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks.frame import table
from sandmould.execution.records import RECORDS
from sandmould.module_main import run_main
from sandmould.statistics.agreement import sweep_part
from sandmould.statistics.contrasts import Spread
from sandmould.statistics.mean_tests import CONFIDENCE, MeanTest, compare_means
from sandmould.statistics.settings import by_block, group_settings
from sandmould.study.collect import read_summary, swept_keys

STUDIES = 2000
SIZES = ((2, 3), (4, 2), (4, 3), (4, 4), (4, 8), (6, 3), (12, 3), (12, 8))
ROUNDS = ((3, 3, 5, 5), (2, 2, 2, 2, 8, 8), (3, 3, 3, 3, 8, 8), (3, 3, 3, 3, 3, 3, 3, 3, 12, 12))
"""Replicates of the settings of a study after rounds, the planted best among the last."""
SHIFTS = (0.0, 0.4, 0.8)
"""Standard deviations of what a filling shifts in all settings, over that of a run."""
TUBES = (
    "tube_frequency",
    "tube_frequency_stroke",
    "tube_demo",
    "tube_certified",
    "tube_3d_frequency",
    "tube_law_hold",
    "tube_law_springs",
    "tube_law_depth",
    "tube_law_width",
)
"""Records of a tube in hard sand with two settings or more."""
MEASURE = "tube_fill_fraction"
BETTER_BY = 2.5
"""What the planted best is better by, in standard deviations of a run."""
Fills = Mapping[str, "pd.Series[float]"]
Judge = Callable[[Fills], list[MeanTest | None]]


def as_now(fills: Fills) -> list[MeanTest | None]:
    """The best setting against each other one, as the report compares them."""
    spread = Spread.of(fills)
    best = max(fills, key=spread.mean)
    return [spread.compare(best, other)[1] for other in fills if other != best]


def apart(fills: Fills) -> list[MeanTest | None]:
    """The same, each run for itself: what a filling shifts is not taken out."""
    return as_now(
        {
            label: pd.Series(v.to_numpy(), index=[f"{label} {i}" for i in v.index])
            for label, v in fills.items()
        }
    )


def in_pairs(fills: Fills) -> list[MeanTest | None]:
    """By Student's test of pairs."""
    best = max(fills, key=lambda label: float(fills[label].mean()))
    others = [fills[other] for other in fills if other != best]
    return [(compare_means(fills[best], other) or (None,))[0] for other in others]


def ruled_out(judge: Judge, fills: Fills, level: float) -> list[bool]:
    """Whether each setting but the best is ruled out."""
    intervals = [test.confidence_interval(level) for test in judge(fills) if test is not None]
    return [low > 0 or high < 0 for low, high in intervals]


def unlike(settings: int) -> NDArray[np.float64]:
    """Standard deviations that rise from one to three times over the settings, mean one."""
    sds = np.linspace(1.0, 3.0, settings)
    return sds / sds.mean()


def shares(
    judge: Judge, sds: NDArray[np.float64], replicates: Sequence[int], best: int, shift: float = 0.0
) -> tuple[float, float]:
    """Studies of equal settings with one ruled out, and worse settings that are ruled out."""
    rng = np.random.default_rng(1)
    # Bonferroni's factor for the other settings of pairs; Tukey's test needs none.
    level = 1.0 - (1.0 - CONFIDENCE) / (len(sds) - 1) if judge is in_pairs else CONFIDENCE
    wrong, rightly = 0, []
    for _ in range(STUDIES):
        noise = sds[:, None] * rng.standard_normal((len(sds), max(replicates)))
        noise += shift * rng.standard_normal(max(replicates))
        equal = {str(i): pd.Series(noise[i, :n]) for i, n in enumerate(replicates)}
        wrong += any(ruled_out(judge, equal, level))
        equal[str(best)] += BETTER_BY
        rightly += ruled_out(judge, equal, level)
    return wrong / STUDIES, float(np.mean(rightly))


def filling_shift(name: str) -> float:
    """Standard deviation of what a filling shifts in a record, over that of a run within it."""
    summary = sweep_part(read_summary(RECORDS / name))
    groups = group_settings(summary, list(swept_keys(summary)))
    spread = Spread.of({str(i): by_block(r, r[MEASURE]) for i, (_, r) in enumerate(groups)})
    return spread.contrasts.block_sd / spread.contrasts.sd


def _percent(*judged: tuple[float, float]) -> list[str]:
    return [f"{100 * share:.0f} %" for pair in judged for share in pair]


def main() -> None:
    """Plant, compare, print."""
    rows = []
    for settings, replicates in SIZES:
        for name, sds in (("alike", np.ones(settings)), ("1 to 3", unlike(settings))):
            of = sds, [replicates] * settings, settings // 2
            judged = _percent(shares(as_now, *of), shares(in_pairs, *of))
            rows.append([str(settings), str(replicates), name, *judged])
    told = ["wrongly ruled out", "rightly ruled out"]
    pairs = ["in pairs: wrongly", "in pairs: rightly"]
    print(table(["settings", "replicates", "spreads", *told, *pairs], rows))
    rows = []
    for numbers in ROUNDS:
        for shift in SHIFTS:
            all_of = np.ones(len(numbers)), numbers, len(numbers) - 1, shift
            judged = _percent(shares(as_now, *all_of), shares(apart, *all_of))
            rows.append([", ".join(map(str, numbers)), f"{shift:g}", *judged])
    alone = ["not taken out: wrongly", "not taken out: rightly"]
    print(table(["replicates", "shift of a filling", *told, *alone], rows))
    print(table(["record", "shift"], [[name, f"{filling_shift(name):.2f}"] for name in TUBES]))


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.comparisons")
