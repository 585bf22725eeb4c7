"""What coarser grains foretell for finer ones, held against finer runs of ten recorded scenes."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould import ROOT
from sandmould.runs.formatting import FILL
from sandmould.statistics.grain_change import GrainChange

SCENE = ["contact.wave_speed_m_s", "box", "obstacles", "vibration"]
SCALE = "sand.size_scale"
Fills = dict[float, NDArray[np.float64]]


def fills(study: str) -> dict[tuple[str, ...], Fills]:
    """Fill of the one space of each scene, by the size of its grains."""
    summary = pd.read_csv(ROOT / "docs" / "results" / study / "summary.tsv", sep="\t")
    fill = summary[[c for c in summary if c.endswith(FILL)]].bfill(axis=1).iloc[:, 0]
    scenes: dict[tuple[str, ...], Fills] = {}
    for (*scene, scale), values in fill.groupby([summary[c].astype(str) for c in (*SCENE, SCALE)]):
        assert values.notna().all()
        scenes.setdefault(tuple(scene), {})[float(scale)] = values.to_numpy()
    return scenes


def test_nine_of_ten_bands_hold_the_finer_run() -> None:
    """Half widths of at most 0.06; two scenes scatter so much that they need 32 fillings."""
    told = fills("grain_scenes") | fills("grain_scenes_more")
    finer = fills("grain_scenes_finer")
    assert len(told) == len(finer) == 10
    held = 0
    for scene, sizes in told.items():
        own, coarser = (sizes[scale] for scale in sorted(sizes))
        low, high = GrainChange({}, "", own, coarser).finer
        assert 0.5 * (high - low) <= 0.06
        (values,) = finer[scene].values()
        held += low <= values.mean() <= high
    assert held >= 9
