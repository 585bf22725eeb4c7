"""The report's section on a measure that is to be known: its map, heaps, calibrated sands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sandmould.definition.study import Study
from sandmould.drawing.figure_files import pictures, strip
from sandmould.report.kinds.kind import Findings
from sandmould.report.kinds.registry import report_of
from sandmould.report.tables import Cell, Column, ReportPicture, Table, cells, number_cell
from sandmould.runs.columns import CPU_S, RUN, total_s
from sandmould.runs.formatting import name_of, number, seconds, titled, unit_of, with_margin
from sandmould.runs.templates import sentences, worded
from sandmould.statistics.calibration.sands import Calibrated, CalibratedSand
from sandmould.statistics.emulator import TooFewRunsError, fit_emulator
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.settings import Setting
from sandmould.study.calibration.run import read_calibrated
from sandmould.wording.answer import detail_sentences, first_sentence


@dataclass(frozen=True)
class SandEstimate:
    """One calibrated sand."""

    name: str
    sentences: tuple[str, ...]
    posterior: str
    """Picture; empty where none was found."""
    values: tuple[str, ...]
    """Most probable, each with its name and its standard deviation."""


@dataclass(frozen=True)
class EstimatePages:
    """What the section shows."""

    title: str
    headline: str
    """Answers the study's question where sands were to be found; empty elsewhere."""
    sentences: tuple[str, ...]
    sound: bool
    """Whether the study's question is answered."""
    heaps: tuple[ReportPicture, ...]
    map: Table | None
    map_picture: str
    sands: tuple[SandEstimate, ...]
    worths: Table | None
    cost: str

    @property
    def has_section(self) -> bool:
        """Whether there is more to show than sentences."""
        return bool(self.heaps or self.map or self.sands or self.worths)


def estimate_pages(page: Findings[Any]) -> EstimatePages | None:
    """Draw what a study found that asks for a value, not for the best; None for other studies."""
    study_folder, study, answer, verdict = page.study_folder, page.study, page.answer, page.verdict
    if study.objective.better != "neither":
        return None
    summary, keys = page.collected.of_sweep.summary, page.collected.keys
    settings = [s for s in verdict.settings if s.n]
    calibrated = read_calibrated(study_folder, study, summary, keys)
    sands = tuple(_sand(sand, calibrated) for sand in calibrated.sands) if calibrated else ()
    said = [*detail_sentences(answer), *_reported(settings, verdict.measure, study)]
    said += _touching(summary)
    said += [sentence for sand in sands for sentence in sand.sentences[:1]]
    found = [sand for sand in sands if sand.posterior]
    lacking = [sand.name for sand in sands if not sand.posterior]
    numeric = [k for k in keys if pd.api.types.is_numeric_dtype(summary[k])]
    is_map = len(keys) == 2 and len(numeric) == 2
    what = name_of(verdict.measure)
    runs = "The run" if len(summary) == 1 else f"All {len(summary)} runs"
    return EstimatePages(
        title="Angle of repose" if verdict.measure == "heap_angle_deg" else what.capitalize(),
        headline=worded("calibrated_head.j2", found=found, lacking=lacking) if sands else "",
        sentences=tuple(said) or (first_sentence(answer),),
        sound=bool(settings) and not lacking,
        heaps=report_of(page.scenario).heaps(study_folder, summary, verdict, page.scenario),
        map=_map_table(settings, (keys[0], keys[1])) if is_map and settings else None,
        map_picture=_map_picture(summary, keys, verdict.measure, calibrated) if is_map else "",
        sands=sands,
        worths=_worth_table(calibrated) if calibrated and calibrated.worths else None,
        cost=f"{runs} took {seconds(total_s(summary, CPU_S))} of processor time.",
    )


def estimate_figures(pages: EstimatePages) -> dict[str, bytes]:
    """Heaps side by side, the map, and what is known of each sand, as files."""
    files = pictures(
        map=pages.map_picture, **{f"posterior_{sand.name}": sand.posterior for sand in pages.sands}
    )
    if pages.heaps:
        files["heaps"] = strip([(heap.caption, heap.address) for heap in pages.heaps])
    return files


def _reported(settings: Sequence[Setting], measure: str, study: Study) -> list[str]:
    """The value of the one setting beside what was reported."""
    reported = study.objective.reported
    if reported is None or len(settings) != 1:
        return []
    (setting,) = settings
    unit = unit_of(measure)
    unit = unit if unit in ("", "°") else f" {unit}"
    reach = setting.ci_half_width
    spread = "" if math.isnan(reach) else f" ± {number(reach, 2)}{unit}"
    return [
        f"{reported.by} reports {number(reported.value)}{unit}: the difference is "
        f"{number(setting.mean - reported.value, 2)}{unit}{spread}."
    ]


def _touching(summary: pd.DataFrame) -> list[str]:
    """Name runs whose heap leans on a wall: neither its slope nor its front is the sand's own."""
    if "heap_touches" not in summary:
        return []
    # An empty cell is read as NaN.
    leaning = summary[[isinstance(walls, str) for walls in summary["heap_touches"]]]
    if leaning.empty:
        return []
    walls, names = sorted(set(leaning["heap_touches"])), [str(run) for run in leaning[RUN]]
    given = {"walls": walls, "names": names, "planned": len(summary)}
    return [worded("touching.j2", **given, run_out="run_out_m" in summary)]


def _map_table(settings: Sequence[Setting], keys: tuple[str, str]) -> Table:
    """The measure over both keys, the second across, as the paper's Figure 11."""
    from sandmould.report.repose_figures import plotted  # it draws: slow to import

    rows_of = sorted({s.values[keys[0]] for s in settings})
    columns_of = sorted({s.values[keys[1]] for s in settings})
    at = {(s.values[keys[0]], s.values[keys[1]]): s for s in settings}

    def head(key: str, value: float) -> str:
        return number(float(plotted(key, np.array(value))))

    unit = "°" if keys[1].endswith("rolling_arm_fraction") else ""
    columns = [Column(name_of(keys[0]))]
    columns += [Column(f"{head(keys[1], c)}{unit}") for c in columns_of]
    rows = []
    for r in rows_of:
        row = [Cell(head(keys[0], r), repr(r))]
        for c in columns_of:
            setting = at.get((r, c))
            text = "–" if setting is None else with_margin(setting.mean, setting.ci_half_width)
            row.append(Cell(text, repr(math.nan if setting is None else setting.mean)))
        rows.append(tuple(row))
    return Table(tuple(columns), tuple(rows), (False,) * len(rows))


def _map_picture(
    summary: pd.DataFrame, keys: Sequence[str], measure: str, calibrated: Calibrated | None
) -> str:
    from sandmould.report.repose_figures import draw_map

    pair, points = (keys[0], keys[1]), summary[list(keys)].to_numpy(dtype=np.float64)
    values = np.asarray(usable_values(summary, measure), dtype=np.float64)
    emulator = calibrated.emulators.get(measure) if calibrated else None
    try:
        emulator = emulator or fit_emulator(measure, points, values)
    except TooFewRunsError:
        return ""
    sands = calibrated.sands if calibrated else ()
    return draw_map(emulator, pair, titled(measure), points[np.isfinite(values)], sands)


def _sand(sand: CalibratedSand, calibrated: Calibrated) -> SandEstimate:
    """What is said of a calibrated sand."""
    name, known = sand.sand.name, sand.posterior
    if known is None or sand.by_first is None:
        said = sentences("calibrated.j2", sand=name, problem=sand.problem)
        return SandEstimate(name, said, "", ())
    from sandmould.report.repose_figures import draw_posterior

    values = tuple(
        f"{name_of(key)} {with_margin(mode, sd)}"
        for key, mode, sd in zip(calibrated.keys, known.mode, known.sd, strict=True)
    )
    taken = [f"{name_of(k)} {t.value:g} ± {t.sd:g}" for k, t in sand.sand.assumed.items()]
    said = sentences(
        "calibrated.j2",
        sand=name,
        problem="",
        targets=[f"{name_of(m)} {t.value:g} ± {t.sd:g}" for m, t in sand.sand.targets.items()],
        taken=taken,
        values=values,
        correlation=known.correlation,
        # A bit halves what is possible.
        first_percent=100.0 * 2.0**-sand.by_first.bits,
        all_percent=100.0 * 2.0**-known.bits if len(sand.sand.targets) + len(taken) > 1 else None,
    )
    return SandEstimate(name, said, draw_posterior(sand, calibrated.keys), values)


def _worth_table(calibrated: Calibrated) -> Table:
    columns = (
        Column("measure", is_number=False), Column("bits alone"), Column("bits added"),
        Column("extra processor time a run"), Column("bits added per processor hour"),
    )  # fmt: skip
    rows = []
    for w in calibrated.worths:
        rate = w.bits_added / w.cpu_s * 3600 if w.cpu_s > 0.0 else math.inf
        bits = (number_cell(each, 2) for each in (w.bits_alone, w.bits_added))
        cost = Cell(seconds(w.cpu_s) if w.cpu_s else "none", str(w.cpu_s))
        rows.append(cells(Cell(name_of(w.measure), w.measure), *bits, cost, rate))
    return Table(columns, tuple(rows), (False,) * len(rows))
