"""Relaxation of the staggered loop on linear interfaces, where its limits are known."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.pattern_fe.coupling.relaxation import (
    AitkenRelaxation,
    Array,
    FixedRelaxation,
    QuasiNewtonRelaxation,
    Relaxation,
)

RNG = np.random.default_rng(5)


def gone(relaxation: Relaxation, stiffness_ratio: Array, windows: int) -> list[float]:
    """Norms of the residuals where sand of so many times the pattern's stiffness pushes back.

    The answer to a displacement x is a - g x: the loads fall as the pattern gives way.
    """
    n = len(stiffness_ratio)
    turn = np.linalg.qr(RNG.normal(size=(n, n)))[0]
    gain, ahead = turn @ np.diag(stiffness_ratio) @ turn.T, turn @ np.ones(n)
    x, norms = np.zeros(n), []
    for _ in range(windows):
        answered = ahead - gain @ x
        norms.append(float(np.linalg.norm(answered - x)))
        x = relaxation.next(x, answered)
    return norms


@pytest.mark.parametrize("gain", [0.5, 3.0, 40.0])
def test_a_fixed_share_holds_below_the_limit_and_diverges_above(gain: float) -> None:
    limit = 2.0 / (1.0 + gain)
    ratio = np.array([gain, 0.1 * gain])
    below, above = (gone(FixedRelaxation(f * limit), ratio, 300) for f in (0.97, 1.03))
    assert below[-1] < 1e-3 * below[0]
    assert above[-1] > 1e3 * above[0]


def test_the_residual_shrinks_by_the_exact_factor() -> None:
    norms = gone(FixedRelaxation(0.1), np.array([4.0]), 10)
    assert norms[1:] == pytest.approx([n * (1 - 0.1 * 5.0) for n in norms[:-1]])


def test_one_unknown_takes_two_windows_by_secants() -> None:
    for relaxation in (AitkenRelaxation(0.1, -1.0, 1.0), QuasiNewtonRelaxation(0.1, 10, 1e-8)):
        norms = gone(relaxation, np.array([30.0]), 3)
        assert norms[2] < 1e-12 * norms[0]


def test_aitken_holds_where_the_plain_loop_diverges() -> None:
    ratio = np.array([30.0, 10.0, 1.0])
    assert gone(FixedRelaxation(1.0), ratio, 60)[-1] > 1e10
    assert gone(AitkenRelaxation(0.1, 0.005, 1.0), ratio, 60)[-1] < 1e-3


def test_aitken_stays_in_its_bounds() -> None:
    relaxation = AitkenRelaxation(0.1, 0.02, 0.3)
    for _ in range(30):
        relaxation.next(RNG.normal(size=4), RNG.normal(size=4))
        assert 0.02 <= relaxation.factor <= 0.3


def test_aitken_finds_where_sand_that_let_go_bears_again() -> None:
    """Sand a little below the surface, 300 times as stiff: no load at all, or far too much."""

    def solution(x: Array) -> Array:
        return np.array([1.0, 0.3]) * 300.0 * max(0.0, 1.0 - x[0])

    relaxation = AitkenRelaxation(0.02, 0.0005, 0.5)
    relaxation.begin_window(True)
    x, left = np.array([2.0, 0.6]), []
    for _ in range(13):
        left.append(float(np.linalg.norm(solution(x) - x)))
        x = relaxation.next(x, solution(x))
    assert max(left) > 2.0 * left[0]  # it struck
    assert min(left) < 0.03


def test_an_iteration_farther_off_is_gone_back_on() -> None:
    relaxation = AitkenRelaxation(0.1, 0.01, 0.5)
    relaxation.begin_window(True)
    ahead = relaxation.next(np.zeros(1), np.ones(1))
    assert ahead == pytest.approx([0.1])
    # Loads that lead back three times as far: where a line through both vanishes.
    again = relaxation.next(ahead, ahead - 3.0)
    assert again == pytest.approx([0.1 / 4.0])
    # Nearer, but the secant would lead half-way to what struck, and no farther.
    assert relaxation.next(again, again + 0.9) == pytest.approx([0.5 * (0.1 / 4.0 + 0.1)])


def test_a_new_window_goes_on_with_the_factor_that_led_on() -> None:
    relaxation = AitkenRelaxation(0.1, 0.01, 0.5)
    relaxation.begin_window(True)
    x = relaxation.next(np.zeros(1), np.ones(1))
    for _ in range(3):  # it strikes, and strikes again
        x = relaxation.next(x, x - 4.0)
    assert relaxation.factor < 0.05
    relaxation.begin_window(True)
    assert relaxation.next(np.zeros(1), np.ones(1)) == pytest.approx([0.1])


@pytest.mark.parametrize("n", [2, 5])
def test_quasi_newton_ends_once_it_has_seen_every_direction(n: int) -> None:
    ratio = np.linspace(1.0, 50.0, n)
    norms = gone(QuasiNewtonRelaxation(0.02, n + 1, 1e-10), ratio, n + 2)
    assert norms[n + 1] < 1e-8 * norms[0]
    assert norms[n - 1] > 1e-6 * norms[0]


def test_quasi_newton_leaves_out_what_newer_windows_have_said() -> None:
    relaxation = QuasiNewtonRelaxation(0.1, 10, 1e-6)
    x = np.zeros(3)
    for _ in range(5):  # the residual changes along one direction alone
        x = relaxation.next(x, np.array([1.0, 0.0, 0.0]) - 20.0 * x)
    assert np.isfinite(x).all()
    assert x == pytest.approx([1.0 / 21.0, 0.0, 0.0])


@pytest.mark.parametrize(
    "fresh",
    [
        lambda: FixedRelaxation(0.2),
        lambda: AitkenRelaxation(0.1, 0.0, 1.0),
        lambda: QuasiNewtonRelaxation(0.1, 3, 1e-6),
    ],
    ids=["fixed", "aitken", "quasi_newton"],
)
def test_memory_is_taken_up(fresh: type[Relaxation]) -> None:
    seen = RNG.normal(size=(6, 2, 4))
    straight, first = fresh(), fresh()
    for shown, answered in seen[:4]:
        straight.next(shown, answered)
        first.next(shown, answered)
    later = fresh()
    later.restore(first.state())
    for shown, answered in seen[4:]:
        np.testing.assert_array_equal(later.next(shown, answered), straight.next(shown, answered))


@pytest.mark.parametrize("is_iterated", [False, True])
def test_residuals_too_alike_to_tell_a_secant_leave_the_factor(is_iterated: bool) -> None:
    relaxation = AitkenRelaxation(0.1, 0.01, 0.5)
    relaxation.begin_window(is_iterated)
    x = np.zeros(2)
    for residual in (np.array([1e-170, 0.0]), np.array([5e-170, 0.0])):
        ahead = relaxation.next(x, x + residual)
    np.testing.assert_array_equal(ahead, 0.1 * residual)
