"""How a solidification is computed and measured."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from sandmould.analysis.feeding import feeding
from sandmould.analysis.freezing import Freezing, freezing
from sandmould.casting.arpm import computation, scene
from sandmould.definition.run import CURVES, Run
from sandmould.kinds.casting import CastingExecution, read_fields, write_measures, write_picture
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.units import ZERO_K


class SolidificationExecution(CastingExecution[Solidification]):
    """See ``Execution``."""

    solver = computation
    products = computation.PRODUCTS

    def measure(self, run: Run, folder: Path) -> None:
        """Write the measures against time, those of the whole run in every row."""
        series = pd.read_csv(folder / "series.tsv", sep="\t")
        _, _, heat_column = scene.series_columns(run.scenario)
        clock = {"time_s": series["time_s"], "vibration_time_s": math.nan, "stage": "cooling"}
        table = pd.DataFrame({**clock, **series.drop(columns=["time_s", heat_column])})
        if fields := read_fields(folder):
            heat, frozen = series[heat_column], _frozen(run.scenario, fields)
            table["enthalpy_drift_fraction"] = heat / heat.iloc[0] - 1.0
            table["solidification_time_s"] = frozen.solidification_time_s
            for axis, place_m in zip("xyz", frozen.last_point_m, strict=False):
                table[f"last_point_{axis}_m"] = place_m
            table["hot_spots"] = len(frozen.hot_spots_m)
            if fed := feeding(fields):
                own = fields["melts"] & ~fields["riser"]
                table["part_solidification_time_s"] = fields["frozen_s"][own].max()
                table["cut_off_fraction"] = fed.cut_off_fraction
                table["low_niyama_fraction"] = fed.low_fraction
        write_measures(folder, table)

    def export(self, run: Run, folder: Path) -> None:
        """Draw how the metal froze; write the fields for ParaView and the curves for a sheet."""
        from sandmould.analysis.casting_plots import draw_freezing
        from sandmould.analysis.export import elements_to_vtk

        fields, draw = read_fields(folder), None
        if fields:
            elements_to_vtk(fields, folder / "fields.vtu")
            draw = partial(draw_freezing, fields, _frozen(run.scenario, fields))
        write_picture(folder, (6, 5), draw)
        series = pd.read_csv(folder / "series.tsv", sep="\t")
        names = {f"{probe.name}_k": f"{probe.name}_degc" for probe in run.scenario.probes}
        curves = (series[list(names)] - ZERO_K).rename(columns=names)
        curves.insert(0, "time_s", series["time_s"])
        curves.to_csv(folder / CURVES, index=False, float_format="%.6g")


def _frozen(scenario: Solidification, fields: Mapping[str, Any]) -> Freezing:
    melts = fields["melts"]
    return freezing(
        fields["position_m"][melts], fields["frozen_s"][melts], scenario.hot_spot_reach_m
    )
