"""Limits in 1/kappa in the report: of a sweep over hardness alone, of a measure that has one."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sandmould.report.hard_limit_text import hard_limit_text
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.verdict import compare_settings
from tests.unit.report_study import scenario

KEY = "sand.disc_thickness_m"
THICKNESS_M = (0.1, 0.05, 0.025, 0.0125)


def scene(thickness_m: float) -> Scenario:
    base = scenario(50.0)
    sand = base.sand.model_copy(update={"disc_thickness_m": thickness_m})
    return base.model_copy(update={"sand": sand})


def kappa(thickness_m: float) -> float:
    found = bed_hardness(scene(thickness_m))
    assert found is not None
    return found.kappa_bed


def said(measure: str, key: str = KEY, levels: tuple[float, ...] = THICKNESS_M) -> str:
    noise = np.random.default_rng(1)
    table = pd.DataFrame(
        [
            {key: b, "replicate": r, "outcome_code": 0,
             measure: 0.82 + 8.0 / kappa(b) + noise.normal(0.0, 0.001)}
            for b in levels for r in range(1, 5)
        ]
    )  # fmt: skip
    verdict = compare_settings(table, [key], measure, "neither")
    by_setting = {s.label: scene(b) for s, b in zip(verdict.settings, sorted(levels), strict=True)}
    return hard_limit_text(verdict, [key], by_setting)


def test_packing_is_extrapolated_with_its_interval() -> None:
    # Thickness halves, kappa doubles: 398, 796, 1592, 3184 with the tube's bed.
    text = said("solid_fraction").replace("\u202f", "")
    assert text.startswith("The limit of the solid fraction for hard grains, 1/kappa = 0, is 0.82")
    assert text.endswith("(95 % interval), by a line through 4 levels of kappa, 398 to 3180.")


def test_three_levels_say_why_there_is_none() -> None:
    text = said("heap_angle_deg", levels=THICKNESS_M[:3])
    assert text.endswith("cannot be told: fewer than 4 levels of kappa with a mean and its error.")


@pytest.mark.parametrize(
    ("measure", "key"),
    [("tube_fill_fraction", KEY), ("solid_fraction", "contact.grain_grain.friction")],
)
def test_fills_and_other_sweeps_have_none(measure: str, key: str) -> None:
    assert said(measure, key) == ""
