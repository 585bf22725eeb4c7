"""Speed of the engines side by side, and of the reference engine against its targets.

``make benchmarks`` runs ``python -m benchmarks.engines``: it writes engines.json beside this file,
docs/speed.md and docs/speed.png. With ``--quick`` tiny scenes show in a minute that everything
works, and their files go to results/benchmarks/. ``--page`` writes the page of engines.json again.
Nothing else should run on the machine meanwhile.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing as mp
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.engines_accuracy import measure_accuracy
from benchmarks.engines_beds import KEPT, settled
from benchmarks.engines_chart import draw
from benchmarks.engines_machine import machine
from benchmarks.engines_page import page
from benchmarks.engines_rates import measure_bed
from benchmarks.engines_roofline import measure_roofline
from benchmarks.engines_scale import measure_scale, measure_threads
from benchmarks.engines_timing import QUICK, Settings, one_core
from sandmould import ROOT

KEPT_JSON = Path(__file__).with_name("engines.json")


def settle_all(settings: Settings) -> None:
    """Settle all beds that are not kept from an earlier run, side by side."""
    wanted = [(3, settings.spheres)] + [(2, n) for n in {settings.tile, *settings.discs}]
    with mp.get_context("spawn").Pool(2) as pool:
        pool.starmap(settled, wanted, chunksize=1)


def measure_rates(settings: Settings) -> list[dict[str, Any]]:
    """All engines on all settled beds, and on the smaller bed of discs shaken."""
    discs = [settled(2, n) for n in settings.discs]
    with one_core():
        rows = [measure_bed(bed, settings) for bed in (*discs, settled(3, settings.spheres))]
        return [*rows, measure_bed(discs[0], settings, shaken=True)]


def measure(settings: Settings) -> dict[str, Any]:
    """Measure everything, one after the other."""
    begun = time.perf_counter()

    def told(what: str, work: Callable[[], Any]) -> Any:
        print(f"{time.perf_counter() - begun:5.0f} s  {what}", flush=True)
        return work()

    found = told("machine and compilers", machine)
    told("settled beds", lambda: settle_all(settings))
    found["rates"] = told("engines side by side", lambda: measure_rates(settings))
    found["threads"] = told("two threads", lambda: measure_threads(settings))
    found["scale"] = told("scene size", lambda: measure_scale(settings))
    found["roofline"] = told("limits of the core", lambda: measure_roofline(settings))
    found["accuracy"] = told("accuracy", lambda: measure_accuracy(found["rates"][0], settings))
    found["load_average_after"] = os.getloadavg()[0]
    found["measured_s"] = round(time.perf_counter() - begun)
    found["rounds"], found["block_s"] = settings.rounds, settings.block_s
    return found


def write_page(found: dict[str, Any], folder: Path) -> None:
    """Write speed.md and speed.png."""
    (folder / "speed.md").write_text(page(found), encoding="utf-8")
    draw(found, folder / "speed.png")


def main() -> None:
    """Measure, keep, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="tiny scenes, to see that it works")
    parser.add_argument("--page", action="store_true", help="write the page again, measure nothing")
    asked = parser.parse_args()
    kept, docs = KEPT_JSON, ROOT / "docs"
    if asked.quick:
        KEPT.mkdir(parents=True, exist_ok=True)
        kept, docs = KEPT / "engines.json", KEPT
    if not asked.page:
        text = json.dumps(measure(QUICK if asked.quick else Settings()), indent=1)
        kept.write_text(text + "\n", encoding="utf-8")
    write_page(json.loads(kept.read_text(encoding="utf-8")), docs)
    print(f"The page: {(docs / 'speed.md').relative_to(ROOT)}")


if __name__ == "__main__":
    main()
