"""Curves that a certificate computed: other springs, and each amplitude held."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.frequency_law.series import FREQUENCY, FillCurve, fill_curve
from sandmould import ROOT
from sandmould.runs.columns import CONTROL, PART, SWEEP
from sandmould.statistics.config import SPRINGS
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

    @property
    def curves(self) -> list[FillCurve]:
        """One of the sweep, one of each case of the control, at the end of the vibration."""
        found = []
        for part, mine in self._runs.groupby(PART, sort=False):
            if mine[FREQUENCY].nunique() >= FEWEST:
                label = "" if part == SWEEP else str(part).removeprefix(CONTROL)
                found.append(fill_curve(self.name, label, mine, self._scenarios[str(part)]))
        return found
