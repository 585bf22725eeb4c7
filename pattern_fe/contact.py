"""Unilateral contact of a pattern's surface with what surrounds it, without friction.

Signorini's conditions: gaps do not close beyond zero, reactions only press, and where there is a
gap there is no reaction. With the gaps linearised these are a linear complementarity problem in the
reactions, whose matrix is the compliance of the surface between the places of contact; a
primal-dual active set solves it exactly (Hintermüller, Ito and Kunisch, SIAM Journal on
Optimization 13, 2003), so there is no stiffness of contact to choose. What is solved for are the
loads of the surroundings on the vertices: how the pattern moves under them is the caller's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from sandmould.pattern_fe.surroundings import Gaps, Surroundings

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Response = Callable[[Array], Array]
"""Displacements of the surface under loads on it, both (nv d, m) float64, m and N."""
_ROUNDS = 40
"""Of the active set, which takes some five; then least squares, slower but sure to end."""
_SHARES = 1e-11
"""Of its compliance, added to that of each place alone: those that coincide share a reaction."""
_NO_STIFFNESS = "the pattern has no stiffness against reactions of contact"
_AT_ONCE = 100
"""Places that are taken to press in a round, before all gaps are looked at again."""
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
    surroundings: Surroundings,
    at_m: Array,
    free_m: Array,
    response: Response,
    pressed: NDArray[np.bool_] | None = None,
) -> Touch | None:
    """Find the reactions that keep a motion out of what surrounds a pattern; None where none press.

    Parameters
    ----------
    at_m : (nv, d) float64, m
        Displacement from which the motion leads; gaps are linearised there.
    free_m : (nv, d) float64, m
        Displacement that it leads to without reactions.
    pressed : (nv,) bool, optional
        Vertices with reactions before, whose closed gaps are taken to stay closed unless they are
        found to pull: a pattern that only its contacts keep from buckling has no stiffness without.

    Raises
    ------
    RuntimeError
        When no reactions are found: the pattern has no stiffness against them.
    """
    way_m = 1.5 * float(np.linalg.norm(free_m - at_m, axis=1).max())
    around = surroundings.gaps(at_m, way_m)
    least_m = -_OPEN * surroundings.extent_m
    held = np.zeros(0, dtype=np.int64)
    if pressed is not None:
        closed = (np.abs(around.gap_m) <= -least_m) & pressed[around.vertices[:, 0]]
        held = np.flatnonzero(closed)
    while True:
        bound = _Bound(around.only(held), at_m, free_m, response)
        load_n, moved_m = _pushed(around, at_m, bound.moved_m, bound.response, least_m)
        pulls = bound.reactions_n(load_n) < 0.0
        if not pulls.any():
            break
        held = held[~pulls]
    load_n = load_n + bound.loads_n(load_n)
    return Touch(load_n, moved_m) if load_n.any() else None


class _Bound:
    """A pattern some of whose closed gaps are kept closed, as by supports."""

    def __init__(self, gaps: Gaps, at_m: Array, free_m: Array, response: Response) -> None:
        self._rows = gaps.rows(len(free_m))
        self._free_response = response
        self._open_m = gaps.gap_m + gaps.opening_m(free_m - at_m)
        self._moves = response(self._rows.T) if len(self._rows) else self._rows.T
        compliance = self._rows @ self._moves
        self._compliance = compliance + _SHARES * np.diag(np.abs(compliance.diagonal()))
        away_m = self._moves @ np.linalg.solve(self._compliance, self._open_m)
        self.moved_m = free_m - away_m.reshape(free_m.shape)
        """(nv, d) float64, m: where the free motion leads with these gaps closed."""

    def response(self, load_n: Array) -> Array:
        """Displacements under loads, as those of the free pattern."""
        free = self._free_response(load_n)
        kept = np.linalg.solve(self._compliance, self._rows @ free)
        return np.asarray(free - self._moves @ kept)

    def reactions_n(self, load_n: Array) -> Array:
        """What keeps the gaps closed under loads (nv, d) beside the free motion, N."""
        if not len(self._rows):
            return np.zeros(0)
        moved = self._rows @ self._free_response(load_n.reshape(-1, 1))[:, 0]
        return np.asarray(-np.linalg.solve(self._compliance, self._open_m + moved))

    def loads_n(self, load_n: Array) -> Array:
        """The same as loads on the vertices, (nv, d) float64, N."""
        return np.asarray((self._rows.T @ self.reactions_n(load_n)).reshape(load_n.shape))


def _pushed(
    gaps: Gaps, at_m: Array, free_m: Array, response: Response, least_m: float
) -> tuple[Array, Array]:
    """Loads that open all gaps of a motion, and where it then leads, (nv, d) float64, N and m."""
    load_n, moved_m = np.zeros_like(free_m), free_m
    open_m = gaps.gap_m + gaps.opening_m(free_m - at_m)
    use = np.zeros(0, dtype=np.int64)
    rows, moves = np.zeros((0, free_m.size)), np.zeros((free_m.size, 0))
    fresh = _deepest(gaps, open_m, least_m)
    while len(fresh):
        new = gaps.only(fresh).rows(len(free_m))
        use, rows = np.concatenate([use, fresh]), np.concatenate([rows, new])
        moves = np.concatenate([moves, response(new.T)], axis=1)
        reaction = reactions_n(rows @ moves, open_m[use])
        moved_m = free_m + (moves @ reaction).reshape(free_m.shape)
        load_n = (rows.T @ reaction).reshape(free_m.shape)
        left_m = gaps.gap_m + gaps.opening_m(moved_m - at_m)
        left_m[use] = 0.0
        fresh = _deepest(gaps, left_m, least_m)
    return load_n, moved_m


def _deepest(gaps: Gaps, open_m: Array, least_m: float) -> Indices:
    """Places that are most inside, one a facet: hardly any more is open when these are."""
    inside = np.flatnonzero(open_m < least_m)
    inside = inside[open_m[inside].argsort(kind="stable")]
    _, first = np.unique(gaps.vertices[inside, 0], return_index=True)
    return inside[np.sort(first)[:_AT_ONCE]]


def reactions_n(compliance_m_n: Array, open_m: Array) -> Array:
    """Solve r >= 0, w = C r + g >= 0, r w = 0, (m,) float64, N.

    ``compliance_m_n``, (m, m) float64, m/N: C, symmetric and positive; rows of places that cannot
    move are 0 and get no reaction. ``open_m``, (m,) float64, m: g, gaps without reactions.

    Raises
    ------
    RuntimeError
        When C is not positive.
    """
    diagonal = compliance_m_n.diagonal()
    if (diagonal < -1e-12 * np.abs(diagonal).max(initial=0.0)).any():
        raise RuntimeError(_NO_STIFFNESS)
    free = np.flatnonzero(diagonal > 1e-9 * diagonal.max(initial=0.0))
    matrix = compliance_m_n[np.ix_(free, free)] + _SHARES * np.diag(diagonal[free])
    reaction = np.zeros(len(open_m))
    reaction[free] = _complementary(matrix, open_m[free])
    return reaction


def _complementary(matrix: Array, gap: Array) -> Array:
    active = gap < 0.0
    for _ in range(_ROUNDS):
        reaction = np.zeros(len(gap))
        if active.any():
            among = matrix[np.ix_(active, active)]
            reaction[active] = np.linalg.solve(among, -gap[active])
        left = matrix @ reaction + gap
        new = np.where(active, reaction > 0.0, left < 0.0)
        if (new == active).all():
            return reaction
        active = new
    return _least_squares(matrix, gap)


def _least_squares(matrix: Array, gap: Array) -> Array:
    """The same as non-negative least squares, for a matrix that may have lost its last digits."""
    for share in (0.0, 1e-9, 1e-7):
        try:
            root = np.linalg.cholesky(matrix + share * np.diag(matrix.diagonal()))
        except np.linalg.LinAlgError:
            continue
        return np.asarray(nnls(root.T, -np.linalg.solve(root, gap), maxiter=30 * len(gap))[0])
    raise RuntimeError(_NO_STIFFNESS)
