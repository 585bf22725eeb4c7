"""How a flow of metal is computed and measured."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.casting.mps import computation, scene
from sandmould.casting.mps.stability_measures import by_window, measure_flow
from sandmould.definition.run import Run
from sandmould.kinds.casting import CastingExecution, read_fields, write_measures, write_picture
from sandmould.runs.outcome import RunOutcome
from sandmould.scenario.casting.flow import MetalFlow


class FlowExecution(CastingExecution[MetalFlow]):
    """See ``Execution``."""

    solver = computation
    products = computation.PRODUCTS

    def measure(self, run: Run, folder: Path) -> None:
        """Write the measures against time, those of the whole run in every row."""
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
        for name, value in _at_the_end(read_fields(folder)).items():
            table[name] = value
        write_measures(folder, table)

    def export(self, run: Run, folder: Path) -> None:
        """Draw the last field."""
        from sandmould.analysis.casting_plots import draw_last

        fields, series = read_fields(folder), pd.read_csv(folder / "series.tsv", sep="\t")
        highest_pa = max(measure_flow(run.scenario, series, "").ideal_pa.values())
        draw = partial(draw_last, fields, highest_pa=highest_pa) if fields else None
        write_picture(folder, (5, 6), draw)


def _at_the_end(fields: Mapping[str, NDArray[np.float64]] | None) -> dict[str, float]:
    """Pressures in the last field, Pa; NaN without one.

    The bottom row is all metal lower than one particle size, as in figure 3.
    """
    names = ("end_highest_pa", "end_bottom_pa", "end_bottom_sd_pa")
    if fields is None or not fields["count"][-1]:
        return dict.fromkeys(names, math.nan)
    last = slice(-int(fields["count"][-1]), None)
    pressure, height = fields["pressure_pa"][last], fields["position_m"][last, -1]
    bottom = pressure[height < float(fields["particle_m"])]
    spread = (bottom.mean(), bottom.std()) if len(bottom) else (math.nan, math.nan)
    return dict(zip(names, map(float, (pressure.max(), *spread)), strict=True))
