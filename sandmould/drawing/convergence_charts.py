"""Charts of the convergence log of a coupled run: residual, work, energy, factor, its limit."""

from __future__ import annotations

import numpy as np
import pandas as pd

from sandmould.drawing.chart import Chart, Line, LineStyle, tints
from sandmould.runs.columns import TIME_S

_POINTS = 400
"""Of a curve; windows between two of them are averaged."""
_Curve = tuple[str, str, float, LineStyle]
"""Column, label, factor and style."""


def convergence_charts(log: pd.DataFrame, begins_s: float) -> tuple[tuple[Chart, str], ...]:
    """Draw the convergence log of a run of any scheme: charts, each with its caption.

    ``begins_s``: when vibration begins: zero of the charts.
    """
    # means over so many windows that few points are left
    windows = log.groupby(np.arange(len(log)) // -(-len(log) // _POINTS)).mean()
    windows[TIME_S] -= begins_s
    panels: list[tuple[str, tuple[_Curve, ...], str]] = [
        (
            "displacement, mm",
            (
                ("displacement_m", "shown", 1e3, "mean"),
                ("residual_m", "residual", 1e3, "run"),
            ),
            "Root mean square over the surface's vertices: of the displacement that the sand saw, "
            "and of the residual. The residual is the displacement that the sand's loads give, "
            "less the one it saw.",
        ),
        (
            "energy, J",
            (
                ("work_j", "work of sand", 1.0, "mean"),
                ("energy_j", "stored", 1.0, "run"),
                ("elastic_j", "stored", 1.0, "run"),
                ("kinetic_j", "kinetic", 1.0, "run"),
                ("damped_j", "damped", 1.0, "run"),
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
                (("factor", "gone", 1.0, "run"), ("limit", "limit", 1.0, "run")),
                "Share of the residual that is gone next. Where the gain was measured, the limit "
                "of a fixed share, 2 / (1 + gain), stands beside it.",
            )
        )
    return tuple(
        (chart, caption)
        for title, curves, caption in panels
        if (chart := _chart(windows, title, curves)) is not None
    )


def _chart(windows: pd.DataFrame, title: str, curves: tuple[_Curve, ...]) -> Chart | None:
    there = [c for c in curves if c[0] in windows and windows[c[0]].notna().any()]
    if not there:
        return None
    lines = []
    for (column, label, factor, style), tint in zip(there, tints(len(there), False), strict=True):
        xy = np.column_stack([windows[TIME_S], factor * windows[column]])
        lines.append(Line(xy, tint, style, label, label))
    alt = f"{title} against time since vibration began: {', '.join(c[1] for c in there)}."
    return Chart("time since vibration began, s", title, alt, tuple(lines))
