"""Which axes of a study's charts are logarithmic."""

from __future__ import annotations

import pandas as pd
import pytest

from sandmould.report.curves import objective_charts, time_chart
from sandmould.statistics.verdict import compare_settings
from tests.answered import ENERGIES_J, HZ, table

MODULUS = "values.modulus_pa"
SPEED = "speed_m_s"


@pytest.mark.parametrize("key", [MODULUS, HZ])
def test_what_spans_decades_is_drawn_on_a_logarithmic_axis(key: str) -> None:
    values = dict(zip((5, 10, 149), ENERGIES_J.values(), strict=True))
    energies_j = ENERGIES_J if key == MODULUS else values
    speeds = dict.fromkeys(energies_j, (1.0, 2.0, 3.0))
    summary = table(key, kinetic_j=energies_j, speed_m_s=speeds).assign(outcome="finished")
    for measure, is_wide in (("kinetic_j", True), (SPEED, False)):
        (chart,) = objective_charts(summary, compare_settings(summary, [key], measure), [key])
        assert (chart.log_x, chart.log_y) == (key == MODULUS, is_wide)
    rows = summary.assign(**{key: summary[key].astype(str) + " x"})
    (chart,) = objective_charts(rows, compare_settings(rows, [key], "kinetic_j"), [key])
    assert (chart.log_x, chart.log_y) == (True, False)


def test_curves_that_end_decades_apart_begin_at_the_foot() -> None:
    summary = table(MODULUS, kinetic_j=ENERGIES_J).assign(outcome="finished")
    curves = pd.DataFrame(
        [
            {
                "run": run,
                "time_s": time_s,
                "kinetic_j": time_s * end_j,
                "stage": "deck",
                "vibration_time_s": float("nan"),
            }
            for run, end_j in zip(summary["run"], summary["kinetic_j"], strict=True)
            for time_s in (0.0, 0.5, 1.0)
        ]
    )
    verdict = compare_settings(summary, [MODULUS], "kinetic_j", "neither")
    chart = time_chart(curves, summary, verdict, [MODULUS], "kinetic_j")
    assert chart is not None
    assert chart.log_y
    assert not chart.log_x
    assert min(line.xy[:, 1].min() for line in chart.lines) == pytest.approx(1.9e-9)
    swinging = curves.assign(kinetic_j=curves["kinetic_j"] - 0.5 * (curves["time_s"] == 0.5))
    chart = time_chart(swinging, summary, verdict, [MODULUS], "kinetic_j")
    assert chart is not None
    assert not chart.log_y
