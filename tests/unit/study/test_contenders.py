"""Rounds of replicates: who gets them, when they end, and what the report may then say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from sandmould.bad_input import BadInputError
from sandmould.definition.study import Study
from sandmould.statistics.verdict import Verdict, compare_settings
from sandmould.study.plan.load_study import open_study
from sandmould.study.rounds.contenders import find_contenders
from sandmould.study.rounds.decide import decision_text, next_replicates
from sandmould.study.rounds.round_log import RoundLog

FREQUENCY, FILL = "vibration.0.frequency_hz", "tube_fill_fraction"
HZ = (15.0, 25.0, 40.0, 65.0, 100.0, 150.0)
PEAK = {15.0: 0.50, 25.0: 0.50, 40.0: 0.50, 65.0: 0.62, 100.0: 0.60, 150.0: 0.50}
STUDY: dict[str, Any] = {
    "based_on": "tube",
    "scenario": {"engine": {"name": "reference"}},
    "sweep": {"keys": {FREQUENCY: list(HZ)}},
    "replicates": 2,
    "refine": {"adds": "replicates", "rounds": 6, "runs": 6},
}


def opened(folder: Path, **changes: Any) -> Study:
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(STUDY | changes), encoding="utf-8")
    return open_study(path).study


def race(
    study: Study, means: dict[float, float], sd: float, seed: int
) -> tuple[pd.DataFrame, RoundLog]:
    """All runs of a study whose fills are planted: those of the sweep, then round after round."""
    noise = np.random.default_rng(seed)

    def row(frequency_hz: float, replicate: int) -> dict[str, Any]:
        value = means[frequency_hz] + noise.normal(0.0, sd)
        return {FREQUENCY: frequency_hz, "replicate": replicate, "seed": replicate,
                "outcome_code": 0, "cpu_s": 36.0, FILL: value}  # fmt: skip

    rows = [row(f, r) for f in HZ for r in range(1, study.replicates + 1)]
    log = RoundLog("basis")
    while not log.ended:
        done = len(log.rounds)
        log = next_replicates(log, study, pd.DataFrame(rows), [FREQUENCY])
        rows += [row(p[FREQUENCY], r) for entry in log.rounds[done:] for p, r in entry.runs]
    return pd.DataFrame(rows), log


def judged(study: Study, runs: pd.DataFrame) -> Verdict:
    return compare_settings(runs, [FREQUENCY], FILL, "larger")


def test_settings_that_are_ruled_out_get_no_more_runs(tmp_path: Path) -> None:
    runs, log = race(opened(tmp_path), PEAK, sd=0.01, seed=1)
    many = runs.groupby(FREQUENCY).size()
    assert many[[15.0, 25.0, 40.0, 150.0]].tolist() == [2, 2, 2, 2]
    assert many[65.0] == many[100.0] > 2
    assert log.ended == "One setting is left: all others are ruled out."
    assert not runs.duplicated([FREQUENCY, "replicate"]).any()


def test_replicates_where_it_matters_cost_less_than_everywhere(tmp_path: Path) -> None:
    # The same half width of the interval between the two best settings, all compared alike.
    # Over 60 seeds rounds took 24.3 runs for 0.031; 36 runs, six everywhere, gave 0.038.
    study = opened(tmp_path, refine=STUDY["refine"] | {"half_width": 0.03, "rounds": 20})
    everywhere = opened(tmp_path, replicates=6, refine={**STUDY["refine"], "runs": 1})
    in_rounds, wide = [], []
    for seed in range(4):
        runs, _ = race(study, PEAK, sd=0.02, seed=seed)
        contenders = find_contenders(runs, study, [FREQUENCY])
        assert contenders is not None
        decided = len(contenders.points) == 1
        assert decided or contenders.half_width <= 0.03
        in_rounds.append(len(runs))
        noise = np.random.default_rng(seed)
        full = pd.DataFrame(
            {FREQUENCY: f, "replicate": r, "outcome_code": 0, FILL: PEAK[f] + noise.normal(0, 0.02)}
            for f in HZ for r in range(1, 7)
        )  # fmt: skip
        low, high = judged(everywhere, full).ci
        wide.append((high - low) / 2)
    assert np.mean(in_rounds) < 0.75 * 36
    assert np.mean(wide) > 0.028


def test_equal_settings_are_seldom_called_different(tmp_path: Path) -> None:
    # At most 5 % of studies may be resolved. Of 200 (seeds 0 to 199, eight settings) none was.
    study = opened(tmp_path)
    equal = dict.fromkeys(HZ, 0.5)
    resolved = [judged(study, race(study, equal, 0.03, seed)[0]).resolved for seed in range(10)]
    assert sum(resolved) <= 1


def test_replicates_that_are_missing_come_first(tmp_path: Path) -> None:
    study = opened(tmp_path)
    rows = [
        {FREQUENCY: f, "replicate": r, "outcome_code": 0, FILL: 0.5 + 0.01 * ((7 * r + i) % 5)}
        for i, f in enumerate(HZ) for r in range(1, 3 + (f > 60.0))
    ]  # fmt: skip
    contenders = find_contenders(pd.DataFrame(rows), study, [FREQUENCY])
    assert contenders is not None
    assert {(p[FREQUENCY], r) for p, r in contenders.more(6)} == {(15.0, 3), (25.0, 3), (40.0, 3)}
    assert len(contenders.more(2)) == 2


def test_the_spread_that_all_share_is_that_of_an_analysis_of_variance(tmp_path: Path) -> None:
    # Worked by hand: the second replicate adds 0.2, 0 and 0.2. Squares round their mean of 0.4/3,
    # half of them in each replicate: (2 (0.2/3)^2 + (0.4/3)^2)/2 = 0.04/3 over (3 - 1)(2 - 1).
    values = {15.0: (0.4, 0.6), 25.0: (0.5, 0.5), 40.0: (0.7, 0.9)}
    rows = [
        {FREQUENCY: f, "replicate": r, "outcome_code": 0, FILL: v}
        for f, pair in values.items() for r, v in enumerate(pair, start=1)
    ]  # fmt: skip
    verdict = judged(opened(tmp_path), pd.DataFrame(rows))
    nearest = verdict.comparisons[0]
    assert nearest.difference == pytest.approx(0.3)
    # Of the studentized range of 3 means and 2 degrees of freedom 8.3308 holds 95 % (tables).
    assert (nearest.ci[1] - nearest.ci[0]) / 2 == pytest.approx(
        8.3308 / 2**0.5 * (0.04 / 3 / 2) ** 0.5, rel=1e-4
    )


def test_the_decision_is_told(tmp_path: Path) -> None:
    study = opened(tmp_path)
    rows = [
        {FREQUENCY: f, "replicate": r, "outcome_code": 0, FILL: PEAK[f] + 0.004 * (-1) ** (r + i)}
        for i, f in enumerate(HZ) for r in (1, 2)
    ]  # fmt: skip
    log = next_replicates(RoundLog("basis"), study, pd.DataFrame(rows), [FREQUENCY])
    assert decision_text(log, study) == (
        "Round 1 of at most 6: best so far is 65 Hz; 2 more runs of settings that are not ruled "
        "out."
    )


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"replicates": 1}, r"replicates = 1 .* at least 2 where refine.adds is replicates"),
        (
            {"refine": STUDY["refine"] | {"interval": {FREQUENCY: 9.0}}},
            r"refine.interval = .* absent where refine.adds is replicates",
        ),
        (
            {"refine": {"rounds": 2, "half_width": 0.02}},
            r"refine.half_width = 0.02 .* absent unless refine.adds is replicates",
        ),
        ({"refine": {"half_width": 0.02}}, r"refine.rounds = 0 .* at least 1 where refine"),
        (
            {"sweep": {"keys": {FREQUENCY: [50.0]}}},
            r"sweep = '1 point' .* two points or more where refine.adds is replicates",
        ),
    ],
)
def test_what_cannot_be_done_is_told(tmp_path: Path, changes: dict[str, Any], told: str) -> None:
    with pytest.raises(BadInputError, match=told):
        opened(tmp_path, **changes)
