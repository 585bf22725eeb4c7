"""Line and dot charts laid out in pixels, for the report's inline SVG.

Drawn here and not by matplotlib: the page's own fonts and colours then hold in the light and in the
dark, and the same chart can be laid out once for a wide page and once for a phone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

WIDE = (880, 400)
NARROW = (350, 330)
SMALL = (430, 300)
_CHARACTER = 7.4
_BOLD = 8.3
"""Widths of a character of 13 px, generously."""
_LINE = 15.0
_BESIDE = 9.0
"""From the end of a curve or axis to a label."""


@dataclass(frozen=True)
class Tint:
    """A colour for a light and one for a dark page."""

    light: str
    dark: str


PLAIN = Tint("#444444", "#cccccc")
_OKABE_ITO = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6D00")


def tints(n: int, ordered: bool) -> tuple[Tint, ...]:
    """Colours of n settings, told apart with any colour vision.

    ``ordered``: whether the settings have an order, which a run from dark to bright then shows.
    """
    if not ordered:
        return tuple(Tint(c, c) for c in (_OKABE_ITO * (n // len(_OKABE_ITO) + 1))[:n])
    from matplotlib import colormaps  # slow to import, and not every report has a chart
    from matplotlib.colors import to_hex

    steps = np.linspace(0.0, 1.0, n) if n > 1 else np.array([0.5])
    viridis = colormaps["viridis"]
    # neither end may sink into its page
    return tuple(
        Tint(to_hex(viridis(0.74 * s)), to_hex(viridis(0.38 + 0.6 * s))) for s in steps.tolist()
    )


def thinned(xy: NDArray[np.float64], stride: int) -> NDArray[np.float64]:
    """Every so many points of a curve, all below two; the last one is kept."""
    return np.concatenate([xy[: -1 : max(1, stride)], xy[-1:]])


LineStyle = Literal["run", "mean", "joined", "behind"]
"""Thin for one run or edge, thick for a mean, dotted between points that it only joins, faint
behind others."""


@dataclass(frozen=True)
class Line:
    """A curve; the label stands at its right end."""

    xy: NDArray[np.float64]
    """(k, 2) float64, in the units of the axes; NaN breaks the curve."""
    tint: Tint = PLAIN
    style: LineStyle = "run"
    label: str = ""
    title: str = ""
    group: str = ""
    """Setting that it belongs to."""


@dataclass(frozen=True)
class Mark:
    """A point; a mean has its interval."""

    x: float
    y: float
    kind: str
    """``run``, ``doubtful``, ``mean`` or ``failed``, which stands at the foot of the chart."""
    tint: Tint = PLAIN
    half_width: float = math.nan
    title: str = ""
    shift_px: float = 0.0
    """Sideways, to keep points of one setting apart."""
    label: str = ""
    """A few characters that stand to the right of it."""


@dataclass(frozen=True)
class Area:
    """What runs of one setting spread over; it lies within their lines."""

    x: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    """(k,) float64, in the units of the axes."""
    tint: Tint = PLAIN
    title: str = ""
    group: str = ""
    """Setting that it belongs to."""


Range = tuple[float, float]
"""Ends of an axis."""


@dataclass(frozen=True)
class Chart:
    """What a chart shows, in the units of its axes."""

    x_title: str
    y_title: str
    alt: str
    lines: tuple[Line, ...] = ()
    marks: tuple[Mark, ...] = ()
    x_ticks: tuple[float, ...] = ()
    """Where the x axis is marked; round numbers unless given."""
    rows: tuple[str, ...] = ()
    """Names of settings that have no scale: y counts them from the top and the intervals lie."""
    band: tuple[float, float] | None = None
    """Values along x between which the chart is shaded."""
    areas: tuple[Area, ...] = ()
    frame: tuple[Range, Range] | None = None
    """Ends of both axes; round the values unless given."""
    log_x: bool = False
    log_y: bool = False
    """Whether an axis is logarithmic; a point that is not above zero then has no place."""


@dataclass(frozen=True)
class Axis:
    """Values from low to high on pixels from start to end."""

    low: float
    high: float
    start: float
    end: float
    is_logarithmic: bool = False

    def at(self, value: float) -> float:
        """Pixel of a value; NaN where a logarithmic axis has none."""
        low, high = self.low, self.high
        if self.is_logarithmic:
            if not value > 0.0:
                return math.nan
            low, high, value = math.log10(low), math.log10(high), math.log10(value)
        return self.start + (value - low) / (high - low) * (self.end - self.start)

    def reached(self, value: float) -> float:
        """The same, at the axis' low end where a logarithmic one has none."""
        return self.at(max(value, self.low) if self.is_logarithmic else value)


@dataclass(frozen=True)
class Tick:
    """A mark of an axis in pixels."""

    at: float
    text: str


@dataclass(frozen=True)
class LaidLine:
    """A curve in pixels."""

    line: Line
    path: str
    end: tuple[float, float]
    label_x: float
    """Beyond the axis for a mean, which other curves then do not cross; else beside its end."""
    label_y: float


@dataclass(frozen=True)
class LaidMark:
    """A point in pixels with the ends of its interval."""

    mark: Mark
    x: float
    y: float
    interval: tuple[float, float, float, float] | None


@dataclass(frozen=True)
class Laid:
    """A chart in pixels, as ``chart.svg`` draws it."""

    chart: Chart
    width: float
    height: float
    left: float
    foot: float
    """Of the plot, where the axis along x lies."""
    x: Axis
    y: Axis
    x_ticks: tuple[Tick, ...]
    y_ticks: tuple[Tick, ...]
    rows: tuple[Tick, ...]
    areas: tuple[tuple[Area, str], ...]
    """Each with its path in pixels."""
    lines: tuple[LaidLine, ...]
    marks: tuple[LaidMark, ...]


def lay_out(chart: Chart, size: tuple[int, int]) -> Laid:
    """Place a chart on a drawing of so many pixels; rows make it as high as they need."""
    width, height = float(size[0]), float(size[1])
    if chart.rows:
        height = 66.0 + 42.0 * len(chart.rows)
    ys = _values(chart, 1)
    y_low, y_high = _log_range(ys) if chart.log_y else _range(ys)
    if chart.frame:
        y_low, y_high = chart.frame[1]
    y_ticks = () if chart.rows else _ticks(y_low, y_high, max(3, int(height / 55)), chart.log_y)
    y_text = [_text(t, y_ticks, chart.log_y) for t in y_ticks]
    margin = 14.0 if chart.rows else 12.0 + _CHARACTER * max(map(len, y_text), default=1)
    label = max((len(line.label) for line in chart.lines), default=0)
    xs = [*_values(chart, 0), *chart.x_ticks, *(chart.band or ())]
    x_low, x_high = _log_range(xs) if chart.log_x else _range(xs, tight=not chart.marks)
    if chart.frame:
        x_low, x_high = chart.frame[0]
    beside = 30.0 if any(m.shift_px for m in chart.marks) else 0.0
    right = width - (12.0 + _BOLD * label if label else 16.0)
    x = Axis(x_low, x_high, margin + beside, right, chart.log_x)
    foot = height - (44.0 if chart.x_title else 26.0)
    y = Axis(-0.7, len(chart.rows) - 0.3, 10.0, foot) if chart.rows else None
    y = y or Axis(y_low, y_high, foot, 34.0 if chart.y_title else 10.0, chart.log_y)
    x_ticks = chart.x_ticks or _ticks(x_low, x_high, max(4, int(width / 80)), chart.log_x)
    marks = (_laid_mark(mark, x, y, bool(chart.rows)) for mark in chart.marks)
    return Laid(
        chart=chart,
        width=width,
        height=height,
        left=margin,
        foot=foot,
        x=x,
        y=y,
        x_ticks=_not_touching([Tick(x.at(t), _text(t, x_ticks, chart.log_x)) for t in x_ticks]),
        y_ticks=tuple(Tick(y.at(t), s) for t, s in zip(y_ticks, y_text, strict=True)),
        rows=tuple(Tick(y.at(i), name) for i, name in enumerate(chart.rows)),
        areas=tuple(_laid_area(area, x, y) for area in chart.areas),
        lines=_laid_lines(chart.lines, x, y),
        marks=tuple(m for m in marks if math.isfinite(m.x) and math.isfinite(m.y)),
    )


def _values(chart: Chart, axis: int) -> list[float]:
    """All values along x (0) or y (1), ends of intervals that lie along it included."""
    values = [v for line in chart.lines for v in line.xy[:, axis].tolist()]
    has_intervals, is_logarithmic = (axis == 1, chart.log_y) if axis else (chart.rows, chart.log_x)
    for mark in chart.marks:
        reach = mark.half_width if has_intervals and math.isfinite(mark.half_width) else 0.0
        values += _ends((mark.x, mark.y)[axis], reach, is_logarithmic)
    return values


def _ends(value: float, reach: float, is_logarithmic: bool) -> list[float]:
    """Ends of an interval; on a logarithmic axis one towards zero stretches it by a decade."""
    low = value - reach
    return [max(low, 0.1 * value) if is_logarithmic else low, value + reach]


def _range(values: Sequence[float], tight: bool = False) -> tuple[float, float]:
    """Ends of an axis round its values, with a margin unless tight; never of no length."""
    finite = [v for v in values if math.isfinite(v)]
    if not finite:
        return 0.0, 1.0
    low, high = min(finite), max(finite)
    if high - low <= 1e-9 * max(abs(low), abs(high)):
        low, high = low - (0.05 * abs(low) or 0.5), high + (0.05 * abs(high) or 0.5)
    margin = 0.0 if tight else 0.06 * (high - low)
    return low - margin, high + margin


def _ticks(low: float, high: float, most: int, is_logarithmic: bool) -> tuple[float, ...]:
    return (_log_ticks if is_logarithmic else _round_ticks)(low, high, most)


def _round_ticks(low: float, high: float, most: int) -> tuple[float, ...]:
    from matplotlib.ticker import MaxNLocator

    ticks = np.asarray(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    return tuple(t for t in ticks.tolist() if low - 1e-12 <= t <= high + 1e-12)


def _log_range(values: Sequence[float]) -> tuple[float, float]:
    """Ends of a logarithmic axis round its values, with a margin."""
    low, high = _range([math.log10(v) for v in values if v > 0.0 and math.isfinite(v)])
    return 10.0**low, 10.0**high


def _log_ticks(low: float, high: float, most: int) -> tuple[float, ...]:
    """Powers of ten, and twice and five times them where that is not too many."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for steps in ((1, 2, 5), (1, 3), (1,)):
        ticks = [float(f"{step}e{n}") for n in powers for step in steps]
        ticks = [t for t in ticks if low <= t <= high]
        if len(ticks) <= most:
            break
    return tuple(ticks[:: -(-len(ticks) // most) or 1])


def _text(value: float, ticks: Sequence[float], is_logarithmic: bool = False) -> str:
    """A tick's number with the decimals that its neighbours need."""
    if is_logarithmic:
        return f"{value:g}"
    largest = max(map(abs, ticks), default=1.0)
    if largest >= 1e5 or 0 < largest < 1e-3:
        return f"{value:.3g}"
    for places in range(5):
        if all(abs(round(t, places) - t) <= 1e-6 * largest for t in ticks):
            return f"{round(value, places) + 0.0:.{places}f}"
    return f"{value:.4g}"


def _not_touching(ticks: Sequence[Tick]) -> tuple[Tick, ...]:
    """Ticks without the texts that would run into the one before."""
    labelled: list[Tick] = []
    free_from = -math.inf
    for tick in sorted(ticks, key=lambda t: t.at):
        half = _CHARACTER * len(tick.text) / 2 + 3
        fits = tick.at - half >= free_from
        labelled.append(tick if fits else Tick(tick.at, ""))
        free_from = tick.at + half if fits else free_from
    return tuple(labelled)


def _laid_area(area: Area, x: Axis, y: Axis) -> tuple[Area, str]:
    along = np.concatenate([area.x, area.x[::-1]]).tolist()
    up = np.concatenate([area.low, area.high[::-1]]).tolist()
    points = (f"{x.at(u):.1f},{y.reached(v):.1f}" for u, v in zip(along, up, strict=True))
    return area, f"M{'L'.join(points)}Z"


def _laid_lines(lines: Sequence[Line], x: Axis, y: Axis) -> tuple[LaidLine, ...]:
    laid = []
    for line in lines:
        finite = line.xy[np.isfinite(line.xy).all(axis=1)]
        if not len(finite):
            continue
        pixels = [(x.reached(u), y.reached(v)) for u, v in finite.tolist()]
        path = "M" + "L".join(f"{u:.1f},{v:.1f}" for u, v in pixels)
        laid.append((line, path, pixels[-1]))
    labelled = [(i, end[1]) for i, (line, _, end) in enumerate(laid) if line.label]
    heights = dict(_spread(labelled, y.end, y.start))
    placed = []
    for i, (line, path, end) in enumerate(laid):
        label_x = (x.end if line.style == "mean" else end[0]) + _BESIDE
        placed.append(LaidLine(line, path, end, label_x, heights.get(i, end[1])))
    return tuple(placed)


def _spread(
    labels: Sequence[tuple[int, float]], top: float, foot: float
) -> list[tuple[int, float]]:
    """Move labels apart by a line each: down from the top, then up again from the foot."""
    placed: list[tuple[int, float]] = []
    for i, at in sorted(labels, key=lambda item: item[1]):
        above = placed[-1][1] + _LINE if placed else top
        placed.append((i, max(at, above)))
    limit = foot
    for place in range(len(placed) - 1, -1, -1):
        i, at = placed[place]
        placed[place] = (i, min(at, limit))
        limit = placed[place][1] - _LINE
    return placed


def _laid_mark(mark: Mark, x: Axis, y: Axis, lying: bool) -> LaidMark:
    if mark.kind == "failed":
        return LaidMark(mark, x.at(mark.x) + mark.shift_px, y.start - 8.0, None)
    u, v, reach = x.at(mark.x), y.at(mark.y), mark.half_width
    if not math.isfinite(reach):
        return LaidMark(mark, u + mark.shift_px, v, None)
    if lying:
        return LaidMark(mark, u, v, (x.reached(mark.x - reach), v, x.at(mark.x + reach), v))
    return LaidMark(mark, u, v, (u, y.reached(mark.y - reach), u, y.at(mark.y + reach)))
