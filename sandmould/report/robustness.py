"""The report's robustness checks: what the controls say, their table, the bed's own spectrum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from sandmould.analysis.spectrum import transfer
from sandmould.definition.certificate import frequency_key
from sandmould.definition.study import Study
from sandmould.drawing.chart import PLAIN, Chart, Line, tints
from sandmould.report.bed_mode import BedMode, Response, bed_mode
from sandmould.report.tables import Cell, Column, Table, cells, number_cell
from sandmould.runs.columns import STAGE, TIME_S
from sandmould.runs.formatting import number
from sandmould.runs.templates import worded
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind, is_filling
from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2
from sandmould.statistics.robustness import Robustness, assess_robustness, shaken_runs
from sandmould.statistics.spring_dependence import SpringCheck, assess_springs
from sandmould.study.collect import Collected
from sandmould.study.plan.plan_files import read_run
from sandmould.study.robustness.controls import SHAKE_G, cases
from sandmould.study.rounds.round_log import read_rounds
from sandmould.wording.robustness import robustness_sentences

_LIMBS = {
    "inner": "both",
    "rising": "the lower alone",
    "falling": "the upper alone",
    "open": "not told",
    "no result": "too few runs",
}
_WORDS = {"up": "moves up", "down": "moves down", "held": "stays"}


@dataclass(frozen=True)
class RobustnessPages:
    """What the section shows."""

    assessment: Robustness
    sentences: tuple[str, ...]
    table: Table
    spring_table: Table | None
    spectrum: Chart | None
    mode: BedMode | None
    column: str
    """What a column of springs would do, as a sentence; empty where nothing vibrates."""


def robustness_pages(
    study_folder: Path, study: Study, collected: Collected, scenario: Scenario
) -> RobustnessPages | None:
    """Assess and draw the controls of a study; None before they are chosen, or without any.

    ``scenario``: of any run of the sweep.
    """
    key = frequency_key(study.sweep)
    certified_hz = read_rounds(study_folder, study).certified_hz
    if not key or not certified_hz:
        return None
    controlled = tuple(cases(study.certificate, scenario, certified_hz[1]))
    summary, objective = collected.summary, study.objective
    margin = study.equivalence.margins.get(objective.measure)
    hold = scenario.vibrations[0].hold
    springs = assess_springs(summary, key, certified_hz[1], objective, controlled, hold, margin)
    robustness = assess_robustness(
        summary, key, certified_hz, objective, margin, controlled, springs
    )
    responses = _responses(study_folder, shaken_runs(summary, controlled))
    mode = bed_mode(scenario, collected.of_sweep.summary, responses)
    return RobustnessPages(
        robustness,
        robustness_sentences(robustness),
        _table(robustness, certified_hz),
        _spring_table(springs) if springs else None,
        _chart(responses) if responses else None,
        mode,
        worded("spring_column.j2", it=mode, is_shaken=bool(responses)) if mode else "",
    )


def _table(robustness: Robustness, certified_hz: Sequence[float]) -> Table:
    columns = (
        Column("control", False),
        *(Column(f"{f:g} Hz") for f in certified_hz),
        Column("shift"),
        Column("95 % interval"),
        Column("the optimum", False),
    )
    rows = [cells("the sweep itself", *robustness.sweep, math.nan, "–", "–")]
    for shift in robustness.shifts:
        low, high = shift.ci
        interval = "–" if math.isnan(low) else f"{number(low, 2)} to {number(high, 2)}"
        verdict = _WORDS.get(shift.verdict, shift.verdict)
        gain = number_cell(shift.shift, 2)
        rows.append(cells(shift.name, *shift.means, gain, interval, verdict))
    marked = tuple(verdict.text.startswith("moves") for *_, verdict in rows)
    return Table(columns, tuple(rows), marked)


def _responses(study_folder: Path, runs: Sequence[str]) -> list[Response]:
    """Amplification of the small shake in each of its runs."""
    responses = []
    for run in runs:
        folder = study_folder / "runs" / run
        scenario = read_run(folder / "scenario.yaml").scenario
        loads = pd.read_csv(folder / "loads.tsv", sep="\t")
        upward = [c for c in loads.columns if c.startswith("force_")][-1]
        total = loads.groupby([STAGE, TIME_S], sort=False)[upward].sum().reset_index()
        filled = total[total[STAGE].map(is_filling).astype(bool)]
        # Sand presses down on the box; the mean of the last layer's rest is its weight.
        weight_n = -float(filled[upward].iloc[-len(filled) // 20 :].mean())
        rigid_n = weight_n / scenario.gravity_m_s2 * SHAKE_G * STANDARD_GRAVITY_M_S2
        window_s = scenario.from_vibration.record.series_every_s
        shaken, response = [], []
        for place, stage in enumerate(scenario.vibrations, start=1):
            rows = total[total[STAGE] == StageKind.VIBRATE.numbered(place)]
            if len(rows) < 4:
                continue
            frequency_hz = stage.frequency_hz
            time_s, force_n = (rows[c].to_numpy(dtype=np.float64) for c in (TIME_S, upward))
            shaken.append(frequency_hz)
            response.append(transfer(time_s, force_n, frequency_hz, window_s, rigid_n))
        responses.append((np.array(shaken), np.array(response)))
    return responses


def _chart(responses: Sequence[Response]) -> Chart:
    tint = tints(1, False)[0]
    lines = [Line(np.column_stack([f, r]), PLAIN, title="one filling") for f, r in responses]
    frequency = responses[0][0]
    mean = np.mean([np.interp(frequency, f, r) for f, r in responses], axis=0)
    lines.append(Line(np.column_stack([frequency, mean]), tint, "mean", title="mean"))
    peak = int(np.nanargmax(mean))
    return Chart(
        "frequency, Hz",
        "force over that of a rigid bed",
        f"Response of the bed to a small shake against frequency; highest at "
        f"{number(frequency[peak])} Hz with {number(mean[peak])}.",
        tuple(lines),
    )


def _spring_table(springs: SpringCheck) -> Table:
    """A row a curve: springs, what is held, where the optimum lies, its limbs."""
    columns = (
        Column("held", False),
        Column("springs"),
        Column("optimum, Hz"),
        Column("95 % interval, Hz"),
        Column("better than the lowest by"),
        Column("better than the highest by"),
        Column("limbs", False),
    )
    rows, marked = [], []
    for hold in springs.holds:
        for curve in hold.curves:
            best, low, high = curve.place_hz
            is_inner = curve.limbs.shape == "inner"
            place = f"{number(low)} to {number(high)}" if is_inner else "–"
            springs_cell = Cell(f"x{curve.factor:g}", str(curve.factor))
            best_cell = Cell(number(best) if is_inner else "–", str(best))
            drops = (number_cell(drop, 2) for drop in curve.limbs.drop)
            limbs = Cell(_LIMBS[curve.limbs.shape], curve.limbs.shape)
            rows.append(cells(hold.hold, springs_cell, best_cell, place, *drops, limbs))
            marked.append(not is_inner)
    return Table(columns, tuple(rows), tuple(marked))
