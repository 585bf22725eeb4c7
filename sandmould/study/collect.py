"""Gather the runs of a study into two tables: one row a run, and one row a snapshot."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from sandmould.runs.files import replaced
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.scenario.reading import Origin, read_planned, validated
from sandmould.statistics.agreement import (
    Compared,
    agreement_table,
    compare_keys,
    compare_pair,
    sweep_part,
)
from sandmould.study.plan_files import STUDY_FILE
from sandmould.study.study import Study, study_model

NO_OUTCOME = "no outcome written"
_OUTCOME_COLUMNS = ("outcome_code", "outcome", "detail", "simulated_s", "planned_s")
_PARAMETER_FREE = ("run", "replicate", "seed", "part")
_CLOCK = ("time_s", "vibration_time_s", "stage")
# The summary has these of the run; those of the snapshot get a prefix there.
_OF_SNAPSHOT = (*_CLOCK, "grains", "largest_overlap_fraction")

T = TypeVar("T")


@dataclass(frozen=True)
class Collected:
    """What the runs of a study left behind."""

    summary: pd.DataFrame
    """One row a run: its parameters, outcome, measures at the objective's time, and cost."""
    curves: pd.DataFrame
    """One row a snapshot of every run: its parameters and all measures."""
    keys: tuple[str, ...]
    """The swept keys, in the order of ``runs.tsv``."""

    @property
    def of_sweep(self) -> Collected:
        """Without the runs that check a point of the sweep on another engine."""
        return replace(self, summary=sweep_part(self.summary))


def swept_keys(runs: pd.DataFrame) -> tuple[str, ...]:
    """Columns of ``runs.tsv`` that are swept parameters."""
    return tuple(str(c) for c in runs.columns if c not in _PARAMETER_FREE)


def collect(study_folder: Path) -> None:
    """Write the tables of a study beside ``runs.tsv``, each moved into place last.

    ``summary.tsv`` has a row a run, ``curves.tsv`` one a snapshot, ``agreement.tsv`` one a pair of
    settings and measure that the study compares.

    Raises
    ------
    OSError, ValueError
        When ``runs.tsv`` itself cannot be read; a broken run is told in its row instead.
    """
    study = read_study(study_folder)
    found = gather(study_folder, study.objective.at_vibration_s)
    agreement = agreement_table(compare_study(found.summary, found.keys, study))
    tables = {"summary": found.summary, "curves": found.curves, "agreement": agreement}
    for name, table in tables.items():
        with replaced(study_folder / f"{name}.tsv") as partial:
            table.to_csv(partial, sep="\t", index=False, na_rep="nan")


def compare_study(summary: pd.DataFrame, keys: Sequence[str], study: Study) -> tuple[Compared, ...]:
    """Compare all that a study wants compared.

    Parameters
    ----------
    summary : DataFrame
        One row a run; runs of the cross check have it in their column ``part``.
    keys : sequence of str
        Swept keys.
    study : Study

    Returns
    -------
    tuple of Compared
        Empty where the study compares nothing.
    """
    equivalence = study.equivalence
    swept = sweep_part(summary)
    found = compare_keys(swept, keys, equivalence)
    if study.cross_check is not None and "part" in summary:
        checked = summary[summary["part"] == "cross_check"]
        alike = swept
        for key, value in study.cross_check.at.items():
            alike = alike[alike[key] == value]
        engines = (study.scenario.engine.name, study.cross_check.engine)
        found += compare_pair(
            "engine.name", engines, study.cross_check.at, (alike, checked), equivalence
        )
    return found


def read_study(study_folder: Path) -> Study:
    """The study as planned, from its folder; one with the defaults where none was written."""
    path = study_folder / STUDY_FILE
    if not path.exists():
        return Study(title=study_folder.name.replace("_", " "))
    tree = read_planned(path, str(path))
    return validated(study_model(tree.get("kind", "sand")), tree, Origin({"": str(path)}))


def gather(study_folder: Path, at_vibration_s: float | None = None) -> Collected:
    """Read every run of a study; what is missing becomes NaN, what is broken is told in ``detail``.

    Parameters
    ----------
    study_folder : Path
        ``results/<study>`` with ``runs.tsv`` and ``runs/<run>/``.
    at_vibration_s : float, s, optional
        Time of vibration at which the measures of the summary are taken; the last snapshot of
        each run unless given.

    Returns
    -------
    Collected

    Raises
    ------
    OSError, ValueError
        When ``runs.tsv`` itself cannot be read.
    """
    runs = pd.read_csv(study_folder / "runs.tsv", sep="\t", dtype={"run": str})
    keys = swept_keys(runs)
    rows: list[dict[str, Any]] = []
    curves: list[pd.DataFrame] = []
    for planned in runs.to_dict("records"):
        folder = study_folder / "runs" / str(planned["run"])
        row, measures = _one_run(folder, at_vibration_s)
        rows.append({**{str(k): v for k, v in planned.items()}, **row})
        if len(measures):
            known = {k: planned[k] for k in ("run", *keys, "replicate") if k in planned}
            for place, (name, value) in enumerate(known.items()):
                measures.insert(place, name, value)
            curves.append(measures)
    columns = [*map(str, runs.columns), *_OUTCOME_COLUMNS]
    summary = pd.DataFrame(rows)
    summary = summary.reindex(columns=[*columns, *(c for c in summary if c not in columns)])
    curve_columns = [c for c in ("run", *keys, "replicate") if c in runs.columns]
    together = (
        pd.concat(curves, ignore_index=True)
        if curves
        else pd.DataFrame(columns=[*curve_columns, *_CLOCK])
    )
    return Collected(summary, together, keys)


def _one_run(folder: Path, at_vibration_s: float | None) -> tuple[dict[str, Any], pd.DataFrame]:
    """Row of the summary without the planned columns, and the measures of each snapshot."""
    broken: list[str] = []
    outcome = _read(folder / "outcome.json", RunOutcome.read, broken)
    cost = _read(folder / "cost.tsv", _table, broken)
    measures = _read(folder / "measures.tsv", _measures, broken)
    if measures is None:
        measures = pd.DataFrame()
    elif unread := int(measures["time_s"].isna().sum()):
        broken.append(f"{unread} snapshots cannot be read.")
    detail = [] if outcome is None else [outcome.detail]
    row: dict[str, Any] = {
        "outcome_code": np.nan if outcome is None else int(outcome.outcome),
        "outcome": NO_OUTCOME if outcome is None else outcome.outcome.label,
        "detail": " ".join(s for s in (*detail, *broken) if s),
        "simulated_s": np.nan if outcome is None else outcome.simulated_s,
        "planned_s": np.nan if outcome is None else outcome.planned_s,
    }
    costs = {} if cost is None or cost.empty else _named(cost.iloc[-1])
    finished = outcome is not None and outcome.outcome is Outcome.FINISHED
    taken = _at(measures, at_vibration_s, finished)
    if taken is not None:
        for name, value in _named(taken).items():
            row[f"measured_{name}" if name in _OF_SNAPSHOT else name] = value
    return {**row, **costs}, measures


def _named(row: pd.Series[Any]) -> dict[str, Any]:
    return {str(name): value for name, value in row.items()}


def _at(
    measures: pd.DataFrame, at_vibration_s: float | None, finished: bool
) -> pd.Series[Any] | None:
    """Row of the measures nearest a time of vibration, or at the end of a run that finished.

    None where the run never got there.

    A stage lasts whole periods and snapshots come at intervals, so half an interval either way
    counts as reached.
    """
    # a snapshot that could not be read has a row without a time
    measures = measures[measures["vibration_time_s"].notna()] if len(measures) else measures
    if measures.empty:
        return None
    if at_vibration_s is None:
        return measures.iloc[-1] if finished else None
    time_s = measures["vibration_time_s"].to_numpy(dtype=np.float64)
    shaken = time_s[time_s >= 0]
    if not len(shaken):
        return None
    interval_s = float(np.diff(shaken).max()) if len(shaken) > 1 else 0.0
    place = int(np.argmin(np.abs(time_s - at_vibration_s)))
    if abs(time_s[place] - at_vibration_s) > 0.5 * interval_s + 1e-9:
        return None
    return measures.iloc[place]


def _table(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, sep="\t")


def _measures(path: Path) -> pd.DataFrame:
    """Measures in order of time, checked to carry their clock."""
    table = _table(path)
    missing = [c for c in _CLOCK if c not in table.columns]
    if missing:
        raise ValueError(f"no column {', '.join(missing)}")
    for name in ("time_s", "vibration_time_s"):
        table[name] = pd.to_numeric(table[name])
    return table.sort_values("time_s", ignore_index=True)


def _read(path: Path, reader: Callable[[Path], T], broken: list[str]) -> T | None:
    """What a file holds, or None; a file that is there and unreadable is named in ``broken``."""
    if not path.exists():
        return None
    try:
        return reader(path)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        broken.append(f"{path.name} cannot be read ({type(error).__name__}: {_line(error)}).")
        return None


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def read_provenance(folder: Path) -> dict[str, Any]:
    """Provenance of one run; empty where it was not written or cannot be read."""
    try:
        values = json.loads((folder / "provenance.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return values if isinstance(values, dict) else {}
