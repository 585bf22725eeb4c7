"""Engines, steps, sizes, springs, dimensions and damping of grains."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from benchmarks.speed_and_accuracy.method import Method, Panel, Point
from benchmarks.speed_and_accuracy.recorded import Named, Record, together
from sandmould import ROOT

ANGLE, FILL = "heap_angle_deg", "tube_fill_fraction"
ANGLE_ERROR, FILL_ERROR = "error of the angle of repose, degrees", "error of the fill, %"
SIMULATED = "core time of a simulated second, s"
ENGINE, SCALE = "engine.name", "sand.size_scale"
THICKNESS, FORM = "sand.disc_thickness_m", "background_damping.form"
SPEED, HZ = "contact.wave_speed_m_s", "vibration.0.frequency_hz"


def results_of(theme: str) -> dict[str, Any]:
    """Committed results of another theme."""
    path = ROOT / "benchmarks" / theme / "results.json"
    return dict(json.loads(path.read_text(encoding="utf-8")))


def impacts(title: str, named: Callable[[dict[str, Any]], str]) -> Panel:
    """Restitution at critical damping over the step, and the limit of the reference engine.

    Parameters
    ----------
    title : str
    named : callable
        Series of a row, empty to leave it out.
    """
    points, whole_step_s = [], 0.0
    for row in results_of("engines")["accuracy"]:
        fraction, cost = row["fraction"], row["wall_s_per_s"]
        if name := named(row):
            points.append(Point(name, f"{fraction:g}", cost, 100.0 * row["error"]))
        if row["engine"] == "reference" and row["dashpot"] == "plain":
            whole_step_s = cost * fraction
    limits = results_of("stability")["scenes"]["bed"]["limits"]
    damped = next(row for row in limits if row["damping_ratio"] == 1.0)
    limit_s = whole_step_s * damped["planned_s"] / damped["whole_s"]
    read = ["`benchmarks/engines/results.json`", "`benchmarks/stability/results.json`"]
    return Panel(title, "error of the restitution, %", points, read, SIMULATED, limit_s)


def engines_and_step() -> Method:
    """Three engines over the step, on an impact and a tube."""
    tube = Record("engine_twins", FILL)
    engines = tube.points([ENGINE], tube.where(ENGINE, "reference"), lambda key: (key[0], ""), 0.01)
    panels = [
        impacts("one impact", lambda row: row["engine"] * (row["dashpot"] == "corrected")),
        Panel("tube, the same step", FILL_ERROR, engines, [tube.page]),
    ]
    return Method("engines_and_step", panels)


def scale_and_springs() -> Method:
    """Coarser grains and softer springs on a heap, softer springs in a shaken tube."""
    scales, springs = Record("repose_scale", ANGLE), Record("repose_stiffness", ANGLE)
    plain, tube = springs.where(FORM, "none"), Record("tube_law_springs", FILL)
    coarser = scales.points([SCALE], scales.least(SCALE), named_by_scale("heap"))
    softer = plain.points(
        [THICKNESS],
        plain.least(THICKNESS),
        lambda key: ("heap", f"{1e3 * key[0]:g} mm thick"),
    )
    hardest = tube.runs[SPEED].max()
    over_hz = [
        own.points(
            [SPEED], own.where(SPEED, hardest), lambda key: ("tube", f"{key[0]:g} m/s"), 0.01
        )
        for own in tube.split(HZ)
    ]
    fills = [together(points) for points in zip(*over_hz, strict=True)]
    panels = [
        Panel("heaps: coarser grains", ANGLE_ERROR, coarser, [scales.page]),
        Panel("heaps: softer springs", ANGLE_ERROR, softer, [springs.page]),
        Panel("softer springs: shaken tube, nine frequencies", FILL_ERROR, fills, [tube.page]),
    ]
    return Method("scale_and_springs", panels)


def named_by_scale(series: str) -> Named:
    """Name settings by their size scale."""
    return lambda key: (series, f"scale {key[0]:g}")


def dimensions() -> Method:
    """Discs against spheres with the same contacts."""
    discs, spheres = Record("repose_scale", ANGLE), Record("repose_3d", ANGLE)
    points = [
        *discs.points([SCALE], spheres, named_by_scale("discs")),
        *spheres.points(["engine"], spheres, lambda key: ("spheres", "scale 16")),
    ]
    read = [discs.page, spheres.page]
    return Method("dimensions", [Panel("heaps", ANGLE_ERROR, points, read)])


def damping() -> Method:
    """Plain and corrected dashpots, forms of background damping over the springs."""
    heap = Record("repose_stiffness", ANGLE)
    hard = heap.where(FORM, "none").least(THICKNESS)
    forms = heap.points(
        [FORM, THICKNESS],
        hard,
        lambda key: (key[0].removeprefix("nonviscous_"), f"{1e3 * key[1]:g} mm thick"),
    )
    panels = [
        impacts(
            "dashpots: one impact",
            lambda row: f"{row['dashpot']} dashpot" * (row["engine"] == "reference"),
        ),
        Panel("background damping: heaps", ANGLE_ERROR, forms, [heap.page]),
    ]
    return Method("damping", panels)
