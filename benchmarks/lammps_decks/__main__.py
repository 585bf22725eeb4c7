"""What grains near walls and sorted grains make of the speed of LAMMPS decks.

``make lammps-decks`` runs ``python -m benchmarks.lammps_decks``, which writes
docs/developers/lammps_speed.md.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.frame import Benchmark, BenchmarkRun, render
from benchmarks.lammps_decks.variants import BEFORE, NEAR, VARIANTS
from sandmould import ROOT
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

PARTS_OF_A_RUN = {"fill": "settle_", "shaking": "vibrate_"}


@dataclass(frozen=True)
class DeckExtent:
    """How much is measured."""

    turns: int
    scenes: Mapping[str, tuple[str, dict[str, Any]]]
    """Study, and what is changed in its scenario."""


_LAMMPS = {
    "engine": {"name": "lammps", "ranks": 1},
    "measure_at_rest": False,
    "vibration": [{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.04}],
}
_DISCS = _LAMMPS | {
    "sand": {"size_scale": 3.5, "disc_thickness_m": 0.1},
    "fill": {"layers": [{"count": 1000}], "settling": {"longest_s": 0.22}},
}
_SPHERES = _LAMMPS | {"fill": {"layers": [{"count": 2000}], "settling": {"longest_s": 0.3}}}
_FEW = {"fill": {"layers": [{"count": 60}]}, "rest": {"load_tolerance": 0.5}}
WHOLE = DeckExtent(
    turns=3, scenes={"discs": ("tube_demo", _DISCS), "spheres": ("tube_3d_small", _SPHERES)}
)
LITTLE = DeckExtent(
    turns=1,
    scenes={
        "discs": ("tube_demo", _DISCS | _FEW),
        "spheres": ("tube_3d_small", _SPHERES | _FEW),
    },
)


def scene(study: str, changes: dict[str, Any]) -> Scenario:
    """The first run of a shipped study, changed."""
    run = expand(open_study(ROOT / "config" / "studies" / f"{study}.yaml"))[0]
    given = run.scenario.model_dump(mode="json", exclude_unset=True)
    return Scenario.model_validate(merge(given, changes, Origin(), "benchmark"))


def _run(path: Path, variant: str) -> dict[str, Any]:
    """One run in a process of its own, which no other has warmed."""
    command = [sys.executable, "-m", "benchmarks.lammps_decks.variants", str(path), variant]
    ran = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    found: dict[str, Any] = json.loads(ran.stdout.splitlines()[-1])
    return found


def _ns(run: dict[str, Any], prefix: str) -> float:
    """Processor time of the stages of a name, ns a grain-step."""
    stages = [stage for name, stage in run["stages"].items() if name.startswith(prefix)]
    return 1e9 * sum(s["cpu_s"] for s in stages) / sum(s["grain_steps"] for s in stages)


def _spread(values: list[float]) -> dict[str, float]:
    return {
        "median": round(float(np.median(values)), 3),
        "least": round(min(values), 3),
        "most": round(max(values), 3),
    }


def measure(name: str, run: BenchmarkRun) -> dict[str, Any]:
    """All variants in turns: times a grain-step, and within a turn the ratio of before to each."""
    extent: DeckExtent = run.extent
    scenario = scene(*extent.scenes[name])
    turns = []
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.json"
        path.write_text(scenario.model_dump_json(), encoding="utf-8")
        for turn in range(extent.turns):
            take = partial(lambda at: {v: _run(at, v) for v in VARIANTS}, path)
            turns.append(run.parts.get(f"{name}, turn {turn}", take))
            print(name, turn, {v: round(_ns(r, ""), 1) for v, r in turns[-1].items()}, flush=True)
    whole = {"all": "", **PARTS_OF_A_RUN}
    return {
        "grains": turns[0][BEFORE]["grains"],
        "digits_same": all(t[NEAR]["digest"] == t[BEFORE]["digest"] for t in turns),
        "turns": len(turns),
        "ns": {v: {k: _spread([_ns(t[v], p) for t in turns]) for k, p in whole.items()}
               for v in VARIANTS},
        "ratio": {
            v: {k: _spread([_ns(t[BEFORE], p) / _ns(t[v], p) for t in turns])
                for k, p in whole.items()}
            for v in VARIANTS if v != BEFORE
        },
    }  # fmt: skip


def origin(run: BenchmarkRun) -> dict[str, Any]:
    """Machine, commit and versions."""
    return run.origin


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    return render(Path(__file__).with_name("page.md.j2"), results)


PARTS: dict[str, Callable[[BenchmarkRun], Any]] = {
    "discs": partial(measure, "discs"),
    "spheres": partial(measure, "spheres"),
    "origin": origin,
}
BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts=PARTS,
    pages={"developers/lammps_speed.md": page},
    extent=WHOLE,
    quick=LITTLE,
)

if __name__ == "__main__":
    BENCHMARK.command()
