"""Unilateral contact of a pattern's surface with what surrounds it, without friction.

Signorini's conditions: gaps do not close beyond zero, reactions only press, and where there is a
gap there is no reaction. With the gaps linearised these are a linear complementarity problem in the
reactions, whose matrix is the compliance of the surface between the places of contact; a
primal-dual active set solves it exactly (Hintermüller, Ito and Kunisch, SIAM Journal on
Optimization 13, 2003), so there is no stiffness of contact to choose. What is solved for are the
loads of the surroundings on the vertices: how the pattern answers them is the caller's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from pattern_fe.surroundings import Surroundings

Array = NDArray[np.float64]
Response = Callable[[Array], Array]
"""Displacements of the surface under loads on it, both (nv d, m) float64, m and N."""
_ROUNDS = 40
"""Of the active set, which takes some five; then least squares, slower but sure to end."""
_OPEN = 1e-10
"""Share of the pattern's extent that counts as no overlap."""


@dataclass(frozen=True)
class Touch:
    """What keeps a pattern out of what surrounds it."""

    load_n: Array
    """(nv, d) float64, N: of the surroundings on the vertices."""
    moved_m: Array
    """(nv, d) float64, m: displacement of the surface with these loads."""


def touch(
    surroundings: Surroundings, at_m: Array, free_m: Array, response: Response
) -> Touch | None:
    """Find the reactions that keep a motion out of what surrounds a pattern.

    Parameters
    ----------
    surroundings : Surroundings
    at_m : (nv, d) float64, m
        Displacement from which the motion leads; gaps are linearised there.
    free_m : (nv, d) float64, m
        Displacement that it leads to without reactions.
    response : Response

    Returns
    -------
    Touch or None
        None where nothing presses.

    Raises
    ------
    RuntimeError
        When the pattern has no stiffness against the reactions.
    """
    way_m = 1.5 * float(np.linalg.norm(free_m - at_m, axis=1).max())
    gaps = surroundings.gaps(at_m, way_m)
    open_m = gaps.gap_m + gaps.opening_m(free_m - at_m)
    least_m = -_OPEN * surroundings.extent_m
    touched: Touch | None = None
    use = np.zeros(0, dtype=np.int64)
    rows, answers = np.zeros((0, free_m.size)), np.zeros((free_m.size, 0))
    fresh = np.flatnonzero(open_m < least_m)
    while len(fresh):
        new = gaps.only(fresh).rows(len(free_m))
        use, rows = np.concatenate([use, fresh]), np.concatenate([rows, new])
        answers = np.concatenate([answers, response(new.T)], axis=1)
        reaction = reactions_n(rows @ answers, open_m[use])
        moved_m = free_m + (answers @ reaction).reshape(free_m.shape)
        touched = Touch((rows.T @ reaction).reshape(free_m.shape), moved_m)
        left_m = gaps.gap_m + gaps.opening_m(moved_m - at_m)
        fresh = np.setdiff1d(np.flatnonzero(left_m < least_m), use)
    return touched


def reactions_n(compliance_m_n: Array, open_m: Array) -> Array:
    """Solve r >= 0, w = C r + g >= 0, r w = 0.

    Parameters
    ----------
    compliance_m_n : (m, m) float64, m/N
        C, symmetric and positive; rows of places that cannot move are 0 and get no reaction.
    open_m : (m,) float64, m
        g, gaps without reactions.

    Returns
    -------
    (m,) float64, N

    Raises
    ------
    RuntimeError
        When C is not positive.
    """
    diagonal = compliance_m_n.diagonal()
    if not (diagonal >= -1e-12 * np.abs(diagonal).max(initial=0.0)).all():
        raise RuntimeError("the pattern has no stiffness against reactions of contact")
    free = np.flatnonzero(diagonal > 1e-9 * diagonal.max(initial=0.0))
    # Places that coincide have equal rows: a trace of compliance of their own shares the reaction.
    matrix = compliance_m_n[np.ix_(free, free)] + 1e-11 * np.diag(diagonal[free])
    reaction = np.zeros(len(open_m))
    reaction[free] = _complementary(matrix, open_m[free])
    return reaction


def _complementary(matrix: Array, gap: Array) -> Array:
    active = gap < 0.0
    for _ in range(_ROUNDS):
        reaction = np.zeros(len(gap))
        if active.any():
            reaction[active] = np.linalg.solve(matrix[np.ix_(active, active)], -gap[active])
        left = matrix @ reaction + gap
        new = np.where(active, reaction > 0.0, left < 0.0)
        if (new == active).all():
            return reaction
        active = new
    try:
        root = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError as fault:
        raise RuntimeError("the pattern has no stiffness against reactions of contact") from fault
    return np.asarray(nnls(root.T, -np.linalg.solve(root, gap))[0])
