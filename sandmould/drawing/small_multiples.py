"""Charts with many lines as small panels: in each one setting stands out from all others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sandmould.drawing.animation import evenly
from sandmould.drawing.chart import NARROW, PLAIN, WIDE, Chart, Laid, Line, Range, lay_out, thinned
from sandmould.runs.formatting import number

MOST_LINES = 4
"""Lines that one chart keeps apart."""
MOST_PANELS = 12
PANEL = (300, 200)
ALIKE = 0.03
"""Share of their range by which curves may differ that are drawn on each other."""
_POINTS, _POINTS_BEHIND = 200, 50


@dataclass(frozen=True)
class SmallMultiples:
    """Panels with the same axes, or one chart where all curves lie on each other."""

    panels: tuple[tuple[str, Laid], ...]
    """One setting before all others, with its label."""
    together: tuple[Laid, Laid] | None
    """The chart for a wide page and for a phone, without labels."""
    note: str
    """What is left out, or how near the curves are; empty where there is nothing to say."""


def small_multiples(chart: Chart) -> SmallMultiples | None:
    """Split a chart into a panel for each mean; None where its lines are few.

    ``chart``: of lines whose group names their setting.
    """
    means = [line for line in chart.lines if line.style == "mean"]
    if len(means) <= MOST_LINES:
        return None
    apart, span = _apart(means)
    # settings far enough apart for a logarithmic axis do not lie on each other
    if not chart.log_y and apart <= ALIKE * span:
        bare = replace(chart, lines=tuple(replace(line, label="") for line in chart.lines))
        note = (
            f"The curves of all {len(means)} settings lie on each other: at any time they differ "
            f"by {number(apart, 2)} or less."
        )
        return SmallMultiples((), (lay_out(bare, WIDE), lay_out(bare, NARROW)), note)
    shown = [means[place] for place in evenly(len(means), MOST_PANELS).tolist()]
    few = ((line, thinned(line.xy, len(line.xy) // _POINTS_BEHIND)) for line in shown)
    behind = tuple(replace(line, xy=xy, tint=PLAIN, style="behind", label="") for line, xy in few)
    whole = lay_out(chart, PANEL)
    frame = (whole.x.low, whole.x.high), (whole.y.low, whole.y.high)
    panels = tuple(
        (mean.group, lay_out(_alone(chart, mean, behind, frame), PANEL)) for mean in shown
    )
    left_out = len(means) - len(shown)
    note = f"Shown are {len(shown)} of {len(means)} settings." if left_out else ""
    return SmallMultiples(panels, None, note)


def _apart(means: Sequence[Line]) -> tuple[float, float]:
    """Most by which curves differ while all go on, and the range of their values."""
    finite = [line.xy[np.isfinite(line.xy).all(axis=1)] for line in means]
    finite = [xy for xy in finite if len(xy)]
    start, end = max(xy[0, 0] for xy in finite), min(xy[-1, 0] for xy in finite)
    values = np.concatenate([xy[:, 1] for xy in finite])
    span = float(np.ptp(values))
    if end <= start:
        return span, span
    x = np.linspace(start, end, _POINTS)
    return float(np.ptp([np.interp(x, *xy.T) for xy in finite], axis=0).max()), span


def _alone(chart: Chart, mean: Line, behind: Sequence[Line], frame: tuple[Range, Range]) -> Chart:
    """A setting's own lines in front of the means of all."""
    own = [line for line in chart.lines if line.group == mean.group]
    ends = mean.xy[np.isfinite(mean.xy).all(axis=1)]
    at_end = f"; it ends at {ends[-1, 1]:.4g}" if len(ends) else ""
    alt = f"{chart.y_title} against {chart.x_title}: {mean.title} before all others{at_end}."
    areas = tuple(area for area in chart.areas if area.group == mean.group)
    front = (replace(line, xy=thinned(line.xy, len(line.xy) // _POINTS), label="") for line in own)
    lines = (*behind, *front)
    return replace(chart, x_title="", y_title="", alt=alt, lines=lines, areas=areas, frame=frame)
