"""Words of the sand sections: which run is pictured, and how the density changed."""

from __future__ import annotations

import pandas as pd
import pytest

from sandmould.report.sand import _density_conclusion, _role_text
from sandmould.statistics.verdict import Verdict, compare_settings

FILL = "tube_fill_fraction"


def _judged() -> tuple[Verdict, pd.DataFrame]:
    table = pd.DataFrame({"run": ["a", "b"], "f_hz": [25.0, 50.0], FILL: [0.3, 0.5],
                          "outcome_code": [0, 0]})  # fmt: skip
    return compare_settings(table, ["f_hz"], FILL), table


@pytest.mark.parametrize(
    ("role", "said"),
    [
        ("best", "the one with the highest fill of the tube of all single runs"),
        ("worst", "the one with the lowest fill of the tube of all single runs"),
        ("median", "the one in the middle by the fill of the tube of single runs"),
    ],
)
def test_a_pictured_run_is_told_by_its_value(role: str, said: str) -> None:
    verdict, table = _judged()
    assert _role_text(role, verdict, table) == said


@pytest.mark.parametrize(
    ("densities", "said"),
    [((1791.2, 1790.9), "stayed at 1\u202f791 kg"), ((1791.0, 1700.0), "fell from 1\u202f791 to")],
)
def test_a_density_that_shows_no_change_stayed(densities: tuple[float, float], said: str) -> None:
    assert said in _density_conclusion(densities)
