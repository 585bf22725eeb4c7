"""The map of verdicts beside predicted limits, from a summary made up by hand."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from sandmould.pattern_fe.coupling.loop_verdict import State
from sandmould.report.bending_figures import FACTOR, LIMIT, MODULUS, SCHEME, coupling_map
from sandmould.study.collect import Collected

WINDOW = "pattern.loop.window_s"
STATES: dict[str, State] = {
    "a": "holds", "b": "cycles", "c": "lags", "d": "diverged", "e": "one way", "f": "holds"
}  # fmt: skip


def collected(keys: tuple[str, ...], **columns: Any) -> Collected:
    """Two runs below the limit and two above it that can be judged, and three that cannot.

    The limit is that of the last snapshot.
    """
    summary = pd.DataFrame(
        {
            "run": ["a", "b", "c", "d", "e", "f", "g"],
            MODULUS: [1e6, 1e6, 1e7, 1e7, 1e6, 1e6, 1e6],
            FACTOR: [0.01, 0.01, 0.5, 0.5, 0.5, 0.01, 0.5],
            WINDOW: [0.001, 0.001, 0.001, 0.001, 0.004, 0.004, 0.004],
            LIMIT: [0.1, 0.1, 0.2, 0.2, 0.1, float("nan"), 0.1],
        }
    ).assign(**columns)
    curves = pd.concat([summary.assign(**{LIMIT: 2.0 * summary[LIMIT]}), summary])
    return Collected(summary.drop(columns=LIMIT), curves, keys)


def test_right_and_wrong_predictions_are_counted() -> None:
    found = coupling_map(collected((MODULUS, FACTOR, WINDOW)), STATES)
    assert found is not None
    assert found["picture"].startswith("data:image/png")
    assert found["sentence"] == (
        "The limit predicted before the runs is right in 2 of 4: 1 called safe that cycle or "
        "diverge and 1 called unsafe that hold or lag."
    )


def test_only_fixed_shares_are_counted() -> None:
    schemes = ["fixed", "aitken", "fixed", "fixed", "fixed", "fixed", "fixed"]
    found = coupling_map(collected((MODULUS, FACTOR, SCHEME), **{SCHEME: schemes}), STATES)
    assert found is not None
    assert found["sentence"].startswith(
        "The limit predicted before the runs is right in 2 of 3: 1 "
    )


@pytest.mark.parametrize("keys", [(MODULUS, WINDOW), (FACTOR,)])
def test_without_modulus_and_share_there_is_no_map(keys: tuple[str, ...]) -> None:
    assert coupling_map(collected(keys), STATES) is None


def test_runs_that_nobody_can_judge_make_no_map() -> None:
    assert coupling_map(collected((MODULUS, FACTOR)), {}) is None
    unknown = {LIMIT: float("nan")}
    assert coupling_map(collected((MODULUS, FACTOR), **unknown), STATES) is None
