"""The first mode of the bed beside a frequency, and grains too soft beside the verdict."""

from __future__ import annotations

import html
import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sandmould.report.bed_mode import BedMode, bed_mode
from sandmould.report.page import write_report
from sandmould.study.collect import collect
from tests.unit.report_study import scenario, write_study


def test_a_frequency_over_the_measured_mode() -> None:
    mode = BedMode(0.09, 128.0, 300.0)
    assert mode.is_measured
    assert mode.beside(60.0) == (
        "60 Hz is 0.20 times the bed's own first mode, measured by a small shake at 300 Hz."
    )
    # 4 H f = 4 x 0.09 x 300
    assert mode.wave_speed.speed_m_s == pytest.approx(108.0)
    assert "measured" in mode.wave_speed.how


def test_a_frequency_over_the_estimate_is_named_as_one() -> None:
    mode = BedMode(0.08, 128.0, math.nan)
    assert mode.estimate_hz == pytest.approx(400.0)
    assert mode.beside(100.0) == (
        "100 Hz is 0.25 times c/(4 H) = 400 Hz at the measured depth H of 80 mm. This is only an "
        "estimate of the lowest frequency at which the bed swings by itself. No small shake has "
        "measured it."
    )
    assert mode.wave_speed.speed_m_s == 128.0
    assert "estimate" in mode.wave_speed.how


def test_the_mode_is_the_mean_of_the_fillings_that_show_one() -> None:
    shaken = np.geomspace(50.0, 400.0, 7)
    peaked = np.array([1.0, 1.0, 1.5, 2.0, 1.5, 1.0, 0.5])
    flat = np.linspace(1.0, 0.1, 7)
    summary = pd.DataFrame({"bed_height_m": [0.08, 0.09, np.nan, 0.085]})
    found = bed_mode(scenario(50.0), summary, [(shaken, peaked), (shaken, flat)])
    assert found is not None
    assert found.depth_m == pytest.approx(0.085)
    assert found.measured_hz == pytest.approx(shaken[3])
    silent = bed_mode(scenario(50.0), summary, [(shaken, flat)])
    assert silent is not None
    assert not silent.is_measured
    bare = bed_mode(scenario(50.0), pd.DataFrame())
    assert bare is not None
    assert (bare.depth_is, found.depth_is) == ("planned", "measured")
    assert bare.depth_m == pytest.approx(0.0935, rel=0.01)
    still = scenario(50.0).model_copy(update={"vibration": ()})
    assert bed_mode(still, summary) is None


def said_beside_the_verdict(folder: Path) -> str:
    collect(folder)
    write_report(folder, folder / "report.html")
    text = (folder / "report.html").read_text(encoding="utf-8")
    there = text[text.index('class="verdict') : text.index('id="scene"')]
    return html.unescape(re.sub(r"<[^>]+>", "", there)).replace("\xa0", " ")


@pytest.mark.slow
def test_grains_too_soft_are_told_beside_the_verdict(tmp_path: Path) -> None:
    folder = write_study(tmp_path / "overlaps", count=8, grains=60)
    hard = said_beside_the_verdict(folder)
    assert "too soft" not in hard
    assert "50 Hz is 0.13 times c/(4 H) = 389 Hz at the measured depth H of " in hard
    for path in folder.glob("runs/*/measures.tsv"):
        measures = pd.read_csv(path, sep="\t")
        measures.assign(overlap_p99_fraction=0.081).to_csv(path, sep="\t", index=False)
    soft = said_beside_the_verdict(folder)
    assert "one contact in a hundred is deeper than 8.1 % of a radius" in soft
