"""The coupling of foam and sand, and calibration."""

from __future__ import annotations

from math import nan

from benchmarks.speed_and_accuracy.grains import ANGLE, results_of
from benchmarks.speed_and_accuracy.method import Method, Panel, Point
from benchmarks.speed_and_accuracy.recorded import Record

SCHEME, WINDOW = "pattern.loop.scheme", "pattern.loop.window_s"
MODULUS, STATICS, TIP = "pattern.young_modulus_pa", "pattern.statics", "pattern_tip_deflection_m"
SCHEMES = {
    "aitken": "Aitken",
    "in_step": "in step",
    "monolithic": "the judge",
    "one_way": "one way",
    "per_layer": "a solve a layer",
}


def schemes() -> Method:
    """Schemes over the window, against the judge; loops that do not hold."""
    judged, tried = Record("l_judged", TIP), Record("l_schemes", TIP)
    points = judged.points(
        [SCHEME, WINDOW],
        judged.where(SCHEME, "monolithic"),
        lambda key: (SCHEMES[key[0]], f"{1e3 * key[1]:g} ms" * (key[0] == "aitken")),
        1e-3,
    )
    for _, run in tried.where("pattern.loop.repeats", 0).runs.iterrows():
        ended = run["pattern_loop"] if run["outcome_code"] == 0 else run["outcome"]
        points.append(Point("windows computed once", "", run["cpu_s"], nan, failure=ended))
    title, read = "L of foam, filled over", [judged.page, tried.page]
    return Method("coupling", [Panel(title, "error of the tip, mm", points, read)])


def one_way() -> Method:
    """Loads of one way, one solve a layer and the full loop, over the foam's modulus."""
    panels = []
    for own in Record("l_enough", TIP).split(MODULUS):
        full = own.where(SCHEME, "aitken").where(STATICS, "large")
        tip_m, modulus_pa = full.values.mean(), own.runs[MODULUS].iloc[0]
        points = own.points(
            [SCHEME, STATICS], full, lambda key: (SCHEMES[key[0]], key[1]), 0.01 * tip_m
        )
        title = f"{modulus_pa / 1e6:g} MPa, tip at {1e3 * tip_m:.2g} mm"
        panels.append(Panel(title, "error of the tip, %", points, [own.page]))
    return Method("one_way", panels)


def calibration() -> Method:
    """Starts without a lasting good guess over the time of the runs."""
    heaps, emulated = Record("repose_map", ANGLE), results_of("calibration")["emulator"]
    run_s = heaps.finished["cpu_s"].mean()
    points: dict[float, list[Point]] = {}
    for race in emulated["races"]:
        name, runs = f"{race['method']}, {race['guess']}", race["since_quartiles"][1]
        bad, failure = 100.0 * race["not_good_after"] / race["seeds"], ""
        if runs is None:
            runs, bad, failure = emulated["held_after"], nan, "still not good"
        point = Point(name, f"{runs:g} runs", run_s * runs, bad, failure=failure)
        points.setdefault(race["target_deg"], []).append(point)
    read = ["`benchmarks/calibration/results.json`", heaps.page]
    error = f"starts wrong after {emulated['held_after']} runs, %"
    cost = "core time of the runs to a lasting good guess, s"
    panels = [
        Panel(f"{target:g} degrees", error, own, read, cost, is_logarithmic=False)
        for target, own in points.items()
    ]
    return Method("calibration", panels)
