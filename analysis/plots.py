"""Pictures of the scene and of the grains, in mm, on axes that the caller owns.

A 3D scene is shown in the vertical plane of x and z, cut through its middle unless told otherwise.
No window system and no global state is needed: make the axes from ``matplotlib.figure.Figure``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import Normalize
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from sandmould.analysis.free_space import box_levels_m, box_section
from sandmould.analysis.sections import convex_section, solid_sections
from sandmould.engines.snapshot import Snapshot
from sandmould.geometry.geometry import Array, Bore, Scene

LAYER_COLOURS = (
    "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7", "#999999",
)  # fmt: skip
"""Okabe and Ito's colours, told apart with any colour vision, and a grey; the ninth layer has the
first again."""
_SAND = "#D9B97C"
_DENSE_FROM = 3_000
"""Grains from which on outlines would blacken the picture and vectors bloat the file."""
_MM = 1e3


@dataclass(frozen=True)
class SceneSection:
    """A scene in its vertical plane: polygons of (k, 2) float64, m, and walls as their ends."""

    box_m: Array
    """(k, 2): round the inside of the box."""
    walls_m: tuple[Array, ...]
    """(2, 2) each; the box is open at the top."""
    solids_m: tuple[Array, ...]
    bores_m: tuple[Array, ...]
    cavities_m: tuple[Array, ...]


def scene_section(scene: Scene, height_m: float, cut_m: float | None = None) -> SceneSection:
    """Outlines of box, solids, bores and cavities in the plane shown.

    ``cut_m``, float, m: in 3D, y of the plane shown; the middle of the box unless given.

    Raises
    ------
    ValueError
        When the box is open at a side, or a wall of a 3D scene is oblique.
    """
    box_m = _box_outline(scene, height_m, cut_m)
    following_m = np.roll(box_m, -1, axis=0)
    sides_m = np.stack([box_m, following_m], axis=1)
    open_top = (box_m[:, 1] >= height_m) & (following_m[:, 1] >= height_m)
    plane_m = _middle(scene) if cut_m is None else cut_m
    bores_m = [convex_section(_bore_corners(bore), plane_m) for bore in scene.bores]
    return SceneSection(
        box_m,
        tuple(sides_m[~open_top]),
        tuple(section for solid in scene.solids for section in solid_sections(solid, plane_m)),
        tuple(bore_m for bore_m in bores_m if len(bore_m)),
        tuple(part for cavity in scene.cavities for part in solid_sections(cavity.space, plane_m)),
    )


def draw_scene(scene: Scene, ax: Axes, height_m: float, cut_m: float | None = None) -> Axes:
    """Draw the box, open at the top, its solids, and bores and cavities as broken lines.

    Raises
    ------
    ValueError
        When the box is open at a side, or a wall of a 3D scene is oblique.
    """
    section = scene_section(scene, height_m, cut_m)
    sides = [wall_m * _MM for wall_m in section.walls_m]
    walls = LineCollection(sides, colors="0.25", linewidths=1.6, zorder=3)
    walls.set_capstyle("projecting")
    ax.add_collection(walls)
    for solid_m in section.solids_m:
        ax.add_patch(Polygon(solid_m * _MM, facecolor="0.8", edgecolor="0.25", zorder=2.5))
    for bore_m in (*section.bores_m, *section.cavities_m):
        ax.add_patch(Polygon(bore_m * _MM, fill=False, edgecolor="0.1", linestyle="--", zorder=4))
    _frame(ax, scene.dimension, section.box_m)
    return ax


def draw_grains(
    snapshot: Snapshot,
    ax: Axes,
    values: Array | None = None,
    cmap: str = "viridis",
    limits: tuple[float, float] | None = None,
    cut_m: float | None = None,
) -> Axes:
    """Draw the grains, in 3D their sections by the vertical plane shown.

    Parameters
    ----------
    values : (n,) float64, optional
        What colours the grains; NaN is grey, and without values all are the colour of sand.
    limits : (float, float), optional
        Values at the ends of the colour map; the smallest and largest unless given.
    cut_m : float, m, optional
        In 3D, y of the plane shown; midway between the outermost grains unless given.
    """
    grains, in_plane = _collection(snapshot, ax, cut_m)
    if values is None:
        grains.set_facecolor(_SAND)
    else:
        finite = values[np.isfinite(values)]
        low, high = limits or (finite.min(initial=np.inf), finite.max(initial=-np.inf))
        grains.set_cmap(colormaps[cmap].with_extremes(bad="0.85"))
        grains.set_norm(Normalize(low, high) if low <= high else Normalize(0.0, 1.0))
        grains.set_array(np.ma.masked_invalid(values[in_plane]))
    return ax


def draw_by_layer(snapshot: Snapshot, ax: Axes, cut_m: float | None = None) -> Axes:
    """Draw the grains in the colour of the layer of fill that brought them, with a key."""
    grains, in_plane = _collection(snapshot, ax, cut_m)
    colours = _colour_of(snapshot.layer[in_plane]).tolist()
    grains.set_facecolor([LAYER_COLOURS[colour] for colour in colours])
    layers = np.unique(snapshot.layer)[::-1]
    keys = [
        Patch(facecolor=LAYER_COLOURS[colour], label=str(layer))
        for layer, colour in zip(layers.tolist(), _colour_of(layers).tolist(), strict=True)
    ]
    ax.legend(
        handles=keys, title="layer", loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False
    )
    return ax


def _collection(
    snapshot: Snapshot, ax: Axes, cut_m: float | None
) -> tuple[EllipseCollection, NDArray[np.bool_]]:
    """Add the discs to the axes; which of the grains they show."""
    position_m, radius_m = snapshot.position_m, snapshot.radius_m
    dimension = position_m.shape[1]
    in_plane = np.ones(len(radius_m), dtype=np.bool_)
    if dimension == 3 and len(radius_m):
        y = position_m[:, 1]
        plane_m = 0.5 * float(y.min() + y.max()) if cut_m is None else cut_m
        in_plane = np.abs(y - plane_m) < radius_m
        radius_m = np.sqrt(np.maximum(radius_m**2 - (y - plane_m) ** 2, 0.0))
    centre_m, radius_m = position_m[in_plane][:, [0, -1]], radius_m[in_plane]
    is_dense = len(radius_m) > _DENSE_FROM
    grains = EllipseCollection(
        2.0 * radius_m * _MM,
        2.0 * radius_m * _MM,
        np.zeros(len(radius_m)),
        units="xy",
        offsets=centre_m * _MM,
        offset_transform=ax.transData,
        edgecolors="none" if is_dense else "0.2",
        linewidths=0.0 if is_dense else 0.25,
        rasterized=is_dense,
        zorder=2.0,
    )
    ax.add_collection(grains)
    if len(radius_m):
        reach = radius_m[:, None]
        _frame(ax, dimension, np.concatenate([centre_m - reach, centre_m + reach]))
    return grains, in_plane


def _colour_of(layer: NDArray[np.int64]) -> NDArray[np.int64]:
    """Index of the colour of each layer."""
    return (layer - 1) % len(LAYER_COLOURS)


def _frame(ax: Axes, dimension: int, points_m: Array) -> None:
    """Widen the limits to the points, with equal scales and labels in mm."""
    ax.update_datalim(points_m * _MM)
    ax.margins(0.03)
    ax.autoscale_view()
    ax.set_aspect("equal")
    # the walls of the box are frame enough
    ax.spines[:].set_visible(False)
    ax.set_xlabel("x, mm")
    ax.set_ylabel("y, mm" if dimension == 2 else "z, mm")


def _middle(scene: Scene) -> float:
    if scene.dimension == 2:
        return 0.0
    y = box_section(scene)[:, 1]
    return 0.5 * float(y.min() + y.max())


def _box_outline(scene: Scene, height_m: float, cut_m: float | None) -> Array:
    """Polygon of the box in the plane shown, up to a height."""
    lowest_m = min(float(wall.point_m[-1]) for wall in scene.walls)
    if scene.dimension == 2:
        return box_section(scene, lowest_m, height_m)
    plan_m = box_section(scene)
    floor_m, lid_m = box_levels_m(scene.walls)
    ends_m = (max(floor_m, lowest_m), min(lid_m, height_m))
    levels = [np.column_stack([plan_m, np.full(len(plan_m), z)]) for z in ends_m]
    return convex_section(np.concatenate(levels), _middle(scene) if cut_m is None else cut_m)


def _bore_corners(bore: Bore) -> Array:
    """Corners of the cavity, (m, d) float64, m."""
    mouth_m = bore.mouth_m + bore.section_m @ bore.basis
    return np.concatenate([mouth_m, mouth_m + bore.length_m * bore.axis])
