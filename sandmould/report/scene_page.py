"""A scene to scale before anything runs: as a picture, or as a page with a 3D view."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sandmould.analysis.casting_plots import draw_part
from sandmould.analysis.plots import LAYER_COLOURS
from sandmould.bad_input import BadInputError, Problem
from sandmould.casting.arpm.scene import solids_of
from sandmould.drawing.figure_files import page_environment
from sandmould.drawing.figures import cut_m, dimensioned, png, png_bytes, svg_bytes
from sandmould.drawing.sphere_film import SphereFilm, sphere_frames
from sandmould.drawing.sphere_scene import solid_scene, sphere_scene
from sandmould.engines.snapshot import Snapshot
from sandmould.report.cast_fields import distance_from
from sandmould.runs.files import replaced
from sandmould.runs.formatting import listed
from sandmould.runs.templates import Note, notes
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.likely_bed import LikelyBed, likely_bed
from sandmould.scenario.placement import plan_counts
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind

ENDINGS = (".html", ".png", ".svg")
_DPI = 160


def usual_ending(scenario: Scenario | Solidification) -> str:
    """A picture of a plane scene, a page that can be turned of one in space."""
    if isinstance(scenario, Solidification):
        return ENDINGS[1] if scenario.dimensions == 2 else ENDINGS[0]
    return ENDINGS[1] if scenario.dimension == 2 else ENDINGS[0]


def draw_scene_file(scenario: Scenario | Solidification, title: str, run: str, out: Path) -> None:
    """Draw box, solids, cavities, likely grains and vibration to scale, or a casting in its box.

    Parameters
    ----------
    title, run : str
        What the page is headed with.
    out : Path
        A page (``.html``) or a picture (``.png``, ``.svg``).

    Raises
    ------
    BadInputError
        When the file has another ending.
    OSError
        When it cannot be written.
    """
    if out.suffix.lower() not in ENDINGS:
        valid = f"a file that ends in {', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}"
        raise BadInputError([Problem("--output", str(out), valid)])
    if not out.absolute().parent.is_dir():
        raise BadInputError([Problem("--output", str(out), "a file in a folder that is there")])
    # opened before a minute of drawing, and not after it
    with replaced(out) as partial, partial.open("wb") as file:
        if isinstance(scenario, Solidification):
            figure, shown = _of_casting(scenario, run)
        else:
            figure, shown = _of_sand(scenario, run)
        figure.set_dpi(_DPI)
        if out.suffix.lower() == ".svg":
            file.write(svg_bytes(figure))
        elif out.suffix.lower() == ".png":
            file.write(png_bytes(figure))
        else:
            page = page_environment().get_template("scene.html")
            file.write(page.render(title=title, run=run, picture=png(figure), **shown).encode())


def _as_snapshot(bed: LikelyBed) -> Snapshot:
    n = len(bed.radius_m)
    return Snapshot(
        time_s=0.0,
        vibration_time_s=math.nan,
        stage=StageKind.SETTLE.value,
        id=np.arange(1, n + 1),
        layer=bed.layer,
        position_m=bed.position_m,
        velocity_m_s=np.zeros_like(bed.position_m),
        spin_rad_s=np.zeros((n, 3)),
        radius_m=bed.radius_m,
    )


def _key(figure: Figure, bed: LikelyBed) -> None:
    """The layers' colours over the sand, or none where there is one layer."""
    (ax,) = figure.axes
    key = ax.get_legend()
    if key is None:
        return
    if bed.layer.max(initial=1) == 1:
        key.remove()
        return
    key.set_loc("upper right")
    key.set_bbox_to_anchor((1.0, 1.0))


def _of_sand(scenario: Scenario, run: str) -> tuple[Figure, dict[str, Any]]:
    """Picture of a scene of sand, and what its page shows."""
    bed = likely_bed(scenario, cut_m(scenario))
    grains = _as_snapshot(bed)
    figure = dimensioned(scenario, None, grains)
    _key(figure, bed)
    films: tuple[SphereFilm, ...] = ()
    scene: dict[str, object] = {}
    if scenario.dimension == 3:
        frames = sphere_frames([grains], scenario, run, "planned", (0.0, 1.0))
        films = (replace(frames.whole, of_grains=bed.of_grains, slice_m=bed.slice_m),)
        scene = sphere_scene(scenario, scenario.box.height_m)
        scene["marks"] = _arrow(scenario)
        # stronger than where the sand has moved: what is looked at here is the part
        scene["solid_tint"] = [0.42, 0.46, 0.52, 0.85]
    layers = range(1, int(bed.layer.max(initial=1)) + 1)
    return figure, {
        "is_cast": False,
        "dimension": scenario.dimension,
        "facts": _facts(scenario),
        "slice_note": _slice_note(bed, scenario.dimension),
        "vibrates": bool(scenario.vibrations),
        "films": films,
        "scene": scene,
        "layer_colours": [(n, LAYER_COLOURS[(n - 1) % len(LAYER_COLOURS)]) for n in layers],
    }


def _of_casting(scenario: Solidification, run: str) -> tuple[Figure, dict[str, Any]]:
    """The same of a casting in its box; of many parts the plane goes through the first."""
    low_m, high_m = np.array(scenario.box.low_m), np.array(scenario.box.high_m)
    solids = solids_of(scenario)
    y = solids[0].corners()[:, 1]
    figure = Figure(figsize=(6.0, 5.0), layout="constrained")
    middle_m = 0.5 * float(y.min() + y.max())
    draw_part(low_m, high_m, middle_m, figure.subplots(), distance_from(solids))
    sides = " × ".join(f"{1e3 * side:g}" for side in high_m - low_m)
    return figure, {
        "is_cast": True,
        "dimension": scenario.dimensions,
        "facts": (
            Note("box", f"{sides} mm"),
            Note("cast", listed([solid.name for solid in solids], most=8)),
            Note("elements", f"{1e3 * scenario.element_m:g} mm"),
        ),
        "slice_note": "",
        "vibrates": False,
        "films": (SphereFilm(run=run),),
        "scene": solid_scene(solids, low_m, high_m) if scenario.dimensions == 3 else {},
        "layer_colours": [],
    }


def _slice_note(bed: LikelyBed, dimension: int) -> str:
    """Which part of the sand is drawn; empty where all of it is."""
    if bed.slice_m is None:
        return ""
    low, high = (f"{1e3 * place_m:.0f}" for place_m in bed.slice_m)
    axis = "y" if dimension == 3 else "x"
    drawn = f"{_count(len(bed.radius_m))} of {_count(bed.of_grains)} grains"
    return f"Drawn are {drawn}, those from {axis} = {low} to {high} mm."


def _count(number: int) -> str:
    return f"{number:,}".replace(",", "\u00a0")


def _facts(s: Scenario) -> tuple[Note, ...]:
    """What is drawn, in numbers."""
    counts = plan_counts(s)
    return notes(
        "scene_facts.j2",
        scene=s,
        grains=_count(sum(counts)),
        counts=[_count(n) for n in counts],
        sizes=[f"{1e3 * each.diameter_m:.3g} mm" for each in s.sand.classes(s.dimension)],
        names=list(dict.fromkeys(o.name.replace("_", " ") for o in s.obstacles)),
        spaces=[*s.scene.bores, *s.scene.cavities],
    )


def _arrow(s: Scenario) -> list[list[float]]:
    """Lines of an arrow both ways beside the box along the first vibration, m; not to scale."""
    if not s.vibrations:
        return []
    size_m = np.array([s.box.width_m, s.box.depth_m, s.box.height_m])
    along = np.array(s.vibrations[0].unit_direction(3))
    reach_m = 0.12 * float(size_m.max())
    middle_m = np.array([size_m[0] + 1.5 * reach_m, size_m[1], 0.5 * size_m[2]])
    across = np.cross(along, [0.0, 1.0, 0.0] if abs(along[1]) < 0.9 else [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    lines = [middle_m - reach_m * along, middle_m + reach_m * along]
    for way in (-1.0, 1.0):
        tip_m = middle_m + way * reach_m * along
        for side in (-1.0, 1.0):
            lines += [tip_m, tip_m - reach_m * (0.3 * way * along + 0.15 * side * across)]
    return [np.round(np.concatenate(lines), 6).tolist()]
