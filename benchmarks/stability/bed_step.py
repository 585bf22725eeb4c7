"""Paired fillings: whether the step of the bed changes what is asked of a filled and shaken box."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import pandas as pd
import yaml

from benchmarks.frame import SCRATCH
from sandmould import ROOT
from sandmould.study.collect import read_summary

MARGINS = {"solid_fraction": 0.005, "tube_fill_fraction": 0.03}
TIMES = (8, 16, 24, 32)
"""Fillings, of which there are more until the intervals lie inside the margins."""


def _shaken(g: float, frequency_hz: float, duration_s: float) -> list[dict[str, Any]]:
    return [{"acceleration_g": g, "frequency_hz": frequency_hz, "duration_s": duration_s}]


_SPHERES: dict[str, Any] = {
    "contact": {"wave_speed_m_s": 40, "grain_grain": {"friction": 0.2}},
    "fill": {"layers": [{"count": 500, "repeat": 2}]},
}
SCENES: dict[str, tuple[str, float, dict[str, Any]]] = {
    "equal spheres, 1.5 g": ("tube_3d_small", 1.928e-5, _SPHERES | {
        "sand": {"size_classes": 1}, "vibration": _shaken(1.5, 50, 0.4)}),
    "spheres of three sizes, 8 g": ("tube_3d_small", 9.09e-6, _SPHERES | {
        "vibration": _shaken(8, 50, 0.3)}),
    "discs, 1.5 g": ("tube", 4.381e-6, {
        "sand": {"size_scale": 6}, "contact": {"wave_speed_m_s": 50},
        "vibration": _shaken(1.5, 50, 0.5)}),
}  # fmt: skip
"""A shipped study or scene, the other step in s, and what differs: gently shaken, hard shaken, in
2D. The other step was the default before: half of a step planned with six contacts a disc, twelve a
sphere."""


def _study(scene: str, times: int) -> dict[str, Any]:
    based_on, step_s, scenario = SCENES[scene]
    default = {"engine": {"name": "reference"}, "time_step": {"fraction": 0.7}}
    return {
        "based_on": based_on,
        "scenario": scenario | default,
        "sweep": {"keys": {"time_step.step_s": [step_s, None]}},
        "replicates": times,
        "objective": {"better": "neither"},
        "equivalence": {"keys": ["time_step.step_s"], "margins": MARGINS},
    }


def paired_fillings(scene: str) -> dict[str, Any]:
    """Fill and shake in pairs of one seed, with the step of the bed and with the other one."""
    folder = SCRATCH / "bed_step"
    study = folder / f"{scene.replace(', ', '_').replace(' ', '_').replace('.', 'p')}.yaml"
    folder.mkdir(parents=True, exist_ok=True)
    row: dict[str, Any] = {"scene": scene}
    for times in TIMES:
        study.write_text(yaml.safe_dump(_study(scene, times)), encoding="utf-8")
        command = [sys.executable, "-m", "sandmould.cli", "run", study.name, "--cores", "1"]
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        subprocess.run(command, cwd=folder, env=environment, check=False)  # overlaps may stop one
        results = folder / "results" / study.stem
        compared = pd.read_csv(results / "agreement.tsv", sep="\t").set_index("measure")
        row["pairs"] = times
        row |= {m: [*compared.loc[m, ["difference", "ci_low", "ci_high"]]] for m in MARGINS}
        if (compared.verdict == "equivalent").all():
            break
    runs = read_summary(results)
    runs = runs[runs.outcome == "finished"]
    fine, of_bed = (runs[runs.bed_limit_s.isna() == lacks] for lacks in (True, False))
    steps = {name: float(each.steps.mean()) for name, each in (("fine", fine), ("bed", of_bed))}
    return row | {
        "grains": int(runs.grains.max()),
        "steps": steps,
        "shaken_steps_over": float(of_bed.time_step_s.mean() / fine.time_step_s.mean()),
        "least_over_step": float((of_bed.least_limit_s / of_bed.time_step_s).min()),
        "largest_overlap": [float(each.largest_overlap_fraction.max()) for each in (fine, of_bed)],
    }
