"""Curves that a certificate computed: other springs, and each amplitude held."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from benchmarks.frequency_law.series import FREQUENCY, MEASURE, FillCurve, fill_curve
from sandmould import ROOT
from sandmould.execution.records import OVER_TIME, TIMES
from sandmould.runs.columns import CONTROL, PART, RUN, SWEEP, VIBRATION_TIME_S
from sandmould.statistics.control_case import SPRINGS
from sandmould.study.collect import read_summary
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.rounds.round_log import ROUNDS_FILE, RoundLog, log_of

OF_SPRINGS = f"{CONTROL}{SPRINGS} "
FEWEST = 5
"""Frequencies of a curve that the law is asked for."""


class RecordedCurves:
    """The curves of a recorded study: of its sweep, and of the control of the springs.

    Parameters
    ----------
    folder : Path
        Of its record.
    """

    def __init__(self, folder: Path) -> None:
        record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
        study = open_study(ROOT / record["study"])
        self.name = folder.name
        # Records may name their runs as an earlier version did, and rest on its defaults.
        kept = folder / ROUNDS_FILE
        log = log_of(kept.read_bytes()) if kept.is_file() else RoundLog("")
        planned = expand(study, log.runs, log.certified_hz)
        self._scenarios = {run.part: run.scenario for run in planned}
        runs = read_summary(folder)
        is_curve = (runs[PART] == SWEEP) | runs[PART].str.startswith(OF_SPRINGS)
        self._runs = runs[is_curve]
        kept = folder / OVER_TIME
        self._over_time = pd.read_csv(kept, sep="\t") if kept.is_file() else pd.DataFrame()
        if kept.is_file():
            # Snapshots of two frequencies lie a little apart.
            times_s = self._over_time[VIBRATION_TIME_S]
            self._over_time["moment"] = (TIMES * times_s / times_s.max()).round().astype(int)

    @property
    def curves(self) -> list[FillCurve]:
        """One of the sweep, one of each case of the control, at the end of the vibration."""
        return list(self._curves(self._runs))

    @property
    def moments(self) -> dict[int, float]:
        """Vibration time, s, by the moment at which the record has the fill; of old ones none."""
        if self._over_time.empty:
            return {}
        return dict(self._over_time.groupby("moment")[VIBRATION_TIME_S].mean())

    def at(self, moment: int) -> list[FillCurve]:
        """The same curves at a moment of the vibration."""
        mine = self._over_time[self._over_time["moment"] == moment]
        fills = mine.set_index(RUN)[MEASURE]
        return list(self._curves(self._runs.assign(**{MEASURE: self._runs[RUN].map(fills)})))

    def _curves(self, runs: pd.DataFrame) -> Iterator[FillCurve]:
        for part, mine in runs.groupby(PART, sort=False):
            if mine[FREQUENCY].nunique() >= FEWEST:
                label = "" if part == SWEEP else str(part).removeprefix(CONTROL)
                yield fill_curve(self.name, label, mine, self._scenarios[str(part)])
