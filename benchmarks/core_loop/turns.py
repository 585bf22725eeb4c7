"""Steps of one bed in one source tree, turn by turn as lines of standard input ask for them.

``python turns.py TREE BED.npz rest|shaken STEP``: it imports from ``TREE`` alone, so that two trees
can be measured in turns with a step of STEP s. Each line is a number of steps; each answer has the
processor time, s, a file with all places, the greatest speed, m/s, and the farthest way since the
start, m.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ACCELERATION_M_S2 = 1.5 * 9.81


def _solver(tree: Path, bed_file: Path, step_s: float) -> tuple[Any, float]:
    """Solver of a tree with a bed, and the period of the shaking, s."""
    sys.path.insert(0, str(tree))
    beds = importlib.import_module("benchmarks.engines.beds")
    if Path(str(beds.__file__)).parents[2] != tree:
        raise SystemExit(f"{beds.__file__} does not lie in {tree}")
    with np.load(bed_file, allow_pickle=False) as arrays:
        bed = beds.Bed(**{name: a[()] if a.ndim == 0 else a for name, a in arrays.items()})
    return beds.solver_on(bed, time_step={"step_s": step_s}), float(beds.PERIOD_S)


def main(tree: Path, bed_file: Path, motion: str, step_s: float) -> None:
    """Answer each line."""
    solver, period_s = _solver(tree, bed_file, step_s)
    kept = bed_file.with_name(f"places_{os.getpid()}.npy")
    omega = 2.0 * np.pi / period_s

    def places() -> np.ndarray:
        ordered: np.ndarray = solver.grains.position[np.argsort(solver.grains.id)]
        return ordered

    start = places()
    for line in sys.stdin:
        steps = int(line)
        times_s = (solver.steps - 1 + np.arange(steps + 2)) * solver.scene.dt
        grown = np.minimum(1.0, np.maximum(times_s, 0.0) * 4.0 / period_s)
        moved_m = grown * ACCELERATION_M_S2 / omega**2 * np.sin(omega * times_s)
        begun = time.process_time()
        solver.advance(moved_m if motion == "shaken" else np.zeros(steps + 2))
        took_s = time.process_time() - begun
        now = places()
        np.save(kept, now)
        answer = {
            "took_s": took_s,
            "places": str(kept),
            "fastest_m_s": float(np.linalg.norm(solver.grains.velocity, axis=1).max()),
            "farthest_m": float(np.linalg.norm(now - start, axis=1).max()),
            "step_s": solver.scene.dt,
        }
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tree", type=Path)
    parser.add_argument("bed", type=Path)
    parser.add_argument("motion", choices=("rest", "shaken"))
    parser.add_argument("step_s", type=float)
    main(*vars(parser.parse_args()).values())
