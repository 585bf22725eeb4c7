"""Pictures of runs that bend a pattern: the map of their loops, and the pattern's outlines.

The map has verdicts over modulus and relaxation, beside the predicted limit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from sandmould.drawing.figures import png
from sandmould.geometry.geometry import Array, Solid
from sandmould.geometry.mesh import TriangleMesh
from sandmould.kinds.sand.bent_files import shape_moments
from sandmould.kinds.sand.moments import list_moments
from sandmould.pattern_fe.coupling.loop_verdict import State
from sandmould.runs.columns import RUN
from sandmould.runs.formatting import name_of, setting_text
from sandmould.scenario.scenario import Scenario
from sandmould.study.collect import Collected

MODULUS, FACTOR = "pattern.young_modulus_pa", "pattern.loop.factor"
SCHEME = "pattern.loop.scheme"
LIMIT = "pattern_predicted_limit"
SIGNS: dict[State, tuple[str, str]] = {
    "holds": ("o", "#009E73"), "lags": ("s", "#56B4E9"), "cycles": ("^", "#E69F00"),
    "diverged": ("X", "#D55E00"),
}  # fmt: skip
"""Markers, and colours that anyone can tell apart."""
STABLE: tuple[State, ...] = ("holds", "lags")
_COLUMNS = 4
_LINE = "0.25"


def coupling_map(collected: Collected, states: Mapping[str, State]) -> dict[str, str] | None:
    """Draw verdicts and predicted limits, a panel for each setting of the other swept keys.

    The picture's address, and how many verdicts the prediction gets right as a sentence.

    ``states``: of the runs that can be judged.

    None unless modulus and fixed share are swept and predictions are known.
    """
    keys, curves = collected.keys, collected.curves
    if not {MODULUS, FACTOR} <= set(keys) or LIMIT not in curves:
        return None
    run = collected.summary[RUN].astype(str)
    # Of the snapshots: the summary has none of a run that was stopped.
    limit = run.map(curves.groupby(curves[RUN].astype(str))[LIMIT].last())
    rows = collected.summary.assign(**{"state": run.map(states), LIMIT: limit})
    rows = rows[rows["state"].isin(list(SIGNS)) & limit.notna()]
    if SCHEME in keys:
        rows = rows[rows[SCHEME] == "fixed"]
    if rows.empty:
        return None
    others = [key for key in keys if key not in (MODULUS, FACTOR, SCHEME)]
    panels = list(rows.groupby(others)) if others else [((), rows)]
    columns = min(_COLUMNS, len(panels))
    lines = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(2.6 * columns + 0.6, 2.6 * lines + 0.8), dpi=110, layout="constrained")
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(panels) :]:
        axes.set_axis_off()
    for axes, (values, part) in zip(grid.ravel(), panels, strict=False):
        _draw(axes, part)
        named = zip(others, values, strict=True)
        title = [f"{name_of(key)} {setting_text({key: value})}" for key, value in named]
        axes.set_title("\n".join(title), fontsize=8, parse_math=False)
    for axes in grid[:, 0]:
        axes.set_ylabel("share of the residual")
    for axes in grid[-1]:
        axes.set_xlabel("Young's modulus, Pa")
    figure.legend(handles=_legend(), loc="outside lower center", ncols=5, frameon=False)
    return {"picture": png(figure), "sentence": _prediction_sentence(rows)}


def _draw(axes: Axes, part: pd.DataFrame) -> None:
    """One panel."""
    limit = part.groupby(MODULUS)[LIMIT].median()
    axes.plot(limit.index, limit, color=_LINE, lw=1.4)
    for state, (marker, colour) in SIGNS.items():
        own = part[part["state"] == state]
        axes.plot(own[MODULUS], own[FACTOR], marker, color=colour, ms=7, mec="white", mew=0.6)
    axes.set(xscale="log", yscale="log")
    axes.margins(0.12)
    axes.grid(alpha=0.3)


def _legend() -> list[Line2D]:
    signs = [
        Line2D([], [], ls="", marker=marker, color=colour, ms=7, label=state)
        for state, (marker, colour) in SIGNS.items()
    ]
    return [*signs, Line2D([], [], color=_LINE, lw=1.4, label="predicted limit")]


def _prediction_sentence(rows: pd.DataFrame) -> str:
    """How good the prediction is: its verdicts, right and wrong either way."""
    below, stable = rows[FACTOR] < rows[LIMIT], rows["state"].isin(STABLE)
    wrong = [
        f"{int(count.sum())} {what}"
        for count, what in (
            (below & ~stable, "called safe that cycle or diverge"),
            (~below & stable, "called unsafe that hold or lag"),
        )
        if count.any()
    ]
    rest = f": {' and '.join(wrong)}" if wrong else ""
    right = int((below == stable).sum())
    return f"The limit predicted before the runs is right in {right} of {len(rows)}{rest}."


_MM = 1e3
_WIDTH_IN = 7.0
_STYLES = {"filled": ("after filling", "#D55E00"), "final": ("at the end", "#0072B2")}


def draw_outlines(run_folder: Path, scenario: Scenario) -> tuple[str, str]:
    """Draw the shapes of one run, in 3D cut through the middle; displacements are not magnified.

    PNG as a ``data:`` address and what it shows; both empty where the run left no shape.
    """
    pattern = scenario.pattern
    assert pattern is not None
    drawn = next(s for s in scenario.scene.solids if s.name == pattern.name)
    moments = shape_moments(list_moments(run_folder))
    shapes = {name: m.load().pattern_m for name, m in moments.items()}
    outlines_m = {name: shape for name, shape in shapes.items() if shape is not None}
    if not outlines_m:
        return "", ""
    figure = Figure(dpi=110, layout="constrained")
    ax = figure.add_subplot()
    for line_m in _lines_m(drawn, drawn.corners()):
        ax.add_patch(Polygon(line_m * _MM, facecolor="0.9", edgecolor="0.35", ls="--"))
    ax.plot([], [], color="0.35", ls="--", label="as drawn")
    for name, shape_m in outlines_m.items():
        label, colour = _STYLES[name]
        for line_m in _lines_m(drawn, shape_m):
            ax.add_patch(Polygon(line_m * _MM, fill=False, edgecolor=colour, lw=1.8))
        ax.plot([], [], color=colour, lw=1.8, label=label)
    _frame(figure, np.concatenate([drawn.corners(), *outlines_m.values()])[:, [0, -1]] * _MM)
    ax.legend(frameon=False, loc="lower right")
    said = ", ".join(["as drawn (broken line)", *(_STYLES[name][0] for name in outlines_m)])
    return png(figure), said


def draw_distances(run_folder: Path, scenario: Scenario) -> str:
    """Draw the bent surface at a run's end by its distance from the drawing; empty without one.

    The colours end at the tolerance, where there is one; what is beyond it is black.
    """
    path = run_folder / "exports" / "pattern_final.vtu"
    if not path.is_file() or scenario.pattern is None:
        return ""
    surface = meshio.read(path)
    facets, away_mm = surface.cells[0].data, surface.point_data["distance_m"] * _MM
    most_mm = (scenario.pattern.tolerance_m or 0.0) * _MM or float(np.abs(away_mm).max())
    colours = colormaps["coolwarm"].with_extremes(under="black", over="black")
    shown = ScalarMappable(Normalize(-most_mm, most_mm), colours)
    corners = surface.points[facets] * _MM
    tints = shown.to_rgba(away_mm[facets].mean(axis=1))
    figure = Figure(dpi=110, layout="constrained")
    if scenario.dimension == 2:
        flat = figure.add_subplot()
        flat.add_collection(LineCollection(list(corners[..., :2]), colors=tints, lw=4))
        _frame(figure, surface.points[:, :2] * _MM)
    else:
        space = figure.add_subplot(projection="3d", proj_type="ortho")
        space.add_collection3d(Poly3DCollection(list(corners), facecolors=tints))
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        space.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        space.set(xlabel="x, mm", ylabel="y, mm", zlabel="height, mm")
        space.set_box_aspect(high - low)
        figure.set_size_inches(_WIDTH_IN, 0.7 * _WIDTH_IN)
    figure.set_figheight(figure.get_figheight() + 0.9)
    figure.colorbar(
        shown,
        ax=figure.axes,
        label="outside the drawing, mm",
        location="bottom",
        extend="both" if np.abs(away_mm).max() > most_mm else "neither",
    )
    return png(figure)


def _lines_m(drawn: Solid, vertices_m: Array) -> list[Array]:
    """Outlines of a bent solid; in 3D where the plane y of the middle of the drawing cuts it."""
    if not isinstance(drawn, TriangleMesh):
        return [vertices_m]
    y_m = drawn.vertices_m[:, 1]
    middle_m = 0.5 * float(y_m.min() + y_m.max())
    return replace(drawn, vertices_m=vertices_m).section_m(1, middle_m)


def _frame(figure: Figure, points_mm: Array) -> None:
    """Axes of equal scales round the shapes, the picture no higher than they are."""
    (ax,) = figure.axes
    low, high = points_mm.min(axis=0), points_mm.max(axis=0)
    far = 0.06 * float((high - low).max())
    span = high - low + 2 * far
    figure.set_size_inches(_WIDTH_IN, _WIDTH_IN * float(span[1] / span[0]))
    ax.set_xlim(low[0] - far, high[0] + far)
    ax.set_ylim(low[1] - far, high[1] + far)
    ax.set_aspect("equal")
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_xlabel("x, mm")
    ax.set_ylabel("height, mm")
