"""Which setting of a study is best so far, from the measures of the runs as they end."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from sandmould.definition.study import Study
from sandmould.kinds.registry import kind_named
from sandmould.plain_file import UNREADABLE
from sandmould.runs.columns import RUN
from sandmould.runs.formatting import display_number, display_range, name_of, runs_text
from sandmould.statistics.agreement import sweep_part
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.settings import Setting, setting_rows
from sandmould.statistics.verdict import Verdict, compare_settings
from sandmould.study.collect import gather_runs, read_runs, swept_keys

_SHARE_OF_TIME = 0.02
"""Of a core, that judging may take: of thousands of runs it is done less often."""


class SoFar:
    """Reads each run once, when it has ended, and judges all that it has read."""

    def __init__(self, study: Study, study_folder: Path) -> None:
        """Begin with no run."""
        self._study = study
        self._folder = study_folder
        self._planned: pd.DataFrame | None = None
        self._settings = 0
        self._summary = pd.DataFrame()
        self._unread: list[str] = []
        self._said = ""
        self._judged = True
        self._next_s = 0.0

    def add(self, runs: Sequence[str]) -> None:
        """Note runs that have ended."""
        self._unread += runs

    def sentence(self) -> str:
        """What the runs say so far; empty before the first has a value."""
        begun = time.monotonic()
        if (self._unread or not self._judged) and begun >= self._next_s:
            # A table that cannot be read now is told by the report; the sentence stays as it was.
            with contextlib.suppress(*UNREADABLE):
                self._read()
                self._said = so_far_text(self._summary, self._study, self._settings)
                self._judged = True
            self._next_s = time.monotonic() + (time.monotonic() - begun) / _SHARE_OF_TIME
        return self._said

    def value_text(self, run: str) -> str:
        """The objective of a run that has ended, with its name; empty where it has none."""
        with contextlib.suppress(*UNREADABLE):
            self._read()
        measure = self._study.objective.measure
        if self._summary.empty:
            return ""
        values = usable_values(self._summary, measure)[self._summary[RUN] == run].dropna()
        if values.empty:
            return ""
        return f"{name_of(measure)} {display_number(measure, values.iloc[0])}"

    def _read(self) -> None:
        if not self._unread:
            return
        if self._planned is None:
            self._planned = read_runs(self._folder)
            swept = sweep_part(self._planned)
            self._settings = len(setting_rows(swept, swept_keys(swept)))
        rows = self._planned[self._planned[RUN].isin(self._unread)].reset_index(drop=True)
        self._unread, self._judged = [], False
        new = gather_runs(rows, self._folder, self._study.own_measures).summary
        parts = [part for part in (self._summary, new) if not part.empty]
        self._summary = pd.concat(parts, ignore_index=True) if parts else self._summary


def so_far_text(summary: pd.DataFrame, study: Study, settings: int) -> str:
    """What some of a study's runs say of its objective, in one sentence; empty without a value.

    ``settings``: how many are planned: before each has a value, none is called the best.
    """
    measure, better = study.objective.measure, study.objective.better
    swept = sweep_part(summary)
    if swept.empty:
        return ""
    keys = swept_keys(swept)
    verdict = compare_settings(swept, keys, measure, better)
    used = [setting for setting in verdict.settings if setting.n]
    if not used or verdict.best is None:
        return ""
    what, runs = name_of(measure), sum(setting.n for setting in used)
    if not study.seeks_best:
        low, high = (f(setting.mean for setting in used) for f in (min, max))
        between = display_range(measure, low, high) if low < high else display_number(measure, low)
        return f"{what} {between} by {runs_text(runs)}"
    if len(used) == 1:
        return f"{what} {_mean(verdict.best, measure)}; nothing to compare with yet"
    if not kind_named(study.kind).draws_by_lot:
        return _best(verdict, measure)
    resolved = verdict.resolved and len(used) == settings
    return f"{'resolved' if resolved else 'not resolved yet'}, {_best(verdict, measure)}"


def _best(verdict: Verdict, measure: str) -> str:
    best, second = verdict.best, verdict.runner_up
    assert best is not None
    assert second is not None
    where = f"{best.label} {_mean(best, measure)}"
    most = "highest" if verdict.better == "larger" else "lowest"
    then = f"{second.label} {_mean(second, measure)}"
    return f"{most} {name_of(measure)} at {where}, then {then}"


def _mean(setting: Setting, measure: str) -> str:
    return f"{display_number(measure, setting.mean)} ({runs_text(setting.n)})"
