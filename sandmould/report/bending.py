"""What the report of runs that bend a pattern shows: deflection, loop, verdicts, shapes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from sandmould.bad_input import BadInputError
from sandmould.drawing.chart import Area, Chart
from sandmould.drawing.convergence_charts import convergence_charts
from sandmould.drawing.thinning import drawn_part, listed_runs
from sandmould.kinds.sand.bending import convergence_log_of, verdict_of
from sandmould.pattern_fe.coupling.loop_verdict import LoopVerdict, study_sentence
from sandmould.pattern_fe.quality import mesh_sentence
from sandmould.pattern_fe.scene import pattern_of
from sandmould.report.bending_figures import coupling_map, draw_distances, draw_outlines
from sandmould.report.curves import runs_by_setting, setting_tints, time_chart
from sandmould.report.tables import Cell, Column, Table, cells
from sandmould.runs.columns import RUN, SOLID_FRACTION, TIME_S, VIBRATION_TIME_S
from sandmould.runs.formatting import setting_text
from sandmould.runs.templates import sentences
from sandmould.scenario.pattern import PatternDrawing
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.answer import TIP
from sandmould.statistics.evidence import left_out, usable_values
from sandmould.statistics.settings import group_settings, setting_of
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected

RECOVERED = "pattern_tip_recovered_m"
_RECOVERS = 0.02
"""Share of the deflection that must come back before the page says so."""
_MORE = 1.1
"""Times what remains in the end, from which on the most during the run is told."""


def bending_pages(
    study_folder: Path,
    href: str,
    scenario: Scenario,
    collected: Collected,
    verdict: Verdict,
    pictured_run: str,
) -> dict[str, Any]:
    """Draw what ``bending.html`` shows of a study's pattern."""
    verdicts: dict[str, LoopVerdict] = {}
    for run in collected.summary[RUN]:
        loop_verdict = verdict_of(study_folder / "runs" / str(run))
        if loop_verdict is not None:
            verdicts[str(run)] = loop_verdict
    curves = collected.curves
    own = curves[curves[RUN] == pictured_run] if TIP in curves else curves.iloc[:0]
    picture, note = draw_outlines(study_folder / "runs" / pictured_run, scenario)
    log = convergence_log_of(study_folder / "runs" / pictured_run)
    return {
        "sentences": (
            study_sentence(list(verdicts.values())),
            *_tip_sentences(own, verdicts.get(pictured_run), scenario),
            *_foam_sentences(own, scenario),
            *drawing_sentences(scenario),
        ),
        "deflection": deflection_chart(collected, verdict),
        "outlines": picture,
        "outlines_note": note,
        "tolerance_m": scenario.pattern.tolerance_m if scenario.pattern else None,
        "distances": draw_distances(study_folder / "runs" / pictured_run, scenario),
        "map": coupling_map(collected, {run: v.state for run, v in verdicts.items()}),
        "convergence": () if log is None else convergence_charts(log, _begins_s(own)),
        "pictured_run": pictured_run,
        "runs": _runs_table(study_folder, href, collected, verdict, verdicts),
        "paper": paper_sentences(scenario, collected, pictured_run),
    }


def drawing_sentences(scenario: Scenario) -> tuple[str, ...]:
    """How good the mesh of a drawn pattern is; nothing of others."""
    pattern = scenario.pattern
    if pattern is None or not isinstance(pattern.shape, PatternDrawing):
        return ()
    try:
        return (mesh_sentence(scenario, pattern_of(scenario)),)
    except BadInputError:
        return ("The drawing of the pattern is gone or has changed since the study was planned.",)


def _begins_s(rows: pd.DataFrame) -> float:
    """Time at which vibration begins; that of the end of a run without it."""
    shaken = rows[rows[VIBRATION_TIME_S] >= 0.0]
    times = (shaken if len(shaken) else rows.iloc[::-1])[TIME_S]
    return float(times.iloc[0]) if len(times) else 0.0


def _tip_sentences(
    rows: pd.DataFrame, verdict: LoopVerdict | None, scenario: Scenario
) -> tuple[str, ...]:
    """What became of the tip and of the sand under the pattern in the run that is shown."""
    if rows.empty:
        return ()
    shaken = rows[rows[VIBRATION_TIME_S] >= 0.0]
    first, last = (shaken.iloc[0] if len(shaken) else rows.iloc[-1]), rows.iloc[-1]
    return sentences(
        "bending.j2",
        loop_said=verdict.sentence if verdict else "",
        first=_tip(first),
        last=_tip(last),
        shaken_s=last[VIBRATION_TIME_S] if scenario.vibrations and len(shaken) > 1 else 0.0,
        back=1.0 - last[TIP] / first[TIP] if first[TIP] else 0.0,
        recovers=_RECOVERS,
    )


def _foam_sentences(rows: pd.DataFrame, scenario: Scenario) -> tuple[str, ...]:
    """Distances, stress and supports at the end of the run that is shown."""
    assert scenario.pattern is not None
    if rows.empty:
        return ()
    last, pattern = rows.iloc[-1], scenario.pattern
    most = rows.max(numeric_only=True)
    supports_n = {axis: last.get(f"pattern_support_{axis}_n", 0.0) for axis in "xyz"}
    round_off_n = 1e-9 * max(abs(force_n) for force_n in supports_n.values())
    return sentences(
        "foam.j2",
        largest_mm=1e3 * last["pattern_distance_largest_m"],
        most_mm=1e3 * most["pattern_distance_largest_m"],
        most_kpa=1e-3 * most.get("pattern_compression_largest_pa", 0.0),
        most_crushed=most.get("pattern_crushed_fraction", 0.0),
        more=_MORE,
        tolerance_mm=1e3 * (pattern.tolerance_m or 0.0),
        outside=last.get("pattern_outside_tolerance_fraction", 0.0),
        von_mises_kpa=1e-3 * last.get("pattern_von_mises_largest_pa", math.nan),
        compression_kpa=1e-3 * last.get("pattern_compression_largest_pa", math.nan),
        strength_kpa=1e-3 * (pattern.crush_strength_pa or 0.0),
        crushed=last.get("pattern_crushed_fraction", 0.0),
        supports=[
            (axis, force_n if abs(force_n) > round_off_n else 0.0)
            for axis, force_n in list(supports_n.items())[: scenario.dimension]
        ],
        kept=last.get("pattern_frequency_fraction", 1.0),
    )


def _tip(row: pd.Series[Any]) -> dict[str, float]:
    """Where the tip is, and how full the space under the pattern."""
    under = row.get("pattern_under_fraction", math.nan)
    return {"tip_mm": 1e3 * row[TIP], "under": under, "bed": row[SOLID_FRACTION]}


def paper_sentences(scenario: Scenario, collected: Collected, pictured_run: str) -> tuple[str, ...]:
    """What the paper states of its L, and whether the fillings of one setting say the same.

    ``pictured_run``: whose setting is judged, by the mean over its fillings.

    Empty under a scene that is none of the paper's: only an L that is filled in layers and then
    vibrated is.
    """
    pattern = scenario.pattern
    is_l = pattern is not None and pattern.shape.kind == "l_shape"
    if not is_l or len(scenario.fill.each_layer()) < 2 or not scenario.vibration:
        return ()
    summary, keys = collected.summary, collected.keys
    groups = group_settings(summary, keys)
    at, rows = next((at, own) for at, own in groups if pictured_run in set(own[RUN].astype(str)))
    fillings = setting_of(at, len(rows), 1e3 * usable_values(rows, RECOVERED).dropna())
    return sentences("papers_l.j2", it=fillings, by_setting=bool(keys))


def deflection_chart(collected: Collected, verdict: Verdict) -> Chart | None:
    """Deflection of the tip over the whole run, clocks set to the start of vibration.

    Each run thin, the mean of each setting thick, between its least and greatest run an area.
    """
    drawn, part = drawn_part(collected, verdict)
    if TIP not in drawn.curves:
        return None
    parts = []
    for _, rows in drawn.curves.groupby(RUN):
        shift_s = _begins_s(rows) if (rows[VIBRATION_TIME_S] >= 0.0).any() else 0.0
        parts.append(rows.assign(time_s=rows[TIME_S] - shift_s, vibration_time_s=math.nan))
    aligned = pd.concat(parts)
    chart = time_chart(aligned, drawn.summary, part, collected.keys, TIP)
    if chart is None:
        return None
    tint = setting_tints(part, collected.keys)
    areas, rows_of = [], runs_by_setting(drawn.summary, collected.keys)
    for setting in part.settings:
        rows = rows_of[setting.label]
        used = rows.loc[left_out(rows, TIP) == "", RUN]
        area = _area(aligned[aligned[RUN].isin(used)])
        if area is not None:
            said = f"{setting.label}: from the least to the greatest of {len(used)} runs"
            areas.append(replace(area, tint=tint[setting.label], title=said, group=setting.label))
    clock = (
        "time since vibration began, s"
        if (collected.curves[VIBRATION_TIME_S] >= 0).any()
        else "time, s"
    )
    return replace(chart, x_title=clock, y_title="deflection of the tip, mm", areas=tuple(areas))


def _area(curves: pd.DataFrame) -> Area | None:
    """Least and greatest of some runs while all of them go on."""
    runs = [rows[[TIME_S, TIP]].dropna().to_numpy() for _, rows in curves.groupby(RUN)]
    runs = [xy for xy in runs if len(xy)]
    if len(runs) < 2:
        return None
    start, end = max(xy[0, 0] for xy in runs), min(xy[-1, 0] for xy in runs)
    x = runs[0][:, 0]
    x = x[(x >= start) & (x <= end)]
    if len(x) < 2:
        return None
    y = 1e3 * np.array([np.interp(x, xy[:, 0], xy[:, 1]) for xy in runs])
    return Area(x, y.min(axis=0), y.max(axis=0))


_COLUMNS = (
    ("residual", "pattern_residual_fraction", 1e2, "%"),
    ("tip filled", "pattern_tip_filled_m", 1e3, "mm"),
    ("tip at end", TIP, 1e3, "mm"),
    ("largest distance", "pattern_distance_largest_m", 1e3, "mm"),
    ("its RMS", "pattern_distance_rms_m", 1e3, "mm"),
    ("outside engine", "pattern_outside_fraction", 1e2, "%"),
)


def _runs_table(
    study_folder: Path,
    href: str,
    collected: Collected,
    verdict: Verdict,
    verdicts: Mapping[str, LoopVerdict],
) -> Table:
    """Verdict, numbers at the last snapshot and files of every run."""
    columns = (
        *(Column(title, False) for title in ("run", *(["setting"] if collected.keys else []))),
        Column("loop", False),
        *(Column(f"{title}, {unit}") for title, _, _, unit in _COLUMNS),
        Column("surface", False),
        Column("solid", False),
    )
    last = {str(run): rows.iloc[-1] for run, rows in collected.curves.groupby(RUN)}
    rows, marked = [], []
    for planned in listed_runs(collected.summary, verdict).to_dict("records"):
        run = str(planned[RUN])
        loop_verdict, measures = verdicts.get(run), last.get(run, pd.Series(dtype=np.float64))
        setting = setting_text({key: planned[key] for key in collected.keys})
        named = (run, setting) if collected.keys else (run,)
        values = (factor * measures.get(name, math.nan) for _, name, factor, _ in _COLUMNS)
        files = (_file_cell(study_folder, href, run, suffix) for suffix in ("vtu", "stl"))
        rows.append(cells(*named, _loop_cell(loop_verdict), *values, *files))
        marked.append(loop_verdict is None or loop_verdict.state != "holds")
    return Table(columns, tuple(rows), tuple(marked))


def _loop_cell(verdict: LoopVerdict | None) -> Cell:
    if verdict is None:
        return Cell("–", "")
    reason = verdict.sentence.split(": ", 1)[1]
    return Cell(verdict.state, verdict.state, note=reason[0].upper() + reason[1:])


def _file_cell(study_folder: Path, href: str, run: str, suffix: str) -> Cell:
    """Link to the pattern's shape at the end of a run."""
    name = f"pattern_final.{suffix}"
    if not (study_folder / "runs" / run / "exports" / name).is_file():
        return Cell("–", "")
    return Cell(suffix.upper(), name, f"{href}runs/{quote(run)}/exports/{name}")
