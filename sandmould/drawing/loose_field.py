"""The field of loose sand as a picture: its section, and the zones with their numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from scipy.ndimage import distance_transform_edt

from sandmould.analysis.loose_zones import LOOSE, LooseField
from sandmould.drawing.figures import cut_m, panel
from sandmould.drawing.sphere_scene import SurfaceField
from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.scenario import Scenario

COLOURS = "viridis"
LEAST, MOST = LOOSE - 0.2, 2.0 - LOOSE
"""Shares of what is usual at the ends of the colours."""
_INK = "#B3261E"
_MM = 1e3


def draw_loose_field(
    field: LooseField, zones: Sequence[int], last: Snapshot, scenario: Scenario, height_m: float
) -> str:
    """Draw a field in the plane of the other pictures and outlines of zones: a ``data:`` address.

    ``zones`` are outlined as seen along y, and numbered from 1: in full where the plane cuts them,
    else dashed.
    """
    # a plane is cut as a slice of one row
    share, of_zone = (a if a.ndim == 3 else a[:, None] for a in (field.share, field.zone))
    low_m = field.low_m if field.share.ndim == 3 else np.insert(field.low_m, 1, 0.0)
    shape, plane_m = share.shape, cut_m(scenario) or 0.0
    row = int(np.clip(round((plane_m - low_m[1]) / field.cell_m), 0, shape[1] - 1))
    x, z = (_MM * (low_m[k] + field.cell_m * np.arange(shape[k])) for k in (0, 2))
    half = 0.5 * _MM * field.cell_m

    def draw(ax: Axes, _: Snapshot) -> None:
        ax.imshow(
            share[:, row].T,
            origin="lower",
            extent=(x[0] - half, x[-1] + half, z[0] - half, z[-1] + half),
            cmap=COLOURS,
            vmin=LEAST,
            vmax=MOST,
            interpolation="bilinear",
        )
        for place, zone in enumerate(zones, start=1):
            own = of_zone == zone
            seen = np.pad(own.any(axis=1), 1)
            style = "solid" if own[:, row].any() else "dashed"
            beside = (np.pad(ends, 1, "reflect", reflect_type="odd") for ends in (x, z))
            ax.contour(*beside, seen.T, [0.5], colors=_INK, linewidths=2.2, linestyles=style,
                       zorder=7)  # fmt: skip
            # deep inside what is seen of it: a mean may lie outside of a zone that is bent
            i, k = np.unravel_index(int(np.argmax(distance_transform_edt(seen))), seen.shape)
            ax.text(x[i - 1], z[k - 1], str(place), color=_INK, fontsize=19, fontweight="bold",
                    ha="center", va="center", zorder=9,
                    path_effects=[withStroke(linewidth=3.5, foreground="white")])  # fmt: skip

    return panel(last, scenario, height_m, draw)


def on_surfaces(field: LooseField) -> SurfaceField:
    """The same for the surfaces of the 3D view: what the sand next to them is like."""
    grid = np.moveaxis(np.indices(field.share.shape), 0, -1).reshape(-1, field.share.ndim)
    return SurfaceField(
        "density of the sand at it, at the end",
        field.low_m + field.cell_m * grid,
        field.share.ravel(),
        LEAST,
        MOST,
        (f"{100 * LEAST:.0f} %", f"{100 * MOST:.0f} % of what is usual"),
        field.cell_m,
    )
