"""Measures against time, each with the sentence that concludes it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from sandmould.drawing.chart import Chart
from sandmould.drawing.figure_files import numbered
from sandmould.drawing.thinning import drawn_part
from sandmould.report.curves import runs_of, time_chart
from sandmould.runs.columns import RUN
from sandmould.runs.formatting import display_scale, name_of, number
from sandmould.statistics.evidence import left_out
from sandmould.statistics.over_time import Passage, passage_of
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected


@dataclass(frozen=True)
class Curve:
    """A chart against time with the sentence that concludes it."""

    chart: Chart
    measure: str
    conclusion: str


def measure_curves(
    collected: Collected,
    verdict: Verdict,
    measures: Sequence[str],
    conclude: Callable[[Collected, Verdict, str], str],
) -> tuple[Curve, ...]:
    """Charts of measures against time, those that no run has left out.

    Parameters
    ----------
    collected : Collected
    verdict : Verdict
    measures : sequence of str
        Columns of the curves.
    conclude : callable
        Gives the sentence of a measure.
    """
    curves = []
    drawn, part = drawn_part(collected, verdict)
    for measure in measures:
        chart = time_chart(drawn.curves, drawn.summary, part, collected.keys, measure)
        if chart is not None:
            curves.append(Curve(chart, measure, conclude(collected, verdict, measure)))
    return tuple(curves)


def curve_figures(curves: Iterable[Curve]) -> dict[str, Chart]:
    """Measures over time, as files."""
    return numbered("curves", (curve.chart for curve in curves))


def best_passage(collected: Collected, verdict: Verdict, measure: str) -> Passage | None:
    """A measure of the best setting over its vibration; None where no run tells."""
    if verdict.best is None:
        return None
    rows = runs_of(collected.summary, verdict.best)
    return passage_of(collected.curves, rows.loc[left_out(rows, measure) == "", RUN], measure)


def late_conclusion(collected: Collected, verdict: Verdict, measure: str) -> str:
    """Whether the measure still changed at the end, at the best setting."""
    passage = best_passage(collected, verdict, measure)
    if verdict.best is None or passage is None or passage.late == 0:
        return ""
    where, what, change = verdict.best.label, name_of(measure), passage.change
    if not change:
        return f"At {where} it changed by less than 2 % in the last quarter of the vibration."
    way = "rose" if change > 0 else "fell"
    return (
        f"At {where} the {what} still {way} by {100 * abs(change):.0f} % in the last quarter of "
        "the vibration: a longer one may change the ranking."
    )


def whole_conclusion(collected: Collected, verdict: Verdict, measure: str) -> str:
    """How the measure changed over the vibration, at the best setting."""
    passage = best_passage(collected, verdict, measure)
    if verdict.best is None or passage is None:
        return ""
    first, last = (display_scale(measure)[0] * v for v in (passage.first, passage.last))
    way = "rose" if last > first else "fell"
    return f"At {verdict.best.label} it {way} from {number(first)} to {number(last)}."
