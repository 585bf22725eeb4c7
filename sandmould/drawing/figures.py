"""Pictures for the report: the scene with its dimensions, and the sand at moments of vibration.

Every picture is returned as a ``data:`` address, so that the report needs no second file.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon as Patch
from numpy.typing import NDArray
from PIL import Image

from sandmould.analysis.density import apparent_density
from sandmould.analysis.plots import (
    SceneSection,
    draw_by_layer,
    draw_grains,
    draw_scene,
    scene_section,
)
from sandmould.engines.snapshot import Snapshot, scene_at
from sandmould.geometry.geometry import Block
from sandmould.scenario.box import Tube
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind

Array = NDArray[np.float64]
_MM = 1e3
_INK = "#222222"
_UNDER_TEXT = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.75}
_PANEL_PX = 760
_COLOURS = 128
"""Colours of a picture's palette: a third of the bytes, and no difference to the eye."""


def cut_m(scenario: Scenario) -> float | None:
    """Where a 3D scene is cut open, y in m: at a tube, cavity, mesh or round solid, or midway."""
    if scenario.dimension == 2:
        return None
    spaces = [cavity.space for cavity in scenario.scene.cavities]
    solids = [*spaces, *(s for s in scenario.scene.solids if not isinstance(s, Block))]
    if solids and not any(isinstance(o, Tube) for o in scenario.obstacles):
        y = solids[0].corners()[:, 1]
        return 0.5 * float(y.min() + y.max())
    return scenario.box.depth_m / 2


def section_of(scenario: Scenario, height_m: float) -> SceneSection:
    """Outlines of the last stage's scene, cut where all pictures of the scenario are."""
    return scene_section(scenario.scene_in(), height_m, cut_m(scenario))


def _draw_scene(scenario: Scenario, ax: Axes, height_m: float, at: Snapshot | str = "") -> None:
    """Box, solids and bores, cut where all pictures of the scenario are.

    At a snapshot a pattern is bent, in a stage it is as drawn. Without either the last stage is
    shown: with the gate that was taken away only before.
    """
    scene = scenario.scene_in(at) if isinstance(at, str) else scene_at(scenario, at)
    draw_scene(scene, ax, height_m, cut_m(scenario))


def draw_dimensions(scenario: Scenario, bed_height_m: float | None) -> str:
    """Draw the scene to scale with its dimensions in mm: SVG as a ``data:`` address."""
    return _address("image/svg+xml", svg_bytes(dimensioned(scenario, bed_height_m)))


def svg_bytes(figure: Figure) -> bytes:
    """A figure as SVG, the same bytes for the same figure."""
    buffer = io.BytesIO()
    # a fixed salt, or the same study would never give the same page twice
    with rc_context({"svg.hashsalt": "sandmould"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def dimensioned(
    scenario: Scenario, bed_height_m: float | None, grains: Snapshot | None = None
) -> Figure:
    """The scene to scale with its dimensions in mm.

    Parameters
    ----------
    bed_height_m : float, m, optional
        Height of the filled bed, shown as a line where there are no grains.
    grains : Snapshot, optional
        Drawn in the colours of their layers, in 3D where the plane shown cuts them.
    """
    width, height = scenario.box.width_m * _MM, scenario.box.height_m * _MM
    across = 5.6 * min(1.0, 1.4 * width / height)
    far = 0.055 * max(width, height)
    left, right, foot = -2.0 * far, width + 3.2 * far, -2.0 * far
    span = (right - left, height + 0.4 * far - foot)
    figure = Figure(figsize=(across * span[0] / width, across * span[1] / width))
    ax = figure.add_axes((0, 0, 1, 1))
    if grains is not None:
        draw_by_layer(grains, ax, cut_m(scenario))
    elif bed_height_m is not None:
        _draw_bed(scenario, ax, bed_height_m * _MM)
    _draw_scene(scenario, ax, scenario.box.height_m, StageKind.SETTLE.value)
    _dimension(ax, (0, -far), (width, -far), f"{width:g}")
    _dimension(ax, (-far, 0), (-far, height), f"{height:g}")
    for tube in scenario.obstacles:
        if isinstance(tube, Tube):
            _tube_dimensions(tube, ax, width, far)
    if scenario.vibrations:
        _draw_vibration(scenario, ax, (width + 1.5 * far, 0.5 * height), 1.6 * far)
    ax.set_xlim(left, right)
    ax.set_ylim(foot, height + 0.4 * far)
    ax.set_axis_off()
    return figure


def _draw_bed(scenario: Scenario, ax: Axes, bed: float) -> None:
    """The sand as filled, the bores left empty."""
    width = scenario.box.width_m * _MM
    sand = np.array([[0, 0], [width, 0], [width, bed], [0, bed]])
    ax.add_patch(Patch(sand, facecolor="#F1E5CC", edgecolor="none", zorder=0.5))
    for bore_m in section_of(scenario, scenario.box.height_m).bores_m:
        ax.add_patch(Patch(bore_m * _MM, facecolor="white", edgecolor="none", zorder=0.6))
    ax.text(0.03 * width, bed + 0.01 * width, f"sand filled to {bed:.0f} mm", color="#7A4A00",
            fontsize=11, va="bottom")  # fmt: skip


def _draw_vibration(
    scenario: Scenario, ax: Axes, centre: tuple[float, float], reach: float
) -> None:
    """An arrow both ways along the direction of the first stage, not to scale."""
    direction = scenario.vibrations[0].unit_direction(scenario.dimension)
    along = np.array([direction[0], direction[-1]]) * reach
    style = {"arrowstyle": "<|-|>", "color": "#0b5cad", "lw": 2.0, "mutation_scale": 16}
    middle = np.array(centre)
    ax.annotate("", xy=tuple(middle + along), xytext=tuple(middle - along), arrowprops=style)
    said, stage = "vibration", scenario.vibrations[0]
    if stage.unbalance is None:  # sand slows a table with one
        said += f"\n±{_MM * stage.amplitude_m:.3g} mm"
    ax.text(centre[0], centre[1] - 1.25 * reach, said, color="#0b5cad", fontsize=11,
            ha="center", va="top", rotation=90)  # fmt: skip


def _tube_dimensions(tube: Tube, ax: Axes, width: float, far: float) -> None:
    """Length over the tube, bore at its mouth, height of its axis."""
    left, right = tube.left_end_x_m * _MM, tube.right_end_x_m * _MM
    axis, bore = tube.axis_height_m * _MM, tube.diameter_m * _MM
    top = axis + bore / 2 + tube.wall_thickness_m * _MM + 0.5 * far
    _dimension(ax, (left, top), (right, top), f"{right - left:g}")
    at = left + 0.25 * (right - left)
    _dimension(ax, (at, axis - bore / 2), (at, axis + bore / 2), f"{bore:g}")
    under = axis - bore / 2 - tube.wall_thickness_m * _MM
    from_left = tube.closed_end == "left"
    mouth = min(right + 0.5 * far, width) if from_left else max(left - 0.5 * far, 0.0)
    ax.plot([mouth, left if not from_left else right], [axis, axis], color=_INK, lw=0.7, ls=":")
    _dimension(ax, (mouth, 0), (mouth, axis), f"{axis:g}")
    if under > far:
        ax.text((left + right) / 2, under - 0.3 * far, tube.name.replace("_", " "), ha="center",
                va="top", fontsize=11, color=_INK, bbox=_UNDER_TEXT)  # fmt: skip


def _dimension(ax: Axes, a: tuple[float, float], b: tuple[float, float], text: str) -> None:
    """A line with arrows at both ends and its length in mm."""
    style = {"arrowstyle": "<|-|>", "color": _INK, "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", xy=a, xytext=b, arrowprops=style, zorder=6, annotation_clip=False)
    middle, rotation = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2), 0 if a[1] == b[1] else 90
    centred: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 11, "color": _INK}
    ax.text(*middle, f"{text} mm", rotation=rotation, zorder=7, bbox=_UNDER_TEXT, **centred)


def draw_layers(
    snapshots: Sequence[Snapshot], scenario: Scenario, height_m: float
) -> tuple[str, ...]:
    """Draw each snapshot with grains in the colour of their layer: PNG as ``data:`` addresses."""

    def layers(ax: Axes, snapshot: Snapshot) -> None:
        draw_by_layer(snapshot, ax, cut_m(scenario))
        legend = ax.get_legend()
        if legend is not None:
            # the page has one key for all pictures
            legend.remove()

    return tuple(panel(s, scenario, height_m, layers) for s in snapshots)


def draw_densities(
    snapshots: Sequence[Snapshot], scenario: Scenario, height_m: float
) -> tuple[tuple[str, ...], tuple[float, float], tuple[float, ...]]:
    """Draw each snapshot with its grains coloured by apparent density, on one scale.

    Returns
    -------
    tuple of str
        PNG as ``data:`` addresses.
    (float, float), kg/m3
        Ends of the colours: the 5th and the 98th percentile of all grains, since the loose surface
        would dim the rest.
    tuple of float, kg/m3
        Median of each snapshot.
    """
    density_kg_m3 = [
        apparent_density(
            s.position_m, s.radius_m, scenario.sand.density_kg_m3, scene=scene_at(scenario, s)
        ).corrected_kg_m3
        for s in snapshots
    ]
    finite = (
        np.concatenate([f[np.isfinite(f)] for f in density_kg_m3]) if density_kg_m3 else np.zeros(0)
    )
    low, high = (0.0, 1.0) if not len(finite) else np.percentile(finite, [5.0, 98.0]).tolist()
    style: dict[str, Any] = {"cmap": "viridis", "limits": (low, high), "cut_m": cut_m(scenario)}
    value = {id(s): f for s, f in zip(snapshots, density_kg_m3, strict=True)}

    def densities(ax: Axes, snapshot: Snapshot) -> None:
        draw_grains(snapshot, ax, value[id(snapshot)], **style)

    pictures = tuple(panel(s, scenario, height_m, densities) for s in snapshots)
    medians = tuple(float(np.nanmedian(f)) if len(f) else math.nan for f in density_kg_m3)
    return pictures, (low, high), medians


def panel(
    snapshot: Snapshot,
    scenario: Scenario,
    height_m: float,
    draw: Callable[[Axes, Snapshot], None],
) -> str:
    """One picture of the box without axes, its scale given by a bar."""
    width, height = scenario.box.width_m * _MM, height_m * _MM
    margin = 0.015 * width
    span = (width + 2 * margin, height + 2 * margin)
    figure = Figure(figsize=(8.0, 8.0 * span[1] / span[0]), dpi=_PANEL_PX / 8.0)
    ax = figure.add_axes((0, 0, 1, 1))
    draw(ax, snapshot)
    _draw_scene(scenario, ax, height_m, snapshot)
    _scale_bar(ax, width, height)
    ax.set_xlim(-margin, width + margin)
    ax.set_ylim(-margin, height + margin)
    ax.set_axis_off()
    return png(figure)


def _scale_bar(ax: Axes, width: float, height: float) -> None:
    """A bar of a round length in the upper right corner, mm."""
    length = max(
        n for n in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if n <= 0.25 * width or n == 1
    )
    right, y = 0.97 * width, 0.955 * height
    ax.plot([right - length, right], [y, y], color=_INK, lw=2.5, zorder=8, solid_capstyle="butt")
    ax.text(right - length / 2, y - 0.012 * width, f"{length} mm", ha="center", va="top",
            fontsize=13, color=_INK, zorder=8,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5, "alpha": 0.8})  # fmt: skip


def png(figure: Figure, has_scales: bool = False) -> str:
    """A figure as a PNG of few colours, a ``data:`` address; with scales of colours it has all."""
    return _address("image/png", png_bytes(figure, has_scales))


def png_bytes(figure: Figure, has_scales: bool = False) -> bytes:
    """A figure as ``png``."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = Image.frombuffer("RGBA", canvas.get_width_height(), canvas.buffer_rgba())
    picture = drawn.convert("RGB")
    if not has_scales:
        picture = picture.quantize(_COLOURS, dither=Image.Dither.NONE)
    small = io.BytesIO()
    picture.save(small, format="png", optimize=True)
    return small.getvalue()


def _address(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
