"""The slip of a grain that rolls and twists in the groove between two others is none."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
import pytest

from sandmould.dem.contact_law import Law, contact, pair_coefficients

RADIUS_M, LARGE_M, SPEED_M_S, STEP_S = 6e-4, 2e-3, 0.1, 1e-6
LAW = Law(7e4, 7e4, 10.0, 1.0, 0.0, 7e4, True, False)


@numba.njit
def friction_of(n: Any, v: Any, w: Any, turn: float, law: Law, dt: float) -> Any:
    zero = (0.0, 0.0, 0.0)
    sizes = pair_coefficients(law, 1.0, RADIUS_M, RADIUS_M)
    return contact(n, 1e-6, v, zero, w, LARGE_M, RADIUS_M, turn, sizes, law, dt, zero, zero)[3]


def groove(step_s: float, turned: bool) -> np.ndarray:
    """Friction on a large grain after one step of exact rolling round the line of two centres, N.

    The small grain goes round at the distance from the line where it touches both large ones; its
    spin is along the line. Velocities are those of half a step before the normal.
    """
    apart = LARGE_M + RADIUS_M
    out = math.sqrt(apart**2 - LARGE_M**2)
    angle = 0.5 * SPEED_M_S * step_s / out
    n = (LARGE_M / apart, out / apart * math.sin(angle), out / apart * math.cos(angle))
    # At the contact the surface moves by v - r w x n, with n of half a step ago.
    w = (-SPEED_M_S / (RADIUS_M * out / apart), 0.0, 0.0)
    turn = 0.5 * step_s / apart if turned else 0.0
    return np.array(friction_of(n, (0.0, SPEED_M_S, 0.0), w, turn, LAW, step_s))


def test_rolling_in_a_groove_is_no_slip_at_the_normal_of_half_a_step_ago() -> None:
    scale = LAW.k_t * STEP_S * SPEED_M_S
    angle = 0.5 * SPEED_M_S * STEP_S / LARGE_M
    assert np.linalg.norm(groove(STEP_S, True)) < 2 * scale * angle**2
    # Its order: friction of one step falls with the cube of the step.
    ratio = np.linalg.norm(groove(8 * STEP_S, True)) / np.linalg.norm(groove(4 * STEP_S, True))
    assert ratio == pytest.approx(8.0, rel=0.1)


def test_at_the_normal_of_the_whole_step_it_slips_outwards() -> None:
    # |v| dt sin(alpha/2) sin(beta) with sin(beta) = R/(R + r), out of the groove.
    apart = LARGE_M + RADIUS_M
    out = math.sqrt(apart**2 - LARGE_M**2)
    angle = 0.5 * SPEED_M_S * STEP_S / out
    slip = SPEED_M_S * STEP_S * math.sin(angle) * LARGE_M / apart
    friction = groove(STEP_S, False)
    assert np.linalg.norm(friction) == pytest.approx(LAW.k_t * slip, rel=1e-3)
    # The large grain is dragged outwards, so that the small one is drawn into the groove.
    assert friction[2] > 0.0
