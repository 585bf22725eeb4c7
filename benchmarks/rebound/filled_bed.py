"""The tube's bed with corrected and with plain dashpots, in pairs of equal starts."""

from __future__ import annotations

from typing import Any

import pandas as pd

from benchmarks.frame.shaken import shaken
from sandmould import ROOT
from sandmould.kinds.sand.measure import measure_snapshot
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.equivalence import agree
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

STUDY = ROOT / "config" / "studies" / "tube_demo.yaml"
CHANGES: dict[str, Any] = {
    "sand": {"size_scale": 10, "disc_thickness_m": 0.1},
    "vibration": [{"frequency_hz": 50, "acceleration_g": 1.5, "duration_s": 0.3}],
}
DASHPOTS = ("corrected", "plain")
FRACTIONS = (0.5, 0.25)
"""Time steps over the planned one: the default, and a finer one."""
MARGINS = {
    "solid_fraction": 0.005,
    "tube_fill_fraction": 0.03,
    "coordination_bearing": 0.1,
    "bed_height_m": 0.002,
}
"""Set before the runs; the first three are those of all studies of a filled box."""


def _scenario(dashpot: str, fraction: float, seed: int) -> Scenario:
    base = expand(open_study(STUDY))[0].scenario
    changes = CHANGES | {
        "contact": {"dashpot": dashpot},
        "time_step": {"fraction": fraction, "bed_fraction": 0},
        "seed": seed,
    }
    return Scenario.model_validate(
        merge(base.model_dump(exclude_none=True), changes, Origin(), "filled bed")
    )


def setting(dashpot: str, fraction: float) -> str:
    """Name of a setting among the beds."""
    return f"{dashpot}, {fraction:g}"


def bed(seed: int) -> dict[str, dict[str, float]]:
    """Fill and shake a bed with each setting, and measure it at rest."""
    rows = {}
    for fraction in FRACTIONS:
        for dashpot in DASHPOTS:
            scenario = _scenario(dashpot, fraction, seed)
            row = measure_snapshot(scenario, shaken(scenario))
            rows[setting(dashpot, fraction)] = {n: round(float(row[n]), 6) for n in MARGINS}
    return rows


def compared(beds: list[dict[str, dict[str, float]]]) -> list[dict[str, Any]]:
    """Judge pairs of settings, a row a measure and pair."""
    pairs = [(setting("corrected", f), setting("plain", f)) for f in FRACTIONS]
    pairs += [(setting(d, FRACTIONS[0]), setting(d, FRACTIONS[1])) for d in DASHPOTS]
    found = []
    for name, margin in MARGINS.items():
        for both in pairs:
            first, second = (pd.Series([rows[key][name] for rows in beds]) for key in both)
            agreed = agree(first, second, margin)
            found.append({"measure": name, "settings": both, "agreed": agreed})
    return found
