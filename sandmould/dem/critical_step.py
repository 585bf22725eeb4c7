"""Critical time steps of the contacts as they are, eqs. (40)-(54) of the paper.

Central differences take the damping force at the velocity of half a step ago:
M (x+ - 2 x + x-) / dt^2 + C (x - x-) / dt + K x = 0. They lose stability where a vector phi first
grows as (-1)^n phi, that is where 4 M - 2 dt C - dt^2 K stops being positive definite. For one
mode, C = 2 xi omega M and K = omega^2 M, this is eq. (42). For a system it is, with s = 1 / dt,

    (4 s^2 M - 2 s C - K) phi = 0,

whose largest s is the largest that a phi has by phi^T (4 s^2 M - 2 s C - K) phi = 0. For K = B^T B,
b = B M^-1/2 and c = M^-1/2 C M^-1/2 the phi of the largest eigenvalue of 2 s c + b^T b has a larger
one than s, until both are the same.

All contacts count as sticking unless they are smooth, and none opens: the stiffest case. The turn
of the normals under the contact forces is left out, of the order of the overlap over the radius.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import eigsh

from sandmould.dem.contact_law import Law
from sandmould.dem.grains import Floats, Ints
from sandmould.dem.solver import Solver

_SETTLED = 1e-9
"""Relative change of the step below which it has been found."""


@dataclass(frozen=True)
class StableStep:
    """Highest frequency of some motion, and the steps up to which it stays bounded."""

    omega_rad_s: float
    """Largest natural frequency without damping, 0 where nothing touches."""
    undamped_s: float
    """Critical step of the springs alone, eq. (41)."""
    damped_s: float
    """Critical step with the dashpots, eq. (42)."""


class ActiveContacts(NamedTuple):
    """The springs and dashpots of c active contacts, and the grains between which they act.

    The rows of a contact give the elongations, times the square roots of their stiffnesses, that
    unit displacements and rotations of its grains make, each over the square root of its mass or
    inertia: the energy is half the square of their product with the motion. Of r = 3 rows in 2D
    and 6 in 3D the first is normal, the next tangential, the last rolling.
    """

    first: Ints
    """(c,) int64."""
    second: Ints
    """(c,) int64: -1 at a surface."""
    rows_first: Floats
    """(c, r, d + s) float64, rad/s: of the first grain."""
    rows_second: Floats
    """(c, r, d + s) float64, rad/s: of the second grain, zero at a surface."""
    dashpot: Floats
    """(c,) float64, s: damping constant over normal stiffness, that of a plain dashpot."""
    correction: Floats
    """(c,) float64, 1/s: c / (4 m) with m of eq. (21); 0 where dashpots are plain. At a step dt the
    dashpot is that over 1 + correction dt."""
    grains: int
    """How many grains there are, touched or not."""


class _Ends(NamedTuple):
    """Where contacts act: what ``_rows`` turns into rows."""

    first: Ints
    second: Ints
    normal: Floats
    arms: Floats
    """(c, 2) float64, m: from the centres to the contact point; (r, 0) at a surface."""
    effective: Floats
    """(c,) float64, m: radius at which the rolling spring acts."""
    mass: Floats
    """(c,) float64, kg: of eq. (21)."""


def _pair_ends(solver: Solver) -> _Ends:
    grains, contacts = solver.grains, solver.contacts
    i, j = contacts.first, contacts.second
    apart = grains.position[j] - grains.position[i]
    distance = np.sqrt((apart**2).sum(axis=1))
    r_i, r_j, m_i, m_j = grains.radius[i], grains.radius[j], grains.mass[i], grains.mass[j]
    half = 0.5 * (r_i + r_j - distance)
    arms = np.column_stack([r_i - half, r_j - half])
    normal = apart / distance[:, None]
    return _Ends(i, j, normal, arms, r_i * r_j / (r_i + r_j), m_i * m_j / (m_i + m_j))


def _wall_ends(solver: Solver) -> _Ends:
    """Contacts with surfaces; the arm is the radius, the longest that it can be."""
    grains, walls = solver.grains, solver.moving.walls
    used, first_slot = walls.history.used, walls.history.first_slot
    slots = np.diff(first_slot)
    in_use = np.arange(first_slot[-1]) < np.repeat(first_slot[:-1] + used, slots)
    i = np.repeat(walls.candidates.rows, slots)[in_use].astype(np.int64)
    radius = grains.radius[i]
    arms = np.column_stack([radius, np.zeros(len(i))])
    second = np.full(len(i), -1)
    return _Ends(i, second, walls.history.normal[in_use], arms, radius, grains.mass[i])


def _tangents(normal: Floats) -> Floats:
    """Unit vectors across the normals: (c, 1, 2) in 2D, (c, 2, 3) in 3D."""
    if normal.shape[1] == 2:
        return np.stack([-normal[:, 1], normal[:, 0]], axis=1)[:, None]
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    tangent = np.cross(normal, least)
    tangent /= np.sqrt((tangent**2).sum(axis=1))[:, None]
    return np.stack([tangent, np.cross(normal, tangent)], axis=1)


def _rows(solver: Solver, ends: _Ends, law: Law) -> ActiveContacts:
    """Turn springs of eqs. (16), (25) and (29) into rows."""
    # The slip of grain 2 over grain 1 along a tangent t is
    # (v_2 - v_1) t - (a_1 w_1 + a_2 w_2) (n x t), where in 2D n x t = 1.
    n, grains = ends.normal, solver.grains
    c, d = n.shape
    tangents = _tangents(n)
    turns = np.ones((c, 1, 1)) if d == 2 else np.cross(n[:, None], tangents)
    rolls = np.ones((c, 1, 1)) if d == 2 else np.concatenate([n[:, None], tangents], axis=1)
    k_n, k_t, k_roll = law.springs_n_m
    roll = np.sqrt(k_roll * ends.effective**2)[:, None, None] * rolls
    if d == 3 and not law.torsion:
        roll[:, 0] = 0.0

    def rows_of_side(side: int, grain: Ints) -> Floats:
        sign = 2.0 * side - 1.0
        moving = np.zeros((c, 3 * d - 3, d + rolls.shape[2]))
        moving[:, 0, :d] = sign * math.sqrt(k_n) * n
        moving[:, 1:d, :d] = sign * math.sqrt(k_t) * tangents
        moving[:, 1:d, d:] = -math.sqrt(k_t) * ends.arms[:, side, None, None] * turns
        moving[:, d:, d:] = sign * roll
        moving[:, :, :d] /= np.sqrt(grains.mass[grain])[:, None, None]
        moving[:, :, d:] /= np.sqrt(grains.inertia[grain])[:, None, None]
        return np.where((grain < 0)[:, None, None], 0.0, moving)

    damping = 2.0 * law.damping_ratio * np.sqrt(ends.mass * k_n)
    correction = damping / (4.0 * ends.mass) * (law.lag_s > 0.0)
    rows = rows_of_side(0, ends.first), rows_of_side(1, ends.second)
    return ActiveContacts(ends.first, ends.second, *rows, damping / k_n, correction, len(grains.id))


def active_contacts(solver: Solver) -> ActiveContacts:
    """Give the contacts of the last step, with grains and with surfaces.

    ``solver``: after a step, or after ``place``.
    """
    between = _rows(solver, _pair_ends(solver), solver.scene.grain_law)
    at_walls = _rows(solver, _wall_ends(solver), solver.scene.wall_law)
    first, second, rows_first, rows_second, dashpot, correction = (
        np.concatenate(parts) for parts in zip(between[:-1], at_walls[:-1], strict=True)
    )
    return ActiveContacts(
        first, second, rows_first, rows_second, dashpot, correction, between.grains
    )


def stable_step(
    omega_rad_s: float,
    contacts: ActiveContacts,
    damped_rate_rad_s: Callable[[Floats], float],
    of_step_s: float | None = None,
) -> StableStep:
    """Steps of a frequency and of the rate omega (sqrt(1 + xi^2) + xi) that (42) puts for it.

    The rate is that of dashpots, (c,) float64, s. Corrected ones are the weaker the longer the
    step: their limit is that of the dashpots of a given step, or the step that is the limit of its
    own dashpots, found by secants from that of the plain ones.
    """
    if not omega_rad_s > 0.0:
        return StableStep(0.0, math.inf, math.inf)

    def missed_s(step_s: float) -> float:
        dashpot = contacts.dashpot / (1.0 + contacts.correction * step_s)
        return 2.0 / damped_rate_rad_s(dashpot) - step_s

    if of_step_s is not None:
        return StableStep(float(omega_rad_s), 2.0 / omega_rad_s, of_step_s + missed_s(of_step_s))
    damped = 2.0 / damped_rate_rad_s(contacts.dashpot)
    if contacts.correction.any():
        last, missed = damped, missed_s(damped)
        damped += missed
        while abs(damped - last) > _SETTLED * damped:
            before, missed = missed, missed_s(damped)
            last, damped = damped, damped - missed * (damped - last) / (missed - before)
    return StableStep(float(omega_rad_s), 2.0 / omega_rad_s, damped)


def _stiffest(matrix: csr_array, start: Floats) -> Floats:
    """Eigenvector of the largest eigenvalue of a symmetric matrix, searched from a start."""
    if len(start) < 200:
        return np.asarray(np.linalg.eigh(matrix.toarray())[1][:, -1])
    # The error of the step is the square of that of the vector, which the tolerance bounds.
    _, vectors = eigsh(matrix, k=1, which="LA", v0=start, tol=1e-5)
    return np.asarray(vectors[:, 0])


def whole_step(contacts: ActiveContacts, of_step_s: float | None = None) -> StableStep:
    """Eigenproblem of all grains together.

    The damped step is exact for central differences, whether or not the modes are damped alike.
    ``of_step_s``: step that dashpots are corrected for; by default the limit itself.
    """
    if not len(contacts.first):
        return StableStep(0.0, math.inf, math.inf)
    c, r, f = contacts.rows_first.shape
    pair = np.flatnonzero(contacts.second >= 0)
    values = np.concatenate([contacts.rows_first, contacts.rows_second[pair]])
    grain = np.concatenate([contacts.first, contacts.second[pair]])
    contact = np.concatenate([np.arange(c), pair])
    row = np.broadcast_to((contact[:, None] * r + np.arange(r))[:, :, None], values.shape)
    column = np.broadcast_to((grain[:, None] * f + np.arange(f))[:, None, :], values.shape)
    b = coo_array(
        (values.ravel(), (row.ravel(), column.ravel())), shape=(c * r, contacts.grains * f)
    ).tocsr()
    stiffness, normal = (b.T @ b).tocsr(), b[::r]
    # A start of no symmetry, always the same.
    motion = np.random.default_rng(1).standard_normal(contacts.grains * f)
    motion = _stiffest(stiffness, motion)
    omega = math.sqrt(motion @ stiffness @ motion)

    def rate(dashpot: Floats) -> float:
        nonlocal motion
        damping = (normal.T @ diags_array(dashpot) @ normal).tocsr()
        last, found = 0.0, _rate(motion, damping, stiffness)
        while found - last > _SETTLED * found:
            motion = _stiffest(found * damping + stiffness, motion)
            last, found = found, _rate(motion, damping, stiffness)
        return found

    return stable_step(omega, contacts, rate, of_step_s)


def _rate(motion: Floats, damping: csr_array, stiffness: csr_array) -> float:
    """Rate 2 s of a motion of length 1: omega (sqrt(1 + xi^2) + xi)."""
    c, k = motion @ damping @ motion, motion @ stiffness @ motion
    return float(0.5 * (c + math.sqrt(c * c + 4.0 * k)))
