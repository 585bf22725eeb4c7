"""Which other properties move the top of the fill over frequency: two levels of each, some scenes.

Each scene has one level of each property. The effect of a property is the mean over the scenes with
its second level less the mean over those with its first.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t as student

from benchmarks.frequency_law.series import FREQUENCY, MEASURE
from sandmould import ROOT
from sandmould.scenario.hardness import bed_hardness
from sandmould.study.collect import read_summary
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

Array = NDArray[np.float64]
STUDIES = ("tube_law_screen", "tube_law_screen_more")
"""One design each, with fillings of its own."""
PROPERTIES = {
    "contact.grain_grain.damping_ratio": "damping ratio of grains, 1 to 0.3",
    "background_damping.form": "background damping, by components to none",
    "contact.grain_wall.normal_stiffness_n_m": "springs of walls, four times as hard",
    "contact.grain_wall.friction": "friction of walls, 0.35 to 0.7",
    "contact.grain_grain.friction": "friction of grains, 0.8 to 0.4",
    "vibration.0.duration_s": "duration, 1.5 to 3 s",
    "obstacles.0.axis_height_m": "height of the tube's axis, 35 to 50 mm",
}
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Effects:
    """The effect of each property on one number of a scene."""

    mean: float
    """Over all scenes."""
    effects: dict[str, float]
    half_width: float
    """Of the interval of each effect; NaN where the scenes do not tell it."""
    scenes: int


def screen(records: Path) -> dict[str, Effects] | None:
    """Effects on the top less the low end, less the high end, and on log2 of the top's place."""
    folders = [records / name for name in STUDIES if (records / name / "record.json").is_file()]
    if not folders:
        return None
    study = open_study(ROOT / json.loads((folders[0] / "record.json").read_text())["study"])
    hardness = bed_hardness(expand(study)[0].scenario)
    assert hardness is not None
    return effects_of(pd.concat(map(_fillings, folders)), hardness.column_hz)


def _fillings(folder: Path) -> pd.DataFrame:
    """Runs of a record, their replicates told from those of others."""
    summary = read_summary(folder)
    return summary.assign(replicate=folder.name + summary["replicate"].astype(str))


def effects_of(summary: pd.DataFrame, column_hz: float) -> dict[str, Effects]:
    """The same of runs, one row each; ``column_hz``: c/(4 H)."""
    levels, rows = [], []
    # a level is 0 where the first run has it
    coded = pd.DataFrame({p: (summary[p] != summary[p].iloc[0]).astype(int) for p in PROPERTIES})
    for level, runs in summary.groupby([coded[name] for name in PROPERTIES]):
        fills = runs.pivot(index="replicate", columns=FREQUENCY, values=MEASURE)
        levels.append(level)
        rows.append(
            _contrasts(
                fills.to_numpy(), np.log2(fills.columns.to_numpy(dtype=np.float64) / column_hz)
            )
        )
    design = 2.0 * np.array(levels) - 1.0
    fillings = np.array([row[0] for row in rows])
    ends = {name: _of_fillings(design, fillings[..., n]) for n, name in enumerate(("low", "high"))}
    inner = (fillings.mean(axis=1) > 0.0).all(axis=1)
    return ends | {"place": _of_scenes(design[inner], np.array([row[1] for row in rows])[inner])}


def _contrasts(fills: Array, places: Array) -> tuple[Array, float]:
    """Top less either end of each filling, (n, 2); and the place of the top of their mean.

    The top of a filling is where the *others* have theirs: its own highest value is high by chance.
    """
    ends = []
    for own in range(len(fills)):
        others = np.delete(fills, own, axis=0).mean(axis=0)
        top = 1 + others[1:-1].argmax()
        ends.append(fills[own, top] - fills[own, [0, -1]])
    mean = fills.mean(axis=0)
    top = int(1 + mean[1:-1].argmax())
    curve = np.polyfit(places[top - 1 : top + 2], mean[top - 1 : top + 2], 2)
    vertex = -curve[1] / (2.0 * curve[0]) if curve[0] < 0.0 else places[top]
    return np.array(ends), float(np.clip(vertex, places[top - 1], places[top + 1]))


def _of_fillings(design: Array, values: Array) -> Effects:
    """Effects on means of scenes, (s, n); chance is what fillings of a scene differ by."""
    scenes, fillings = values.shape
    error = np.sqrt(4.0 / scenes * values.var(axis=1, ddof=1).mean() / fillings)
    freedom = scenes * (fillings - 1)
    return _effects(design, values.mean(axis=1), float(error), freedom)


def _of_scenes(design: Array, values: Array) -> Effects:
    """Effects on one number a scene, (s,); chance is what the effects leave of it."""
    if len(values) <= design.shape[1] + 2:
        return Effects(float(values.mean()) if len(values) else np.nan, {}, np.nan, len(values))
    terms = np.column_stack([np.ones(len(values)), design])
    fitted, *_ = np.linalg.lstsq(terms, values)
    freedom = len(values) - terms.shape[1]
    variance = ((values - terms @ fitted) ** 2).sum() / freedom
    error = 2.0 * np.sqrt(variance * np.linalg.pinv(terms.T @ terms).diagonal()[1:].max())
    return _effects(design, values, float(error), freedom)


def _effects(design: Array, values: Array, error: float, freedom: int) -> Effects:
    terms = np.column_stack([np.ones(len(values)), design])
    fitted, *_ = np.linalg.lstsq(terms, values)
    found = dict(zip(PROPERTIES.values(), (2.0 * fitted[1:]).tolist(), strict=True))
    half_width = float(student.ppf(0.5 + CONFIDENCE / 2.0, freedom)) * error
    return Effects(float(values.mean()), found, half_width, len(values))


def told(effects: Effects) -> Sequence[str]:
    """Properties whose effect is more than chance."""
    return [p for p, effect in effects.effects.items() if abs(effect) > effects.half_width]
