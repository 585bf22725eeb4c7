"""Which settings of a study agree within its margins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import pandas as pd

from sandmould.runs.columns import (
    ENGINE,
    GRAIN_STEPS_PER_S,
    OUTCOME_CODE,
    PART,
    SWEEP,
    VERSION,
    WALL_S,
    finished,
)
from sandmould.runs.formatting import listed, number, setting_text, value_text
from sandmould.statistics.config import Equivalence
from sandmould.statistics.equivalence import Agreement, agree
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.settings import by_block, group_settings

COLUMNS = (
    "at", "key", "first", "second", "measure", "mean_first", "mean_second", "difference",
    "ci_low", "ci_high", "margin", "n", "paired", "verdict", "note",
)  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """Two settings that should agree, in one measure."""

    measure: str
    key: str
    """The key in which they differ."""
    first: str
    second: str
    at: str
    """What else is swept, at the values both have; empty where nothing is."""
    at_values: str
    """These values alone."""
    agreement: Agreement

    @property
    def pair(self) -> str:
        """The two settings in the order of their difference."""
        return f"{self.first} − {self.second}"

    def row(self) -> dict[str, Any]:
        """One row of ``agreement.tsv``."""
        agreement = self.agreement
        values = (
            self.at, self.key, self.first, self.second, self.measure, *agreement.means,
            agreement.difference, *agreement.ci, agreement.margin, agreement.n, agreement.paired,
            agreement.verdict, agreement.note,
        )  # fmt: skip
        return dict(zip(COLUMNS, values, strict=True))


def sweep_part(summary: pd.DataFrame) -> pd.DataFrame:
    """Runs of the sweep alone, without cross checks and controls."""
    return summary[summary[PART] == SWEEP] if PART in summary else summary


def compare_keys(
    summary: pd.DataFrame, keys: Sequence[str], equivalence: Equivalence
) -> tuple[Compared, ...]:
    """Compare all values of each key of the equivalence, at equal values of the others.

    Keys that are averaged over do not make comparisons of their own: their values only pair runs.
    """
    comparisons: tuple[Compared, ...] = ()
    for key in equivalence.keys:
        others = [k for k in keys if k != key]
        over = [k for k in others if k in equivalence.over]
        for rest, alike in group_settings(summary, [k for k in others if k not in over]):
            for (a, rows), (b, other_rows) in combinations(group_settings(alike, [key]), 2):
                pair = value_label(key, a[key]), value_label(key, b[key])
                comparisons += compare_pair(key, pair, rest, (rows, other_rows), equivalence, over)
    return tuple(sorted(comparisons, key=lambda c: list(equivalence.margins).index(c.measure)))


def value_label(key: str, value: Any) -> str:
    """A value by itself where it is a word, with what it is a value of where it is a number."""
    return value_text(key, value) if isinstance(value, str) else setting_text({key: value})


def compare_pair(
    key: str,
    pair: tuple[str, str],
    at: Mapping[str, Any],
    rows: tuple[pd.DataFrame, pd.DataFrame],
    equivalence: Equivalence,
    over: Sequence[str] = (),
) -> tuple[Compared, ...]:
    """One pair of settings in every measure that has a margin."""
    where = setting_text(at) if at else ""
    at_values = ", ".join(value_text(k, v) for k, v in at.items())
    comparisons = []
    for measure, margin in equivalence.margins.items():
        values = [usable_values(r, measure).dropna() for r in rows]
        first, second = (by_block(r, v, over) for r, v in zip(rows, values, strict=True))
        agreement = agree(first, second, margin)
        comparisons.append(Compared(measure, key, *pair, where, at_values, agreement))
    return tuple(comparisons)


def interval_text(agreement: Agreement) -> str:
    """An interval as a table shows it."""
    low, high = agreement.ci
    return "–" if low != low else f"{number(low, 2)} to {number(high, 2)}"


@dataclass(frozen=True)
class EngineSpeed:
    """What the finished runs of one engine cost."""

    engine: str
    version: str
    runs: int
    grain_steps_per_s: float
    """Median over the runs."""
    wall_s: float
    """Median over the runs."""


def speeds(summary: pd.DataFrame) -> tuple[EngineSpeed, ...]:
    """Speed of each engine that computed runs, the fastest first."""
    wanted = {ENGINE, VERSION, GRAIN_STEPS_PER_S, WALL_S, OUTCOME_CODE}
    if not wanted <= set(summary.columns):
        return ()
    complete = summary[finished(summary)]
    engine_speeds = [
        EngineSpeed(
            str(engine),
            listed([str(v) for v in dict.fromkeys(runs[VERSION])]),
            len(runs),
            float(runs[GRAIN_STEPS_PER_S].median()),
            float(runs[WALL_S].median()),
        )
        for engine, runs in complete.groupby(ENGINE)
    ]
    return tuple(sorted(engine_speeds, key=lambda s: -s.grain_steps_per_s))
