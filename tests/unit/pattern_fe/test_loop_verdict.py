"""Whether a loop holds, on convergence logs made up for each answer."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sandmould.pattern_fe.coupling.loop_verdict import LoopVerdict, classify_loop, study_sentence

WINDOWS = 200


def convergence_log(**columns: object) -> pd.DataFrame:
    """Sand that has bent the pattern by 10 mm and given it what it stores."""
    time_s = 0.01 * np.arange(1, WINDOWS + 1)
    share = np.minimum(1.0, time_s)
    return pd.DataFrame(
        {
            "time_s": time_s, "factor": 0.02, "residual_m": 1e-4, "displacement_m": 0.01 * share,
            "load_n": 5.0 * share, "work_j": 0.02 * share**2, "energy_j": 0.02 * share**2,
        }
    ).assign(**columns)  # fmt: skip


def judged(**columns: object) -> LoopVerdict:
    found = classify_loop(convergence_log(**columns))
    assert found is not None
    return found


def test_a_loop_whose_answer_is_what_the_sand_saw_holds() -> None:
    found = judged()
    assert found.state == "holds"
    assert found.residual_fraction == pytest.approx(0.01)
    # Shown is 1 % short of the answer: twice that of the energy is not yet in it.
    assert found.made_j == pytest.approx(0.0, abs=0.021 * 0.02)
    assert found.sentence == (
        "Holds: the sand saw the pattern where its loads bend it; in the last 0.2 s a residual of "
        "1 % of the displacement."
    )


def test_work_lost_on_the_way_is_no_fault() -> None:
    assert judged(work_j=0.05).state == "holds"


def test_what_contact_took_of_the_work_is_not_in_the_foam() -> None:
    assert judged(work_j=0.03, contact_j=0.01).made_j == pytest.approx(judged().made_j, rel=0.1)
    # A floor that gave the energy would be a fault as any other.
    assert judged(work_j=0.02, contact_j=0.01).state == "cycles"


def test_only_the_last_part_counts() -> None:
    early = np.where(np.arange(WINDOWS) < 150, 0.1, 1e-4)
    assert judged(residual_m=early).state == "holds"


def test_a_surface_that_comes_too_late_lags() -> None:
    found = judged(residual_m=0.004, work_j=0.03)
    assert found.state == "lags"
    assert "40 % of the displacement" in found.sentence


def test_no_shape_of_a_loop_that_lags_is_called_right() -> None:
    # By per layer a bed comes to rest on a surface that the last loads never moved.
    told = judged(residual_m=0.0118, work_j=0.03)
    assert told.state == "lags"
    assert told.sentence.startswith(
        "Lags: the sand saw the pattern elsewhere than its loads bend it, so the shape is no answer"
    )
    assert "rest only" not in told.sentence


def test_a_surface_that_never_moved_does_not_hold() -> None:
    told = judged(displacement_m=0.0, residual_m=0.01, work_j=0.0)
    assert told.state == "lags"
    assert "loads and no motion of the surface" in told.sentence


def test_a_pattern_stepped_with_the_grains_swings_and_is_not_late() -> None:
    told = judged(residual_m=0.0027, kinetic_j=1e-4, work_j=0.03)
    assert told.state == "lags"
    assert "still swings about where its loads bend it" in told.sentence
    assert "a swing of 27 % of the displacement" in told.sentence
    # Without residuals kinetic energy tells the swing: T = a^2 U / 2 in the mean, a = 0.2.
    stepped = convergence_log(kinetic_j=0.5 * 0.2**2 * 0.02).drop(columns=["residual_m", "factor"])
    found = classify_loop(stepped.rename(columns={"energy_j": "elastic_j"}).assign(work_j=0.03))
    assert found is not None
    assert found.residual_fraction == pytest.approx(0.2, rel=0.06)
    assert found.state == "lags"


def test_a_spike_is_told() -> None:
    spike = np.where(np.arange(WINDOWS) == WINDOWS - 5, 0.012, 1e-4)
    found = judged(residual_m=spike)
    assert (found.state, found.spikes) == ("lags", 1)


@pytest.mark.parametrize(
    ("residual_m", "state", "told"), [(0.004, "cycles", "0.039"), (0.012, "diverged", "0.033")]
)
def test_a_loop_that_gives_energy_shakes_the_sand(residual_m: float, state: str, told: str) -> None:
    found = judged(residual_m=residual_m, work_j=-0.03 * np.arange(WINDOWS) / WINDOWS)
    assert found.state == state
    shown_j = 0.02 / (1.0 + residual_m / 0.01) ** 2
    assert found.made_j == pytest.approx(shown_j + 0.03 * 0.95, rel=0.01)
    assert f"{told} J that no sand gave beside 0.02 J in the foam" in found.sentence


def test_a_loop_far_from_its_answer_lags_and_gives_nothing() -> None:
    # Shown is a fifth of the answer: sand has done 2/5 of the work that the answer stores.
    found = judged(residual_m=0.04, work_j=0.4 * 0.02)
    assert found.state == "lags"
    assert found.made_j < 0.0


def test_a_run_that_was_stopped_diverged() -> None:
    found = classify_loop(convergence_log(), stopped=True)
    assert found is not None
    assert found.state == "diverged"
    broken = convergence_log()
    broken.loc[WINDOWS - 1, "displacement_m"] = np.inf
    found = classify_loop(broken)
    assert found is not None
    assert found.state == "diverged"
    # Also where it was stopped before the first window with a load was written.
    found = classify_loop(convergence_log(load_n=0.0), stopped=True)
    assert found is not None
    assert found.sentence == "Diverged: the shape means nothing."


def test_one_way_loads_are_no_loop() -> None:
    found = judged(factor=0.0, displacement_m=0.0, residual_m=0.01, work_j=0.0)
    assert found.state == "one way"
    assert found.sentence == "One way: the sand never felt the pattern give way."


def test_a_pattern_stepped_with_the_grains_has_no_residual() -> None:
    told = (
        convergence_log()
        .rename(columns={"energy_j": "elastic_j"})
        .drop(columns=["residual_m", "factor"])
    )
    found = classify_loop(told.assign(work_j=0.025))
    assert found is not None
    assert found.state == "holds"
    assert found.sentence == "Holds: the sand saw the pattern where its loads bend it."


def test_without_sand_on_it_nothing_is_told() -> None:
    assert classify_loop(convergence_log(load_n=0.0)) is None
    assert classify_loop(convergence_log().iloc[:0]) is None


def test_a_study_counts_its_runs() -> None:
    holds, lags, cycles = judged(), judged(residual_m=0.004), judged(work_j=0.0)
    assert study_sentence([holds, holds]) == "The loop holds in all 2 runs."
    assert study_sentence([holds, cycles, lags, lags]) == (
        "The loop holds in 1, lags in 2, goes in cycles in 1 of 4 runs: only where it holds is a "
        "shape an answer."
    )
    assert study_sentence([lags]).startswith("The loop lags in the one run: only where")
    assert study_sentence([]) == "No run has a convergence log that tells of its loop."
