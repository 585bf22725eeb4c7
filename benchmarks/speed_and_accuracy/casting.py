"""Heat and flow."""

from __future__ import annotations

from math import isfinite, nan

from benchmarks.speed_and_accuracy.grains import SIMULATED, results_of
from benchmarks.speed_and_accuracy.method import Method, Panel, Point
from benchmarks.speed_and_accuracy.recorded import Record

MOST_DRIFT_PERCENT = 1.0
"""A way that loses more enthalpy has failed."""
CORE_TIME, NOISE = "core time, s", "noise of the pressure, Pa"
SOURCES = {"density": "density as source", None: "PySPH, 0.3 s"}


def ways(part: str, title: str) -> Panel:
    """Ways to solidify; the error is that of the worst probe or of the time, if larger."""
    points = []
    for row in results_of("arpm")[part]["rows"][1:]:
        error = max(*row["mean_error_percent"].values(), abs(row["time_error_percent"]))
        is_lost = abs(row["largest_drift_percent"]) > MOST_DRIFT_PERCENT
        failure = "loses heat" if is_lost else ""
        name, label = row["way"], f"{row['size_mm']:g} mm"
        points.append(Point(name, label, row["cpu_s"], nan if is_lost else error, failure=failure))
    return Panel(title, "error, %", points, ["`benchmarks/arpm/results.json`"], CORE_TIME)


def heat() -> Method:
    """Plates in 2D, a block in 3D, and a part whose round edges lie off the grid."""
    bracket = Record("bracket_freezes", "solidification_time_s")
    finest = bracket.where("exchange", "difference").least("element_m")
    points = bracket.points(
        ["exchange", "layers", "element_m"],
        finest,
        lambda key: (key[0] + ", layers" * (key[1] != "[]"), f"{1e3 * key[2]:g} mm"),
        0.01 * finest.values.mean(),
    )
    title, error = "disc with a bracket, 3D, round", "error of the time, %"
    panels = [
        ways("ways", "four plates, 2D"),
        ways("space", "block with a plate, 3D"),
        Panel(title, error, points, [bracket.page], CORE_TIME),
    ]
    return Method("heat", panels)


def flow() -> Method:
    """Pressure noise over step and relaxations, and of other schemes and programs."""
    tank, results = Record("tank_map", "h70_sd_pa"), results_of("mps")
    points, others = [], []
    for _, run in tank.runs.iterrows():
        name, noise_pa = f"solves a step: {run['relaxations']}", run[tank.measure]
        label = f"{1e3 * run['dt_max_s']:g} ms, {run['source_share']:g}"
        failure = "" if isfinite(noise_pa) else "diverged"
        memory = nan if failure else run["peak_memory_bytes"]
        points.append(Point(name, label, run["cpu_s"], noise_pa, memory, failure))
    for row in (*results["schemes"]["rows"], *results["peers"]["rows"]):
        if not row["stopped"]:
            name = SOURCES.get(row.get("source"), "velocities as source")
            cost = row["cpu_s_per_simulated_s"]
            others.append(Point(name, row["scheme"], cost, row["pressure_noise_pa"]))
    panels = [
        Panel("tank of 800 particles, 2 s", NOISE, points, [tank.page]),
        Panel("schemes and programs", NOISE, others, ["`benchmarks/mps/results.json`"], SIMULATED),
    ]
    return Method("flow", panels)
