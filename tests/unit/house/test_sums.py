"""Numbers add up to the same last digit on every Python."""

from __future__ import annotations

from sandmould.sums import added


def test_round_off_is_that_of_one_addition_after_the_other() -> None:
    # `sum` gives 1.0 from Python 3.12 on
    assert added([0.1] * 10) == 0.9999999999999999
    assert added([]) == 0.0
