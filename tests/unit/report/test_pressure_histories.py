"""Histories of a flow's pressure: what a chart keeps of many steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from sandmould.report.flow_charts import BINS, HIGHEST, extremes, pressure_history


def test_a_short_curve_is_whole() -> None:
    x = np.arange(5.0)
    assert extremes(x, x**2).tolist() == [[v, v**2] for v in x]


def test_peaks_of_a_long_curve_stay_where_they_are() -> None:
    x = np.linspace(0.0, 1.0, 20_000)
    y = np.sin(40.0 * x)
    y[7_001], y[7_003], y[100] = 9.0, -9.0, np.nan
    points = extremes(x, y)
    assert len(points) <= 2 * BINS
    assert np.all(np.diff(points[:, 0]) > 0.0)
    assert [x[7_001], 9.0] in points.tolist()
    assert [x[7_003], -9.0] in points.tolist()


def test_a_history_has_each_probe_beside_its_hydrostatic_pressure(tmp_path: Path) -> None:
    table = pd.DataFrame({"time_s": [0.0, 0.1, 0.2], "h30_pa": [0.0, 900.0, 2e6], "h70_pa": 1.0})
    table.to_csv(tmp_path / "series.tsv", sep="\t", index=False)
    history = pressure_history(tmp_path, "5 relaxations", "good", {"h30": 1000.0, "h70": 400.0})
    pressure, level, _, other = history.lines
    assert pressure.xy[:, 1].tolist() == [0.0, 900.0, HIGHEST * 1000.0]
    assert level.xy.tolist() == [[0.0, 1000.0], [0.2, 1000.0]]
    assert (level.style, other.xy[0, 1]) == ("joined", 400.0)
    assert history.alt.endswith("at 5 relaxations: good.")
