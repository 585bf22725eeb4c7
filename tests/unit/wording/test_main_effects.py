"""What each of several swept keys does, on average over the others, and in which words."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd
import pytest

from sandmould.statistics.main_effects import main_effects
from sandmould.wording.answer import main_effect_sentences
from tests.answered import answered

ANGLE, FRICTION = "values.angle_deg", "values.friction"
NOISE = np.random.default_rng(3).normal(0.0, 0.01, 18)


def grid(replicates: int = 3, factor: float = 0.0) -> pd.DataFrame:
    """Speeds at three angles and two frictions: the angle matters, the friction hardly."""
    rows = [
        {
            "run": f"r{n}",
            ANGLE: angle,
            FRICTION: friction,
            "replicate": n,
            "seed": n,
            "outcome_code": 0,
            "speed_m_s": (factor**angle if factor else 0.1 * angle) + NOISE[n],
        }
        for n, (angle, friction, _) in enumerate(product((1, 2, 4), (0.3, 0.5), range(replicates)))
    ]
    return pd.DataFrame(rows)


def test_unlike_scatters_count_each_by_itself() -> None:
    """One wild setting is pooled with none: the friction acts where it is wild, or nowhere."""
    wild = grid()
    at = (wild[ANGLE] == 4) & (wild[FRICTION] == 0.5)
    wild.loc[at, "speed_m_s"] = [0.2, 0.5, 0.9]
    answer = answered(wild, "speed_m_s", [ANGLE, FRICTION], "neither")
    assert answer.verdict.spread is not None
    assert answer.verdict.spread.are_unlike
    _, friction = main_effects(answer.verdict, answer.asked.keys)
    of = wild.groupby([ANGLE, FRICTION])["speed_m_s"].var()
    assert friction.apart.test is not None
    # means of three settings of three runs each, on either side
    assert friction.apart.test.error == pytest.approx(np.sqrt(of.sum() / 3 / 9))
    assert friction.apart.test.df == pytest.approx(2.0, abs=0.1)


def test_each_key_is_told_with_its_interval() -> None:
    answer = answered(grid(), "speed_m_s", [ANGLE, FRICTION], "neither")
    angle, friction = main_effects(answer.verdict, answer.asked.keys)
    assert (angle.high, angle.low, friction.apart.separated) == (4, 1, False)
    found = grid().groupby(ANGLE)["speed_m_s"].mean()
    assert angle.apart.difference == pytest.approx(found[4] - found[1])
    sd = np.sqrt(grid().groupby([ANGLE, FRICTION])["speed_m_s"].var().mean())
    assert angle.apart.test is not None
    # six runs a level, twelve degrees of freedom
    assert angle.apart.test.error == pytest.approx(sd * np.sqrt(2 / 6))
    assert (angle.apart.test.df, angle.apart.test.means) == (12, 3)
    of_angle, of_friction = main_effect_sentences(answer)
    assert of_angle.startswith("Averaged over friction, the speed with angle 4 ° is 0.299 ± 0.020")
    assert of_angle.endswith(" m/s more than with 1 °.")
    assert "Averaged over angle, the friction makes no clear difference: 0.0" in of_friction
    assert of_friction.endswith(" m/s, between 0.5 and 0.3.")


def test_of_wide_measures_factors_are_told() -> None:
    wide = grid(factor=10.0)
    told = main_effect_sentences(answered(wide, "speed_m_s", [ANGLE, FRICTION], "neither"))
    assert "the speed with angle 4 ° is 1\u202f000 times as much (" in told[0]
    assert told[0].endswith(") as with 1 °.")
    assert "no clear difference: a factor of 1 (" in told[1]


def test_no_effect_is_told_of_one_run_each_or_of_a_grid_with_a_hole() -> None:
    for summary in (grid(1), grid().iloc[3:]):
        answer = answered(summary, "speed_m_s", [ANGLE, FRICTION], "neither")
        assert main_effect_sentences(answer) == ()
