"""A study of thousands of runs: what its page draws and lists, and that it says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sandmould.drawing import figures, thinning
from sandmould.drawing.thinning import drawn_note, drawn_part, listed_runs, listed_settings
from sandmould.report.page import write_report
from sandmould.statistics.verdict import Verdict, compare_settings
from sandmould.study.collect import Collected, collect
from tests.unit.report_study import FAILED, write_study

SETTINGS, REPLICATES = 2_000, 5
FAILED_ROWS = (17, 4_711)


@pytest.fixture(scope="module")
def found() -> tuple[Collected, Verdict]:
    """Ten thousand runs, best at the 1500th setting; two of them failed."""
    rng = np.random.default_rng(1)
    setting = np.repeat(np.arange(SETTINGS), REPLICATES)
    summary = pd.DataFrame(
        {
            "run": [f"run_{n}" for n in range(len(setting))],
            "frequency_hz": 20 + 0.04 * setting,
            "replicate": np.tile(np.arange(1, REPLICATES + 1), SETTINGS),
            "outcome_code": 0,
            "outcome": "finished",
            "fill": 1 - np.abs(setting - 1_500) / SETTINGS + rng.normal(0, 1e-5, len(setting)),
        }
    )
    summary.loc[list(FAILED_ROWS), "outcome_code"] = 3
    curves = summary[["run", "fill"]].assign(vibration_time_s=0.0, time_s=0.0)
    collected = Collected(summary, curves, ("frequency_hz",))
    return collected, compare_settings(summary, collected.keys, "fill")


def test_settings_are_drawn_over_the_whole_sweep_with_the_best(
    found: tuple[Collected, Verdict],
) -> None:
    collected, verdict = found
    drawn, part = drawn_part(collected, verdict)
    assert verdict.best in part.settings
    assert verdict.runner_up in part.settings
    assert len(part.settings) <= thinning.MOST_SETTINGS
    assert (part.settings[0], part.settings[-1]) == (verdict.settings[0], verdict.settings[-1])
    assert len(drawn.summary) == len(part.settings) * REPLICATES <= thinning.MOST_RUNS
    assert set(drawn.curves["run"]) == set(drawn.summary["run"])
    # Means are those of all runs.
    assert all(setting in verdict.settings for setting in part.settings)
    assert drawn_note(collected, verdict).startswith(
        f"Charts show {len(part.settings)} of 2000 settings"
    )


def test_failed_runs_are_listed_before_the_best(found: tuple[Collected, Verdict]) -> None:
    collected, verdict = found
    rows = listed_runs(collected.summary, verdict)
    assert len(rows) == thinning.MOST_RUNS
    assert set(FAILED_ROWS) <= set(rows.index)
    assert rows.index.is_monotonic_increasing
    best = rows.drop(index=list(FAILED_ROWS))
    rest = collected.summary.drop(index=rows.index)
    assert best["fill"].min() > rest["fill"].max()
    settings = listed_settings(verdict)
    assert len(settings) == thinning.MOST_SETTINGS
    assert verdict.best in settings
    assert all(abs(s.values["frequency_hz"] - 80) < 3 for s in settings)


def test_page_says_what_it_leaves_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "_PANEL_PX", 60)
    study = write_study(tmp_path / "tube", grains=60, count=5)
    collect(study)
    write_report(study, tmp_path / "whole.html")
    whole = (tmp_path / "whole.html").read_text(encoding="utf-8")
    assert "Every run of the plan" in whole
    assert "Charts show" not in whole
    monkeypatch.setattr(thinning, "MOST_RUNS", 4)
    monkeypatch.setattr(thinning, "MOST_SETTINGS", 2)
    write_report(study, tmp_path / "part.html")
    part = (tmp_path / "part.html").read_text(encoding="utf-8")
    assert "Listed are 4 of 9 runs" in part
    assert "Listed are 2 of 3 settings" in part
    assert "Charts show 2 of 3 settings" in part
    assert f">{FAILED}</a>" in part
    assert len(part) < len(whole)
