"""Calibration against its peers: the noise of one heap, runs needed, and coverage.

``make peers`` runs ``python -m benchmarks.calibration``: it writes calibration.json beside this
file and docs/calibration_peers.md. Runs come from the emulator of the study
repose_map; with ``--oracle dem`` they are DEM runs, of one seed unless ``--seeds`` says more or 0,
and truths are planted by DEM too, in two measures of the same runs. Runs by DEM are kept in
results/benchmarks/calibration_runs.jsonl: what was killed goes on from there.
``--record`` takes the map that docs/results keeps. With ``--quick`` few seeds show that everything
works, and their files go to results/benchmarks/quick/. ``--page`` writes the page of the json
again.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.calibration_coverage import (
    MEASURED_SD_DEG,
    dem_coverage,
    our_coverage,
    peer_coverage,
    planted,
)
from benchmarks.calibration_methods import (
    Method,
    Nearest,
    Ours,
    PeerError,
    open_peers,
    problem_of,
)
from benchmarks.calibration_oracle import (
    ANGLE,
    KEPT_RUNS,
    SECOND,
    Map,
    NoMapError,
    by_dem,
    by_emulator,
    map_file,
    read_map,
    rows_by_dem,
)
from benchmarks.calibration_page import page
from benchmarks.calibration_race import CAP, HELD_AFTER, run_race, summarised
from sandmould import ROOT
from sandmould.runs.files import write_text
from sandmould.scenario.scenario import Scenario
from sandmould.study.simulate import provenance

KEPT_JSON = Path(__file__).with_name("calibration.json")
QUICK = ROOT / "results" / "benchmarks" / "quick"
PEERS = ROOT / ".venv-peers" / "bin" / "python"


@dataclass(frozen=True)
class Settings:
    """How much is measured."""

    oracle: str = "emulator"
    seeds: int = 20
    truths: int = 200
    """Planted on the emulator, or by DEM."""
    targets: tuple[float, ...] = (25.0, 30.0)
    cap: int = CAP
    held_after: int = HELD_AFTER


def settings_of(asked: argparse.Namespace) -> Settings:
    """What the command line asks for."""
    dem = asked.oracle == "dem"
    seeds, truths = (1, 5) if dem else (20, 200)
    if asked.quick:
        seeds, truths = min(seeds, 2), min(truths, 10)
    seeds = seeds if asked.seeds is None else asked.seeds
    # A run by DEM takes 20 s, on a busy core a minute: two generations of the peers have to do.
    caps = {"cap": 40, "held_after": 16} if dem else {}
    return Settings(asked.oracle, seeds, truths, **caps)


def race_all(known: Map, methods: Sequence[Method], settings: Settings) -> list[dict[str, Any]]:
    """Let every method find every target from every start; a start and its noise are shared."""
    low, high = known.truth.low.tolist(), known.truth.high.tolist()
    mean, _ = known.truth.at(known.points)
    rows = []
    for target in settings.targets:
        if not mean.min() <= target <= mean.max():
            raise NoMapError(
                f"the map has no angle of {target:g} degrees: it goes from {mean.min():.1f} to "
                f"{mean.max():.1f}"
            )

        def miss_of(point: Sequence[float], target: float = target) -> float:
            return abs(known.mean(point) - target)

        for method in methods:
            races = []
            for seed in range(1, settings.seeds + 1):
                problem = problem_of(low, high, target, MEASURED_SD_DEG, known.tolerance, seed)
                noise = 1000 * round(target) + seed
                runs = by_dem(noise) if settings.oracle == "dem" else by_emulator(known, noise)
                races.append(
                    run_race(method, problem, runs, miss_of, settings.cap, settings.held_after)
                )
            found = summarised(method.name, target, races)
            rows += found
            for row in found:
                needed = " ".join("-" if n is None else str(n) for n in row["runs_needed"])
                print(f"{target:g} degrees, {method.name}, {row['guess']}: {needed}", flush=True)
    return rows


def measure(file: Path, methods: Sequence[Method], settings: Settings) -> dict[str, Any]:
    """Measure everything, one after the other.

    Raises
    ------
    NoMapError
        When the map of runs is missing or does not reach a target.
    """
    begun, load = time.perf_counter(), os.getloadavg()[0]
    goes_on = settings.oracle == "dem" and KEPT_RUNS.exists()
    known = read_map(file)
    races = race_all(known, methods, settings) if settings.seeds else []
    truths = planted(known, settings.truths)
    found: dict[str, Any] = {}
    if settings.oracle == "dem":
        maps = {ANGLE: known, SECOND: read_map(file, SECOND)}
        found["dem_truths"] = dem_coverage(maps, truths, rows_by_dem)
    else:
        # coexist states no posterior.
        found["coverage"] = [our_coverage(known, truths)] + [
            peer_coverage(known, method, truths)
            for method in methods
            if method.name == "GrainLearning"
        ]
    origin = provenance(Scenario())
    return {
        "machine": origin["machine"],
        "load_average": load,
        "commit": origin["commit"],
        "versions": origin["versions"],
        "peers": {method.name: method.versions for method in methods if method.versions},
        "map": {
            "file": str(file.relative_to(ROOT)) if file.is_relative_to(ROOT) else file.name,
            "runs": known.truth.runs,
            "replicates": known.replicates,
            "low": known.truth.low.tolist(),
            "high": known.truth.high.tolist(),
        },
        "noise": known.noise(),
        "tolerance_deg": known.tolerance,
        "mean_se_deg": known.mean_se,
        "cap": settings.cap,
        "held_after": settings.held_after,
        "races": races,
        **found,
        "measured_s": round(time.perf_counter() - begun),
        "goes_on": goes_on,
    }


def keep(found: dict[str, Any], oracle: str, path: Path) -> None:
    """Write what was measured beside what is kept of the other oracle."""
    path.parent.mkdir(parents=True, exist_ok=True)
    kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    kept[oracle] = found
    write_text(path, json.dumps(kept, indent=1) + "\n")


def main() -> None:
    """Measure, keep, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--oracle", choices=("emulator", "dem"), default="emulator")
    parser.add_argument("--record", action="store_true", help="the map that docs/results keeps")
    parser.add_argument("--seeds", type=int, help="starts of each method, 0 for none")
    parser.add_argument("--quick", action="store_true", help="few seeds, to see that it works")
    parser.add_argument("--page", action="store_true", help="write the page again, measure nothing")
    parser.add_argument("--peers", type=Path, default=PEERS, help="Python with the peers in it")
    asked = parser.parse_args()
    path, docs = (QUICK / KEPT_JSON.name, QUICK) if asked.quick else (KEPT_JSON, ROOT / "docs")
    if not asked.page:
        settings, file = settings_of(asked), map_file(asked.record)
        try:
            read_map(file)  # told before the peers start
            with ExitStack() as stack:
                peers = [stack.enter_context(closing(peer)) for peer in open_peers(asked.peers)]
                found = measure(file, [Ours(), *peers, Nearest()], settings)
        except (NoMapError, PeerError) as error:
            raise SystemExit(str(error)) from None
        keep(found, asked.oracle, path)
    if not path.exists():
        raise SystemExit(f"{path} is not there: make peers writes it")
    (docs / "calibration_peers.md").write_text(
        page(json.loads(path.read_text(encoding="utf-8"))), encoding="utf-8"
    )
    print(f"The page: {(docs / 'calibration_peers.md').relative_to(ROOT)}")


if __name__ == "__main__":
    main()
