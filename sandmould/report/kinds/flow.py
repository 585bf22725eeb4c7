"""What the report of a study of flow says and shows of its own.

A stability map, noise, histories, fields and films.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sandmould.analysis.casting_plots import draw_frame, frame_of
from sandmould.casting.mps import scene
from sandmould.casting.mps.scheme import G_M_S2
from sandmould.casting.mps.shoulder import HOP_SPEED_M_S, PAPERS
from sandmould.casting.mps.stability_measures import (
    MOST_OFF,
    NOISE_WINDOW_S,
    QUIET_PA,
    StabilityRating,
    beyond_map,
)
from sandmould.drawing.animation import evenly
from sandmould.drawing.figure_files import numbered, pictures
from sandmould.drawing.figures import png
from sandmould.drawing.flow_film import SHADES, make_flow_film
from sandmould.report import flow_charts
from sandmould.report.curves import measure_curves
from sandmould.report.kinds.kind import Findings, KindPages, KindReport
from sandmould.report.tables import Cell, Column, ReportPicture, Table, cells, number_cell
from sandmould.runs.columns import CLASSIFICATION, DETAIL, HOPS, OUTCOME_CODE, RUN
from sandmould.runs.formatting import name_of, setting_text
from sandmould.runs.templates import notes, sentences, worded
from sandmould.scenario.casting.flow import MetalFlow, PouredMetal, StillTank
from sandmould.study.collect import Collected
from sandmould.wording.next_steps import NextStep

PICTURED_RUNS = 6
"""Runs whose histories and fields are drawn."""
FILMED = 2
COLOURS = tuple(to_hex(colormaps["viridis"](shade / SHADES)) for shade in range(SHADES + 1))


@dataclass(frozen=True)
class _PicturedRun:
    """A run that is drawn."""

    label: str
    folder: Path
    verdict: str


def _notes(
    scenario: MetalFlow, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    """What the paper leaves open."""
    gradient = (
        "The gradient as printed, eq. (3), points the wrong way and makes every run fail. The "
        f"gradient used here, {scene.scheme_of(scenario).gradient}, is a choice."
    )
    if isinstance(scenario.case, StillTank):
        return (gradient,)
    return (
        gradient,
        "The paper gives neither the particle size in space nor the speed of the stream.",
    )


def _pages(findings: Findings[MetalFlow], film_budget_bytes: int) -> KindPages:
    """Map, noise, histories, fields and films; the calmest runs first."""
    scenario, collected = findings.scenario, findings.collected.of_sweep
    keys = collected.keys
    ranked = _ranked(scenario, collected.summary)
    pictured = _pictured_runs(ranked, keys, findings.study_folder)
    ideal_pa = scene.ideal_pa(scenario, scene.fluid_of(scenario))
    highest_pa = max(ideal_pa.values())
    filmed = [pictured[0], pictured[-1]][: min(FILMED, len(pictured))] if pictured else []
    hopping = _hopping(scenario, ranked, keys)
    measures = [*(f"{name}_pa" for name in ideal_pa), "largest_speed_m_s"]
    stable = flow_charts.stability_map(ranked, keys)
    fields = _fields(pictured, highest_pa)
    histories = [
        (it, flow_charts.pressure_history(it.folder, it.label, it.verdict, ideal_pa))
        for it in pictured
    ]
    films = [
        make_flow_film(
            _load(run.folder), run.folder.name, f"{run.label}: {run.verdict}", highest_pa,
            film_budget_bytes // len(filmed),
        )
        for run in filmed
    ]  # fmt: skip
    shown = {
        "map": stable,
        "sentences": (*_sentences(scenario, ranked, ideal_pa), *hopping),
        "noise": _noise(scenario, ranked, keys),
        "histories": histories,
        "fields": fields,
        "films": films,
        "colours": COLOURS,
        "curves": measure_curves(collected, findings.verdict, measures),
        "pours": not isinstance(scenario.case, StillTank),
    }
    return KindPages(
        "flow.html",
        notes(
            "flow_method.j2",
            flow=scenario,
            case=scenario.case,
            papers=PAPERS,
            gravity_m_s2=G_M_S2,
            scheme=scene.scheme_of(scenario),
            collides_as_swept="collision_distance" in keys,
            quiet_pa=QUIET_PA,
            most_off=MOST_OFF,
            swept=[name_of(key) for key in keys],
        ),
        context={"pages": shown},
        figures={
            **pictures(stability_map=stable, fields=fields),
            **numbered("histories", (chart for _, chart in histories)),
        },
        picture=_first_picture(pictured[0], highest_pa) if pictured else None,
        answer=next(iter(hopping), "") or _calm(scenario, ranked, keys),
        grounds=notes(
            "flow_grounds.j2",
            at=scene.deepest(scenario),
            quiet_pa=QUIET_PA,
            most_off=MOST_OFF,
            beyond=[name_of(key) for key in beyond_map(scenario)],
            pours=not isinstance(scenario.case, StillTank),
            mass_percent=scene.mass_percent(scenario),
            gradient=scene.scheme_of(scenario).gradient,
        ),
        steps=_steps(scenario, ranked),
    )


def _first_picture(run: _PicturedRun, highest_pa: float) -> ReportPicture:
    """The metal at the end of the calmest run."""
    alt = f"Particles of run {run.folder.name} at its end, coloured by pressure"
    caption = f"{run.label}, at its end, coloured by pressure."
    return ReportPicture(_fields([run], highest_pa), alt, caption)


def _ranked(scenario: MetalFlow, summary: pd.DataFrame) -> pd.DataFrame:
    """Runs that ended: excellent, good and failed, the calmest of each first."""
    order = {stability.value: place for place, stability in enumerate(StabilityRating)}
    table = summary.copy()
    for column in (CLASSIFICATION, f"{scene.deepest(scenario)}_sd_pa"):
        if column not in table:
            table[column] = np.nan
    # a run that a guard stopped while it poured has no row of measures
    table[CLASSIFICATION] = table[CLASSIFICATION].fillna(StabilityRating.FAILED.value)
    table = table[table[OUTCOME_CODE].notna()]
    return table.assign(rank=table[CLASSIFICATION].map(order)).sort_values(
        ["rank", f"{scene.deepest(scenario)}_sd_pa"], kind="stable"
    )


def _pictured_runs(
    ranked: pd.DataFrame, keys: Sequence[str], study_folder: Path
) -> list[_PicturedRun]:
    """Runs that left fields, evenly from the calmest to the worst."""
    drawable = []
    for _, row in ranked.iterrows():
        folder = study_folder / "runs" / str(row[RUN])
        if (folder / "fields.npz").is_file():
            label = flow_charts.condition_text({key: row[key] for key in keys})
            drawable.append(_PicturedRun(label, folder, str(row[CLASSIFICATION])))
    return [drawable[place] for place in evenly(len(drawable), PICTURED_RUNS).tolist()]


def _load(folder: Path) -> dict[str, NDArray[np.float64]]:
    with np.load(folder / "fields.npz", allow_pickle=False) as archive:
        return dict(archive)


def _sentences(
    scenario: MetalFlow, ranked: pd.DataFrame, ideal_pa: dict[str, float]
) -> tuple[str, ...]:
    """How many settings hold, and how far their pressure is from rho g h."""
    counts = ranked[CLASSIFICATION].value_counts()
    name = scene.deepest(scenario)
    errors = pd.to_numeric(ranked[f"{name}_error_pa"], errors="coerce").dropna() if (
        f"{name}_error_pa" in ranked) else pd.Series(dtype=float)  # fmt: skip
    off = 100.0 / ideal_pa[name] * errors
    return sentences(
        "flow_found.j2",
        counts=[f"{counts.get(s.value, 0)} {s.value}" for s in StabilityRating],
        runs=len(ranked),
        at=name,
        ideal_pa=ideal_pa[name],
        off_percent=(off.min(), off.max()) if len(off) else None,
        window_ms=1e3 * NOISE_WINDOW_S,
        quiet_pa=QUIET_PA,
        calm=(pd.to_numeric(ranked[f"{name}_window_sd_pa"]) < QUIET_PA).sum() if len(off) else 0,
    )


def _calm(scenario: MetalFlow, ranked: pd.DataFrame, keys: Sequence[str]) -> str:
    """At which settings the pressure stays calm, the calmest first."""
    verdicts = list(ranked[CLASSIFICATION])
    noise_pa = pd.to_numeric(ranked[f"{scene.deepest(scenario)}_sd_pa"])
    return worded(
        "calm.j2",
        labels=[setting_text({key: row[key] for key in keys}) for _, row in ranked.iterrows()],
        calm=verdicts.count(StabilityRating.EXCELLENT.value),
        biased=verdicts.count(StabilityRating.BIASED.value),
        most_off=MOST_OFF,
        stopped=verdicts.count(StabilityRating.FAILED.value),
        noise_pa=next(iter(noise_pa), math.nan),
    )


def _steps(scenario: MetalFlow, ranked: pd.DataFrame) -> tuple[NextStep, ...]:
    """What a calm or restless tank asks for."""
    if not isinstance(scenario.case, StillTank):
        return ()
    if (ranked[CLASSIFICATION] == StabilityRating.EXCELLENT.value).any():
        return (NextStep("Pour with the calm setting: the study shoulder_pour shows how."),)
    if (ranked[CLASSIFICATION] == StabilityRating.BIASED.value).any():
        return (NextStep("Take smaller particles: the pressure is calm, but its mean is off."),)
    return (NextStep("Try more relaxations, a smaller c_poi (source_share) or a smaller step."),)


def _hopping(scenario: MetalFlow, ranked: pd.DataFrame, keys: Sequence[str]) -> tuple[str, ...]:
    """Where metal of a casting hops, and where it does not."""
    if isinstance(scenario.case, StillTank) or HOPS not in ranked:
        return ()
    ended = ranked[ranked[CLASSIFICATION] != StabilityRating.FAILED.value]
    at = {
        hops: [
            flow_charts.condition_text({key: row[key] for key in keys})
            for _, row in ended[ended[HOPS] == hops].iterrows()
        ]
        for hops in (0, 1)
    }
    return sentences("hopping.j2", hops=at[1], calm=at[0], speed_m_s=HOP_SPEED_M_S)


def _noise(scenario: MetalFlow, ranked: pd.DataFrame, keys: Sequence[str]) -> Table:
    """Every run with its verdict, pressures and speeds, beside what the paper says."""
    names = [probe.name for probe in scene.probes_of(scenario)]
    deepest = scene.deepest(scenario)
    is_papers = scenario.case == StillTank() and scenario.metal == PouredMetal()
    said = [
        flow_charts.said_of({key: row[key] for key in keys}) if is_papers else ""
        for _, row in ranked.iterrows()
    ]
    measured = []
    for name in names:
        measured.append((f"{name}: mean, Pa", f"{name}_mean_pa", 4))
        measured.append((f"{name}: deviation, Pa", f"{name}_sd_pa", 3))
    window = f"{name_of(deepest)}: deviation of {1e3 * NOISE_WINDOW_S:g} ms means, Pa"
    measured.append((window, f"{deepest}_window_sd_pa", 3))
    measured.append(("fastest, m/s", "peak_speed_m_s", 2))
    measured.append(("mean speed, m/s", "average_speed_m_s", 2))
    columns = [Column("setting", False), Column("verdict", False)]
    columns += [Column(title) for title, _, _ in measured]
    if any(said):
        columns.append(Column("paper's text", False))
    rows = []
    for (_, row), text in zip(ranked.iterrows(), said, strict=True):
        label = flow_charts.condition_text({key: row[key] for key in keys})
        note = str(row[DETAIL]) if str(row[DETAIL]) != "nan" else ""
        verdict = Cell(str(row[CLASSIFICATION]), str(row["rank"]), note=note)
        values = (number_cell(float(row.get(of, np.nan)), digits) for _, of, digits in measured)
        rows.append(cells(label, verdict, *values, *([text] if any(said) else [])))
    failed = tuple(c == StabilityRating.FAILED.value for c in ranked[CLASSIFICATION])
    return Table(tuple(columns), tuple(rows), failed)


def _fields(runs: Sequence[_PicturedRun], highest_pa: float) -> str:
    """Pressure over the particles at the end of each run, as the paper's figures 3 and 8."""
    if not runs:
        return ""
    across = min(len(runs), 3)
    rows = -(-len(runs) // across)
    size = (1.0 + 3.4 * across, 4.2 * rows + 0.6)
    figure = Figure(figsize=size, dpi=100, layout="constrained")
    panels = list(figure.subplots(rows, across, squeeze=False).ravel())
    for axes in panels[len(runs) :]:
        axes.set_axis_off()
    for axes, run in zip(panels, runs, strict=False):
        fields = _load(run.folder)
        last = frame_of(fields, len(fields["count"]) - 1)
        discs = draw_frame(fields, last, axes, highest_pa)
        heading = f"{run.label}\n{run.verdict}, {last.time_s:.3g} s"
        axes.set_title(heading, fontsize=8, parse_math=False)
        axes.tick_params(labelsize=8)
    figure.colorbar(discs, ax=panels[: len(runs)], label="pressure, Pa", shrink=0.6, extend="max")
    return png(figure)


REPORT = KindReport(_pages, _notes)
