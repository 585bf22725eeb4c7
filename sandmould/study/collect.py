"""Gather the runs of a study into two tables: one row a run, and one row a snapshot.

On disk each table holds the sweep alone, so that whoever groups it by a swept key compares like
with like. The runs that check the sweep, on another engine or as controls, lie beside it in tables
of their own, ``summary_checks.tsv`` and ``curves_checks.tsv``.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

from sandmould.definition.own_measures import with_own_measures
from sandmould.definition.run import FILLS
from sandmould.definition.study import Study
from sandmould.kinds.registry import DEFAULT_KIND, kind_named
from sandmould.plain_file import UNREADABLE
from sandmould.runs.columns import (
    CLOCK,
    CPU_S,
    CROSS_CHECK,
    CROSS_CHECK_OWN,
    DETAIL,
    ENGINE,
    FILL,
    FILL_CPU_S,
    FILL_WALL_S,
    GRAINS,
    LARGEST_OVERLAP_FRACTION,
    OUTCOME,
    OUTCOME_CODE,
    PART,
    PLANNED_S,
    REPLICATE,
    RUN,
    SEED,
    SIMULATED_S,
    SWEEP,
    TIME_S,
    VIBRATION_TIME_S,
    WALL_S,
    finished,
)
from sandmould.runs.files import replaced
from sandmould.runs.manifest import read_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import PLACE, RunTables, problem_text, read_costs, read_tables
from sandmould.scenario.reading import Origin, read_planned, validated
from sandmould.statistics.agreement import COLUMNS, Compared, compare_keys, compare_pair, sweep_part
from sandmould.study.plan.plan_files import CHECKS, CURVES, STUDY_FILE, SUMMARY

NO_OUTCOME = "no outcome written"
_PARAMETER_FREE = (RUN, REPLICATE, SEED, PART)
# The summary has these of the run; those of the snapshot get a prefix there.
_OF_SNAPSHOT = (*CLOCK, GRAINS, LARGEST_OVERLAP_FRACTION)
_TEXTS = (RUN, PART, OUTCOME, DETAIL)
_NAN = "nan"
"""A gap in a table on disk; in ``_TEXTS`` it would be a word."""


@dataclass(frozen=True)
class Collected:
    """What the runs of a study left behind."""

    summary: pd.DataFrame
    """One row a run: its parameters, outcome, measures at its end, and cost."""
    curves: pd.DataFrame
    """One row a snapshot of every run: its parameters and all measures."""
    keys: tuple[str, ...]
    """The swept keys, in the order of ``runs.tsv``."""

    @property
    def of_sweep(self) -> Collected:
        """Without the runs that check the sweep, on another engine or as controls."""
        return replace(self, summary=sweep_part(self.summary), curves=sweep_part(self.curves))


def swept_keys(table: pd.DataFrame) -> tuple[str, ...]:
    """Columns of ``runs.tsv``, or of ``summary.tsv``, that are swept parameters."""
    planned = itertools.takewhile(lambda column: column != OUTCOME_CODE, table.columns)
    return tuple(str(column) for column in planned if column not in _PARAMETER_FREE)


def collect(study_folder: Path) -> None:
    """Write the tables of a study beside ``runs.tsv``, each moved into place last.

    ``summary.tsv`` has a row a run of the sweep, ``curves.tsv`` one a snapshot, ``CHECKS`` the same
    of all other runs, ``agreement.tsv`` one a pair of settings and measure that the study compares.

    Raises
    ------
    OSError, ValueError
        When ``runs.tsv`` itself cannot be read; a broken run is told in its row instead.
    """
    study = read_study(study_folder)
    gathered = gather(study_folder, study.own_measures)
    compared = compare_study(gathered.summary, gathered.keys, study)
    sweep = gathered.of_sweep
    tables = {
        SUMMARY: sweep.summary,
        CURVES: sweep.curves,
        "agreement.tsv": pd.DataFrame([c.row() for c in compared], columns=list(COLUMNS)),
    }
    if len(sweep.summary) < len(gathered.summary):
        parts = gathered.summary, gathered.curves
        checks = (table[table[PART] != SWEEP] for table in parts)
        tables |= dict(zip(CHECKS, checks, strict=True))
    for name, table in tables.items():
        with replaced(study_folder / name) as partial:
            table.to_csv(partial, sep="\t", index=False, na_rep=_NAN)


def read_collected(study_folder: Path) -> Collected:
    """Read what ``collect`` wrote: to the digit what it gathered, without a look into any run.

    Raises
    ------
    OSError, ValueError
        When a table is missing or cannot be read.
    """
    summary = read_summary(study_folder)
    curves = _read_both(study_folder, CURVES, CHECKS[1])
    return Collected(summary, curves, swept_keys(summary))


def read_summary(study_folder: Path, words: Sequence[str] = ()) -> pd.DataFrame:
    """The first table alone, of all runs, those of the sweep first; see ``read_collected``.

    Columns in ``words`` are read as text even where they look like numbers.
    """
    return _read_both(study_folder, SUMMARY, CHECKS[0], words)


def _read_both(
    study_folder: Path, sweep: str, checks: str, words: Sequence[str] = ()
) -> pd.DataFrame:
    """Table of the sweep with that of the runs that check it, where there is one."""
    tables = [_read_table(study_folder / sweep, words)]
    if (study_folder / checks).exists():
        tables.append(_read_table(study_folder / checks, words))
    return pd.concat(tables, ignore_index=True) if len(tables) > 1 else tables[0]


def _read_table(path: Path, words: Sequence[str]) -> pd.DataFrame:
    columns = pd.read_csv(path, sep="\t", nrows=0).columns
    return pd.read_csv(
        path,
        sep="\t",
        dtype=dict.fromkeys((*_TEXTS, *words), str),
        keep_default_na=False,
        na_values={str(c): [_NAN] for c in columns if c not in _TEXTS},
        low_memory=False,
    )


def compare_study(summary: pd.DataFrame, keys: Sequence[str], study: Study) -> tuple[Compared, ...]:
    """Compare all that a study wants compared; empty where that is nothing.

    ``summary``: one row a run; runs of the cross check have it in their column ``part``.
    """
    equivalence = study.equivalence
    swept = sweep_part(summary)
    comparisons = compare_keys(swept, keys, equivalence)
    if study.cross_check is not None and PART in summary:
        checked = summary[summary[PART] == CROSS_CHECK]
        alike = summary[summary[PART] == CROSS_CHECK_OWN]
        if study.cross_check.vibration_s is None:
            alike = swept
            for key, value in study.cross_check.at.items():
                alike = alike[alike[key] == value]
        engines = (study.scenario.engine.name, study.cross_check.engine)
        comparisons += compare_pair(
            "engine.name", engines, study.cross_check.at, (alike, checked), equivalence
        )
    return comparisons


def read_study(study_folder: Path) -> Study:
    """The study as planned, from its folder; one with the defaults where none was written."""
    path = study_folder / STUDY_FILE
    if not path.exists():
        return DEFAULT_KIND.study.model_validate({"title": study_folder.name.replace("_", " ")})
    tree = read_planned(path, str(path))
    kind = kind_named(tree["kind"], str(path)) if "kind" in tree else DEFAULT_KIND
    return validated(kind.study, tree, Origin({"": str(path)}))


def gather(
    study_folder: Path,
    own_measures: Mapping[str, str] = MappingProxyType({}),
) -> Collected:
    """Read every run of a study; what is missing becomes NaN, what is broken is told in ``detail``.

    ``own_measures``: formulas of the study's own measures, by name.

    Raises
    ------
    OSError, ValueError
        When ``runs.tsv`` itself cannot be read.
    """
    return gather_runs(read_runs(study_folder), study_folder, own_measures)


def read_runs(study_folder: Path) -> pd.DataFrame:
    """The planned runs of a study, one a row, with their parts."""
    runs = pd.read_csv(study_folder / "runs.tsv", sep="\t", dtype={RUN: str})
    if PART not in runs:
        runs[PART] = SWEEP
    return runs


def gather_runs(
    runs: pd.DataFrame,
    study_folder: Path,
    own_measures: Mapping[str, str] = MappingProxyType({}),
) -> Collected:
    """The same of some of the runs: rows of ``read_runs``, numbered from 0."""
    folders = [study_folder / "runs" / str(run) for run in runs[RUN]]
    outcomes, problems = _read_outcomes(folders)
    costs = read_costs(folders)
    measures = _in_order(
        read_tables(
            [folder / "measures.tsv" for folder in folders],
            lambda table: with_own_measures(_with_clock(table), own_measures),
        )
    )
    bounds = measures.bounds(len(folders))
    details = []
    for place, outcome in enumerate(outcomes):
        texts = [outcome.detail if outcome else "", problems.get(place, "")]
        texts += [costs.problems.get(place, ""), measures.problems.get(place, "")]
        if bounds[place] < bounds[place + 1]:
            gaps = measures.rows[TIME_S].iloc[bounds[place] : bounds[place + 1]].isna().sum()
            texts += [f"{gaps} snapshots cannot be read."] if gaps else []
        details.append(_sentences(texts))
    summary = {
        **{str(c): runs[c] for c in runs.columns},
        OUTCOME_CODE: [int(o.outcome) if o else np.nan for o in outcomes],
        OUTCOME: [o.outcome.label if o else NO_OUTCOME for o in outcomes],
        DETAIL: details,
        SIMULATED_S: [o.simulated_s if o else np.nan for o in outcomes],
        PLANNED_S: [o.planned_s if o else np.nan for o in outcomes],
        **_of_measures_and_costs(outcomes, measures, costs),
    }
    table = pd.DataFrame(summary).infer_objects()
    if FILL in table:
        table = table.assign(**shares_of_fills(table[FILL], study_folder))
    return Collected(table, _curves(table, swept_keys(runs), measures), swept_keys(runs))


def shares_of_fills(fills: pd.Series[str], study_folder: Path) -> dict[str, pd.Series[float]]:
    """What each run's fill took, over the runs that share it: sums count a fill once.

    ``fills``: name of each run's fill; missing for a run that shares none.
    """
    names = fills.dropna().unique()
    costs = read_costs([study_folder / FILLS / name for name in names])
    last = costs.rows.drop_duplicates(PLACE, keep="last").set_index(PLACE)
    cost = last.reindex(index=range(len(names)), columns=[WALL_S, CPU_S])
    sharing = fills.map(fills.value_counts())
    return {
        share: fills.map(dict(zip(names, cost[whole], strict=True))) / sharing
        for share, whole in ((FILL_WALL_S, WALL_S), (FILL_CPU_S, CPU_S))
    }


def _sentences(texts: Sequence[str]) -> str:
    """Texts one after the other, a full stop between those that lack one."""
    said = [text for text in texts if text]
    return " ".join([*(f"{text.rstrip('.')}." for text in said[:-1]), *said[-1:]])


def _read_outcomes(folders: Sequence[Path]) -> tuple[list[RunOutcome | None], dict[int, str]]:
    """Outcome of each run, None where it has none, and why one cannot be read, by its place."""
    outcomes: list[RunOutcome | None] = []
    problems = {}
    for place, folder in enumerate(folders):
        outcome = None
        try:
            outcome = RunOutcome.read(folder / "outcome.json")
        except FileNotFoundError:
            pass
        except UNREADABLE as error:
            problems[place] = problem_text("outcome.json", error)
        outcomes.append(outcome)
    return outcomes, problems


def _in_order(measures: RunTables) -> RunTables:
    """Measures with the snapshots of each run in order of time, those without one last."""
    if TIME_S not in measures.rows:
        return measures
    order = np.lexsort((measures.rows[TIME_S], measures.rows[PLACE]))
    return replace(measures, rows=measures.rows.take(order).reset_index(drop=True))


def _curves(summary: pd.DataFrame, keys: Sequence[str], measures: RunTables) -> pd.DataFrame:
    """Parameters, part, engine and measures of every snapshot."""
    names = [c for c in (RUN, *keys, REPLICATE, PART, ENGINE) if c in summary.columns]
    if measures.rows.empty:
        return pd.DataFrame(columns=[*names, *CLOCK])
    own = summary[names].take(measures.rows[PLACE].to_numpy()).reset_index(drop=True)
    return pd.concat([own, measures.rows.drop(columns=PLACE)], axis=1)


def _of_measures_and_costs(
    outcomes: Sequence[RunOutcome | None], measures: RunTables, costs: RunTables
) -> dict[str, pd.Series[Any]]:
    """Columns of the summary from each run's last measures and its cost."""
    every = range(len(outcomes))
    taken = _last_rows(outcomes, measures)
    measured = measures.rows.loc[list(taken.values())].set_axis(list(taken)).reindex(every)
    bounds = costs.bounds(len(outcomes))
    last = {place: bounds[place + 1] - 1 for place in every if bounds[place] < bounds[place + 1]}
    cost = costs.rows.loc[list(last.values())].set_axis(list(last)).reindex(every)
    columns: dict[str, pd.Series[Any]] = {}
    seen: set[tuple[tuple[str, ...], tuple[str, ...]]] = set()
    for place in every:
        names = (
            measures.columns[place] if place in taken else (),
            costs.columns[place] if place in last else (),
        )
        if names in seen:
            continue
        seen.add(names)
        for name in names[0]:
            columns.setdefault(f"measured_{name}" if name in _OF_SNAPSHOT else name, measured[name])
        for name in names[1]:
            if name not in columns:
                columns[name] = cost[name]
            elif name in measured and name not in _OF_SNAPSHOT:
                # The run's own account counts where both have it.
                has = np.array([p in last and name in costs.columns[p] for p in every])
                columns[name] = cost[name].where(has, measured[name])
    return columns


def _last_rows(outcomes: Sequence[RunOutcome | None], measures: RunTables) -> dict[int, int]:
    """Row of the measures at the end of each run that finished, by its place."""
    if measures.rows.empty:
        return {}
    # a snapshot that could not be read has a row without a time
    has_time = measures.rows[TIME_S].notna().to_numpy()
    bounds = measures.bounds(len(outcomes)).tolist()
    rows = {}
    for place, outcome in enumerate(outcomes):
        read = np.flatnonzero(has_time[bounds[place] : bounds[place + 1]])
        if len(read) and outcome is not None and outcome.outcome is Outcome.FINISHED:
            rows[place] = bounds[place] + int(read[-1])
    return rows


def _with_clock(table: pd.DataFrame) -> pd.DataFrame:
    """Measures, checked to carry their clock."""
    missing = [c for c in CLOCK if c not in table.columns]
    if missing:
        raise ValueError(f"no column {', '.join(missing)}")
    times = {name: pd.to_numeric(table[name]) for name in (TIME_S, VIBRATION_TIME_S)}
    return table.assign(**times)


def read_provenance(folder: Path) -> dict[str, Any]:
    """Provenance of one run; empty where it was not written or cannot be read."""
    try:
        return read_manifest(folder).get("origin", {})
    except (OSError, ValueError):
        return {}


def failed_runs(study_folder: Path) -> None:
    """Fail loudly when a run of the study failed.

    Raises
    ------
    SystemExit
        Naming each run that did not finish, with its outcome and what was said of it.
    """
    summary = read_summary(study_folder)
    failed = summary[~finished(summary)].to_dict("records")
    if failed:
        lines = [f"  {row[RUN]}: {row[OUTCOME]}. {row[DETAIL]}".rstrip() for row in failed]
        again = "A failed run is computed once more by: sandmould again RUN"
        said = "\n".join([f"{len(failed)} of {len(summary)} runs did not finish:", *lines, again])
        raise SystemExit(said)
