"""Charts of the convergence log of a coupled run: residual, work, energy, factor, its limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from sandmould.drawing.chart import Chart, Line, LineStyle, tints
from sandmould.runs.columns import TIME_S

_POINTS = 400
"""Of a curve; windows between two of them are averaged."""


@dataclass(frozen=True)
class ConvergenceChart:
    """A chart and what it shows."""

    chart: Chart
    caption: str


@dataclass(frozen=True)
class _Curve:
    column: str
    label: str
    factor: float = 1.0
    style: LineStyle = "run"


def convergence_charts(log: pd.DataFrame, begins_s: float) -> tuple[ConvergenceChart, ...]:
    """Draw the convergence log of a run of any scheme.

    ``begins_s``: when vibration begins: zero of the charts.
    """
    windows = _averaged(log)
    windows[TIME_S] -= begins_s
    panels = [
        (
            "displacement, mm",
            (_Curve("displacement_m", "shown", 1e3, "mean"), _Curve("residual_m", "residual", 1e3)),
            "Root mean square over the surface's vertices: of the displacement that the sand saw, "
            "and of the residual. The residual is the displacement that the sand's loads give, "
            "less the one it saw.",
        ),
        (
            "energy, J",
            (
                _Curve("work_j", "work of sand", style="mean"),
                _Curve("energy_j", "stored"),
                _Curve("elastic_j", "stored"),
                _Curve("kinetic_j", "kinetic"),
                _Curve("damped_j", "damped"),
            ),
            "Work of the sand on the surface since the run began, and where it went. Stored "
            "energy above the work came from the loop itself.",
        ),
    ]
    if "factor" in windows:
        windows["limit"] = 2.0 / (1.0 + windows["gain"])
        panels.append(
            (
                "share of the residual",
                (_Curve("factor", "gone"), _Curve("limit", "limit")),
                "Share of the residual that is gone next. Where the gain was measured, the limit "
                "of a fixed share, 2 / (1 + gain), stands beside it.",
            )
        )
    return tuple(
        ConvergenceChart(chart, caption)
        for title, curves, caption in panels
        if (chart := _chart(windows, title, curves)) is not None
    )


def _averaged(log: pd.DataFrame) -> pd.DataFrame:
    """Means over so many windows that few points are left."""
    together = -(-len(log) // _POINTS)
    return log.groupby(np.arange(len(log)) // together).mean()


def _chart(windows: pd.DataFrame, title: str, curves: tuple[_Curve, ...]) -> Chart | None:
    there = [c for c in curves if c.column in windows and windows[c.column].notna().any()]
    if not there:
        return None
    lines = tuple(
        Line(
            np.column_stack([windows[TIME_S], curve.factor * windows[curve.column]]),
            tint,
            curve.style,
            label=curve.label,
            title=curve.label,
        )
        for curve, tint in zip(there, tints(len(there), False), strict=True)
    )
    alt = f"{title} against time since vibration began: {', '.join(c.label for c in there)}."
    return Chart("time since vibration began, s", title, alt, lines)
