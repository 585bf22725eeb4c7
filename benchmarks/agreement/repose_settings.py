"""The page on the cheapest settings that change no angle."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from benchmarks.agreement.recorded import Recorded, read_all
from benchmarks.frame import render
from sandmould.execution.records import RECORDS
from sandmould.runs.formatting import name_of, number
from sandmould.runs.outcome import Outcome
from sandmould.statistics.agreement import Compared, value_label
from sandmould.study.collect import read_summary

MEASURE = "heap_angle_deg"
STUDIES = (
    "repose_scale",
    "repose_small",
    "repose_time_step",
    "repose_stiffness",
    "repose_engines",
)
"""Studies that vary what should not matter."""


@dataclass(frozen=True)
class Level:
    """One value of a factor."""

    label: str
    runs: int
    mean: float
    sd: float
    cpu_s: float
    against: str
    """Whether it agrees with the dearest value, and the interval of that value minus this one."""
    agrees: bool


@dataclass(frozen=True)
class Factor:
    """What was varied, the dearest value first."""

    study: str
    title: str
    key: str
    levels: tuple[Level, ...]
    failed: int
    commit: str

    @property
    def dearest(self) -> Level:
        """The value that all are compared with."""
        return self.levels[0]

    @property
    def cheapest(self) -> Level | None:
        """The cheapest value that agrees with the dearest; None where only that does."""
        agree = [level for level in self.levels[1:] if level.agrees]
        return min(agree, key=lambda level: level.cpu_s, default=None)

    @property
    def saving(self) -> float:
        """How many times less the cheapest value costs."""
        return self.dearest.cpu_s / (self.cheapest or self.dearest).cpu_s


def factors_of(recorded: Recorded, summary: pd.DataFrame, keys: tuple[str, ...]) -> list[Factor]:
    """Factors of one study.

    Parameters
    ----------
    recorded : Recorded
    summary : DataFrame
        One row a run.
    keys : tuple of str
        Those that are compared.
    """
    finished = summary[summary["outcome_code"] == int(Outcome.FINISHED)]
    factors = []
    for key in keys:
        cost = finished.groupby(key, sort=False)["cpu_s"].mean().sort_values(ascending=False)
        dearest = value_label(key, cost.index[0])
        levels = []
        for value, cpu_s in cost.items():
            angle = finished.loc[finished[key] == value, MEASURE].dropna()
            label = value_label(key, value)
            compared = _pair(recorded.compared, key, dearest, label)
            against, agrees = "–", False
            if compared is not None:
                test = compared.agreement
                agrees = test.verdict == "equivalent"
                low, high = test.ci if compared.first == dearest else (-test.ci[1], -test.ci[0])
                against = f"{test.verdict}: {number(low, 2)} to {number(high, 2)}"
            levels.append(
                Level(label, len(angle), angle.mean(), angle.std(), cpu_s, against, agrees)
            )
        record = recorded.record
        factors.append(
            Factor(
                recorded.name,
                recorded.title,
                key,
                tuple(levels),
                len(summary) - len(finished),
                record["commit"],
            )
        )
    return factors


def _pair(compared: tuple[Compared, ...], key: str, first: str, second: str) -> Compared | None:
    return next(
        (
            c
            for c in compared
            if c.measure == MEASURE and c.key == key and {c.first, c.second} == {first, second}
        ),
        None,
    )


def page(records: Path = RECORDS) -> str:
    """Write the page from the committed results.

    Raises
    ------
    SystemExit
        Naming the studies that have no record yet.
    """
    factors: list[Factor] = []
    margins = set()
    for recorded in read_all(records, STUDIES):
        summary = read_summary(records / recorded.name)
        factors += factors_of(recorded, summary, recorded.keys)
        margins |= {c.agreement.margin for c in recorded.compared if c.measure == MEASURE}
    (margin,) = margins  # one sentence holds for all
    return render(Path(__file__).with_name("repose_settings.md.j2"), {
        "factors": factors, "margin": margin,
        "number": number, "name_of": name_of,
    })  # fmt: skip
