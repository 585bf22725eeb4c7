"""The numbers that a reader looks for first."""

from __future__ import annotations

import pandas as pd

from sandmould.report.tables import key_numbers
from sandmould.runs.columns import CROSS_CHECK, OUTCOME_CODE, PART, SWEEP
from sandmould.statistics.verdict import compare_settings

KEY = "vibration.0.frequency_hz"


def summary(of_bed: float | None) -> pd.DataFrame:
    """Two frequencies with two fillings each, and a cross check that must not count."""
    rows = [
        {KEY: hz, "replicate": r, "seed": r, PART: part, OUTCOME_CODE: 0,
         "tube_fill_fraction": fill + 0.01 * r, "tube_fill_of_bed_fraction": share}
        for hz, part, fill, share in (
            (25.0, SWEEP, 0.4, 0.5), (50.0, SWEEP, 0.6, of_bed), (50.0, CROSS_CHECK, 0.1, 0.1),
        )
        for r in (1, 2)
    ]  # fmt: skip
    table = pd.DataFrame(rows)
    return table if of_bed is not None else table.drop(columns="tube_fill_of_bed_fraction")


def texts(of_bed: float | None) -> list[tuple[str, str]]:
    table = summary(of_bed)
    verdict = compare_settings(table[table[PART] == SWEEP], [KEY], "tube_fill_fraction")
    return [(each.value, each.label) for each in key_numbers(table, verdict)]


def test_fill_stands_as_a_share_of_what_fits_at_the_best_setting() -> None:
    best, share, *_ = texts(0.81)
    assert best[1] == "fill of the tube, 50 Hz"
    assert share == ("81 %", "of what fits in, 50 Hz: the tube as dense as the bed is 100 %")


def test_results_without_that_measure_have_no_such_number() -> None:
    assert not any("what fits" in label for _, label in texts(None))
