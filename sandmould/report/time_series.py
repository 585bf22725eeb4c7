"""Charts of measures against time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sandmould.drawing.chart import Chart
from sandmould.drawing.figure_files import numbered
from sandmould.drawing.thinning import drawn_part
from sandmould.report.curves import time_chart
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected


def measure_curves(
    collected: Collected, verdict: Verdict, measures: Sequence[str]
) -> tuple[Chart, ...]:
    """Charts of measures against time, those that no run has left out."""
    drawn, part = drawn_part(collected, verdict)
    every = (
        time_chart(drawn.curves, drawn.summary, part, collected.keys, each) for each in measures
    )
    return tuple(chart for chart in every if chart is not None)


def curve_figures(curves: Iterable[Chart]) -> dict[str, Chart]:
    """Measures over time, as files."""
    return numbered("curves", curves)
