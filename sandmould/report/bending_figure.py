"""Outlines of a pattern as drawn, after filling and at the end, over each other to scale."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from sandmould.drawing.figures import png
from sandmould.geometry.geometry import Array, Solid
from sandmould.geometry.mesh import TriangleMesh
from sandmould.kinds.sand.bent_files import shape_moments
from sandmould.kinds.sand.moments import list_moments
from sandmould.scenario.scenario import Scenario

_MM = 1e3
_WIDTH_IN = 7.0
_STYLES = {"filled": ("after filling", "#D55E00"), "final": ("at the end", "#0072B2")}


def draw_outlines(run_folder: Path, scenario: Scenario) -> tuple[str, str]:
    """Draw the shapes of one run, in 3D cut through the middle; displacements are not magnified.

    Parameters
    ----------
    run_folder : Path
    scenario : Scenario
        With a pattern among its obstacles.

    Returns
    -------
    (str, str)
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
    said = ", ".join(["as drawn (broken line)", *(_STYLES[name][0] for name in outlines_m)])
    return png(figure), said


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
    ax.legend(frameon=False, loc="lower right")
