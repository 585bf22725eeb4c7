"""What it changes to measure a packing at rest after vibration, and not at full speed.

``make at-rest`` runs ``python -m benchmarks.at_rest``, which writes
docs/developers/measured_at_rest.md.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.at_rest.shaken_beds import (
    MEASURES,
    Beds,
    Drive,
    Row,
    at_rest,
    filled_bed,
    moments,
    scenes,
)
from benchmarks.frame import Benchmark, BenchmarkRun, render
from sandmould.scenario.vibration import STOP_PERIODS

DRIVES = (Drive(12, 3.0), Drive(25, 1.5), Drive(50, 1.5))
WHOLE = Beds(DRIVES, fillings=2, moments=8, duration_s=2.0, stops=(0.5, 1.0, 2.0, 4.0))
LITTLE = Beds(DRIVES[1:2], fillings=1, moments=2, duration_s=0.2, stops=(1.0, 2.0))


def _summary(fillings: list[list[Row]]) -> dict[str, dict[str, float]]:
    """Mean of all, and greatest less least of a filling's, in the mean over fillings."""
    found = {}
    for name in MEASURES:
        values = np.array([[row[name] for row in rows] for rows in fillings])
        spread = float(np.ptp(values, axis=1).mean())
        found[name] = {"mean": round(float(values.mean()), 5), "spread": round(spread, 5)}
    return found


def drives(run: BenchmarkRun) -> list[dict[str, Any]]:
    """Each drive at speed and at rest, over the phases of one period and over whole periods.

    Stops of other lengths are compared in the first filling.
    """
    extent: Beds = run.extent
    beds = [(scene, filled_bed(scene)) for scene in scenes(extent.fillings)]
    rows = []
    for drive in extent.drives:
        last, count = round(extent.duration_s * drive.frequency_hz), extent.moments
        earlier = [last - count + 1.0 + i for i in range(count - 1)]
        periods = [*earlier, *(last + i / count for i in range(count))]
        seen: dict[str, list[list[Row]]] = {
            name: [] for name in ("stage_end", "speed", "rest_stage_end", "rest", "rest_periods")
        }
        stops = {}
        for scene, bed in beds:
            found = list(moments(scene, bed, drive, periods))
            before, of_period = found[: count - 1], found[count - 1 :]
            at_rests = [at_rest(scene, bed[0], moment, drive) for moment in of_period]
            of_periods = [at_rest(scene, bed[0], moment, drive) for moment in before]
            seen["stage_end"].append([of_period[0].at_speed])
            seen["speed"].append([moment.at_speed for moment in of_period])
            seen["rest_stage_end"].append(at_rests[:1])
            seen["rest"].append(at_rests)
            seen["rest_periods"].append([*of_periods, at_rests[0]])
            if scene is beds[0][0]:
                for stop in extent.stops:
                    rests = [at_rest(scene, bed[0], m, drive, stop) for m in of_period]
                    stops[f"{stop:g}"] = _summary([rests])
        rows.append(
            {**vars(drive), **{name: _summary(r) for name, r in seen.items()}, "stops": stops}
        )
        print(rows[-1], flush=True)
    return rows


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    values = {
        **results,
        "fillings": WHOLE.fillings,
        "stop_periods": STOP_PERIODS,
    }
    return render(Path(__file__).with_name("page.md.j2"), values)


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={"drives": drives},
    pages={"developers/measured_at_rest.md": page},
    extent=WHOLE,
    quick=LITTLE,
)

if __name__ == "__main__":
    BENCHMARK.command()
