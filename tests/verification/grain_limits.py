"""Critical steps of one grain among held neighbours: the paper's estimates, eqs. (43)-(54)."""

from __future__ import annotations

import numpy as np

from sandmould.arrays import Floats
from sandmould.dem.critical_step import ActiveContacts, StableStep, stable_step


def _per_grain(contacts: ActiveContacts, values: Floats, of_second: Floats) -> Floats:
    """Sum over the contacts of each grain of what they bring to their first and second grain."""
    total = np.zeros((contacts.grains, *values.shape[1:]))
    np.add.at(total, contacts.first, values)
    pair = contacts.second >= 0
    np.add.at(total, contacts.second[pair], of_second[pair])
    return total


def simplified_step(contacts: ActiveContacts) -> StableStep:
    """The paper's estimate: a grain swings along one line or turns, eqs. (48)-(54).

    With the real number of contacts, all taken to act along that line: omega_n^2 = sum k_n / m
    with xi = sum c / (2 m omega_n), and omega_theta^2 = sum k_T r^2 / I without damping. Other
    grains are held. The paper's (51) and (52) are the case of one contact.
    """
    d = contacts.rows_first.shape[1] // 3 + 1

    def square(rows: Floats, dashpot: Floats) -> Floats:
        normal = (rows[:, 0] ** 2).sum(axis=1)
        # In 3D both tangents turn the grain, each about an axis of its own.
        turning = (rows[:, 1:d, d:] ** 2).sum(axis=(1, 2)) / (d - 1)
        return np.column_stack([normal, dashpot * normal, turning])

    def swings(dashpot: Floats) -> tuple[Floats, Floats]:
        sides = (square(rows, dashpot) for rows in (contacts.rows_first, contacts.rows_second))
        k, c, turning = _per_grain(contacts, *sides).T
        along, about = 0.5 * (np.sqrt(c**2 + 4.0 * k) + c), np.sqrt(turning)
        return np.maximum(np.sqrt(k), about), np.maximum(along, about)

    omega = swings(contacts.dashpot)[0].max(initial=0.0)
    return stable_step(omega, contacts, lambda dashpot: float(swings(dashpot)[1].max()))


def grain_step(contacts: ActiveContacts) -> StableStep:
    """Eigenproblem of every grain among neighbours held fixed, eqs. (43)-(47).

    A grain's matrix is a diagonal block of that of the whole, and a contact between two grains
    stores at most twice the energy that it stores when either is held: the frequency of the
    whole lies between this one and sqrt(2) times it, its damped step between half of this one
    and this one.
    """
    sides = contacts.rows_first, contacts.rows_second
    stiffness = _per_grain(contacts, *(np.einsum("cri,crj->cij", rows, rows) for rows in sides))
    squares, modes = np.linalg.eigh(stiffness)
    omega = np.sqrt(np.maximum(squares, 0.0))
    root = (modes * omega[:, None]) @ modes.transpose(0, 2, 1)

    def rate(dashpot: Floats) -> float:
        outer = (np.einsum("c,ci,cj->cij", dashpot, rows[:, 0], rows[:, 0]) for rows in sides)
        damping = _per_grain(contacts, *outer)
        both = np.block([[damping, root], [root, np.zeros_like(root)]])
        return float(np.linalg.eigvalsh(both).max())

    return stable_step(omega.max(initial=0.0), contacts, rate)
