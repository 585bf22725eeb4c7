"""The cheapest setting that agrees with the dearest, on planted runs."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from benchmarks.agreement.recorded import Recorded
from benchmarks.agreement.repose_settings import Factor, factors_of
from sandmould.kinds.sand.kind import SandStudy
from sandmould.study.collect import compare_study

KEY = "time_step.fraction"


def factor(angles: dict[float, float], cost: dict[float, float]) -> Factor:
    """Eight heaps a value, of which one failed."""
    noise = np.random.default_rng(3)
    rows = [
        {KEY: value, "replicate": r, "seed": r, "outcome_code": 0, "cpu_s": cost[value],
         "heap_angle_deg": angle + float(noise.normal(0, 0.3))}
        for value, angle in angles.items() for r in range(1, 9)
    ]  # fmt: skip
    rows[0] |= {"outcome_code": 310, "heap_angle_deg": np.nan}
    summary = pd.DataFrame(rows)
    study = SandStudy.model_validate(
        {
            "sweep": {"keys": {KEY: list(angles)}},
            "equivalence": {"keys": [KEY], "margins": {"heap_angle_deg": 1.5}},
        }
    )
    recorded = Recorded(
        "planted", "Does it?", 8, {"commit": "abc", "machine": {"processor": "one"}}, (KEY,),
        compare_study(summary, (KEY,), study), (),
    )  # fmt: skip
    (found,) = factors_of(recorded, summary, recorded.keys)
    return found


def test_the_cheapest_that_agrees_is_found_past_one_that_does_not() -> None:
    found = factor(
        {0.2: 30.0, 0.4: 30.1, 0.8: 29.8, 1.6: 25.0}, {0.2: 80, 0.4: 40, 0.8: 20, 1.6: 10}
    )
    assert found.dearest.label == "fraction 0.2"
    assert (found.dearest.runs, found.failed) == (7, 1)
    assert found.cheapest is not None
    assert found.cheapest.label == "fraction 0.8"
    assert found.saving == pytest.approx(4.0)
    worst = found.levels[-1]
    assert worst.against.startswith("different: 4.")


def test_where_none_agrees_nothing_is_saved() -> None:
    found = factor({0.2: 30.0, 0.8: 27.0}, {0.2: 10, 0.8: 20})
    assert found.dearest.label == "fraction 0.8"
    assert found.cheapest is None
    assert found.saving == 1.0
    # The dearest minus this one, whichever came first in the sweep.
    assert found.levels[1].against.startswith("different: −3.")
