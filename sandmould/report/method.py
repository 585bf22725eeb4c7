"""How a study of sand was computed, in terms and sentences for the end of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from sandmould.definition.study import Objective
from sandmould.runs.columns import (
    BED_LIMIT_S,
    ENGINE,
    LEAST_LIMIT_S,
    LIMIT_MOMENTS,
    RANKS,
    REPLICATE,
    SEED,
    TIME_STEP_FRACTION,
    TIME_STEP_S,
    VERSION,
)
from sandmould.runs.formatting import name_of
from sandmould.runs.templates import Note, notes
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.scenario import Scenario
from sandmould.wording.answer import OF_DRIVE

_Ends = tuple[float, float]


def sand_method(scenario: Scenario, keys: Sequence[str], summary: pd.DataFrame) -> tuple[Note, ...]:
    """How the runs were computed: model, laws, vibration, time step, seeds.

    ``scenario``: of one run; what the study sweeps is said apart.
    """
    return notes(
        "sand_method.j2",
        scene=scenario,
        it=bed_hardness(scenario),
        sizes_mm=[1e3 * each.diameter_m for each in scenario.sand.classes(scenario.dimension)],
        is_swept=any(key.startswith("vibration.") for key in keys),
        is_held=not any(key.endswith(OF_DRIVE[1:]) for key in keys),
        steps=_steps(summary),
        bed=_steps_of_bed(summary),
        **_of_runs(keys, summary),
    )


def deck_method(scenario: OwnDeck, keys: Sequence[str], summary: pd.DataFrame) -> tuple[Note, ...]:
    """What is known of the runs of a user's deck; see ``sand_method``."""
    values = {n: v for n, v in scenario.values.items() if f"values.{n}" not in keys}
    return notes(
        "deck_method.j2",
        deck=Path(scenario.template).name,
        given=[f"{name} = {value}" for name, value in values.items()],
        read=[f"{name_of(name)} from {taken.text}" for name, taken in scenario.taken.items()],
        **_of_runs(keys, summary),
    )


def statistics_method(objective: Objective, ends: str, draws_by_lot: bool) -> tuple[Note, ...]:
    """How the verdict was reached."""
    measure, better = objective.measure, objective.better
    return notes(
        "statistics_method.j2", measure=measure, better=better, ends=ends, by_lot=draws_by_lot
    )


def own_measures_method(own_measures: Mapping[str, str]) -> tuple[Note, ...]:
    """Formulas of the user's own measures; no row without any."""
    formulas = [f"{name} = {formula}" for name, formula in own_measures.items()]
    return (Note("Own measures", "; ".join(formulas)),) if formulas else ()


def measured_when(scenario: Scenario) -> str:
    """When measures are taken without a time: at the end of a run."""
    if not scenario.vibrations:
        return "the end"
    return "rest after vibration" if scenario.ends_at_rest else "the end of vibration"


def _of_runs(keys: Sequence[str], summary: pd.DataFrame) -> dict[str, Any]:
    """Engines, swept keys and seeds of a study's runs, as templates name them."""
    engines, seeds = pd.DataFrame(), ""
    if ENGINE in summary:
        engines = summary[[ENGINE, VERSION, RANKS]].dropna().drop_duplicates()
    if {REPLICATE, SEED} <= set(summary.columns):
        is_shared = (summary.groupby(REPLICATE)[SEED].nunique() == 1).all()
        seeds = "shared" if is_shared else "own"
    return {
        "engines": [(name, of, int(ranks)) for name, of, ranks in engines.itertuples(index=False)],
        "swept": [name_of(key) for key in keys],
        "seeds": seeds,
    }


def _steps(summary: pd.DataFrame) -> dict[str, _Ends]:
    """Time steps and their shares of the critical one; nothing where runs do not say them."""
    if not {TIME_STEP_S, TIME_STEP_FRACTION} <= set(summary.columns):
        return {}
    steps, shares = summary[TIME_STEP_S].dropna(), summary[TIME_STEP_FRACTION].dropna()
    return {"us": _ends(1e6 * steps), "share": _ends(shares)} if len(steps) and len(shares) else {}


def _steps_of_bed(summary: pd.DataFrame) -> dict[str, Any]:
    """What is known of runs that took their step from the filled bed."""
    columns = [TIME_STEP_S, BED_LIMIT_S, LEAST_LIMIT_S, LIMIT_MOMENTS]
    found = summary[columns].dropna() if set(columns) <= set(summary.columns) else pd.DataFrame()
    if found.empty:
        return {}
    step_s, bed_s, least_s, moments = (found[column] for column in columns)
    return {
        "runs": len(found),
        "share": _ends(step_s / bed_s),
        "limit_us": _ends(1e6 * bed_s),
        "moments": _ends(moments),
        "least_us": _ends(1e6 * least_s),
        "times": _ends(least_s / step_s),
    }


def _ends(values: pd.Series[float]) -> _Ends:
    return float(values.min()), float(values.max())


def provenance_rows(all_runs: Sequence[Mapping[str, Any]]) -> tuple[Note, ...]:
    """What the runs say of their origin; what is another one in every run tells nothing of them.

    ``all_runs``: the origin of each run, of its ``products.json``.
    """
    flat = [dict(_flatten(p)) for p in all_runs if p]
    rows = []
    for key in dict.fromkeys(k for p in flat for k in p):
        values = list(dict.fromkeys(p[key] for p in flat if key in p))
        if len(values) == len(flat) > 1:
            continue
        more = f" and {len(values) - 1} others" if len(values) > 1 else ""
        rows.append(Note(key.replace("_", " ").replace(".", ": "), f"{values[0]}{more}"))
    return tuple(rows)


def _flatten(values: Mapping[str, Any], above: str = "") -> list[tuple[str, str]]:
    pairs = []
    for name, value in values.items():
        key = f"{above}.{name}" if above else str(name)
        if isinstance(value, Mapping):
            pairs += _flatten(value, key)
        elif isinstance(value, list):
            pairs.append((key, " ".join(map(str, value))))
        else:
            pairs.append((key, str(value)))
    return pairs
