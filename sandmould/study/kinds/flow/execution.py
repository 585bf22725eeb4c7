"""How a flow of metal is computed and measured."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import pandas as pd

from sandmould.casting.mps import computation, scene
from sandmould.casting.mps.stability_measures import by_window, measure_flow
from sandmould.runs.outcome import RunOutcome
from sandmould.scenario.flow import MetalFlow
from sandmould.study.definition.run import Run
from sandmould.study.kinds import casting


def measure(run: Run, folder: Path) -> None:
    """Write the measures against time, those of the whole run in every row, and the picture."""
    from analysis.flow_plots import draw_last

    scenario: MetalFlow = run.scenario
    outcome = RunOutcome.read(folder / "outcome.json")
    series = pd.read_csv(folder / "series.tsv", sep="\t")
    names = [probe.name for probe in scene.probes_of(scenario)]
    table = by_window(series, names, scenario.record_s)
    if table.empty:  # stopped in its first step: a row for the verdict all the same
        table.loc[0, "time_s"] = outcome.simulated_s
    table.insert(1, "vibration_time_s", math.nan)
    table.insert(2, "stage", "flowing")
    measures = measure_flow(scenario, series, outcome.detail)
    for name in names:
        table[f"{name}_mean_pa"] = measures.mean_pa[name]
        table[f"{name}_sd_pa"] = measures.sd_pa[name]
        table[f"{name}_window_sd_pa"] = measures.window_sd_pa[name]
        table[f"{name}_error_pa"] = measures.mean_pa[name] - measures.ideal_pa[name]
    table["peak_speed_m_s"] = measures.peak_speed_m_s
    table["average_speed_m_s"] = measures.average_speed_m_s
    table["hops"] = int(measures.hops)
    table["classification"] = measures.verdict.value
    casting.write_measures(folder, table)
    fields, highest_pa = casting.read_fields(folder), max(measures.ideal_pa.values())
    draw = partial(draw_last, fields, highest_pa=highest_pa) if fields else None
    casting.write_picture(folder, (5, 6), draw)


EXECUTION = casting.casting_execution(computation, computation.PRODUCTS, measure)
