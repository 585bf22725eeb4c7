"""Which measure to add to the first: what each tells, and what it costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sandmould.statistics.calibration.config import Target
from sandmould.statistics.calibration.posterior import posterior
from sandmould.statistics.emulator import Emulator

TRUTHS = 5
"""Planted truths along each axis, the edges of the map left out."""


@dataclass(frozen=True)
class Worth:
    """What measuring something once tells of the two parameters, on average over the map."""

    measure: str
    bits_alone: float
    bits_added: float
    """Beside the first measure."""
    cpu_s: float
    """Of one run that gives it, beyond the run that gives the first."""


def worths(
    emulators: Mapping[str, Emulator], first: str, cpu_s: Mapping[str, float]
) -> list[Worth]:
    """Average information of each measure over planted truths, the richest addition first.

    A truth's value is the emulator's, known as well as one run knows it.

    Parameters
    ----------
    first : str
        The measure that is there already.
    cpu_s : mapping of measure to float, s
        Extra processor time of each.
    """
    base = emulators[first]
    share = (np.arange(TRUTHS) + 0.5) / TRUTHS
    truths = [base.low + (base.high - base.low) * np.array([a, b]) for a in share for b in share]
    alone = {m: _mean_bits(emulators, [m], truths) for m in emulators}
    worth_of_each = [
        Worth(
            m, alone[m], _mean_bits(emulators, [first, m], truths) - alone[first], cpu_s.get(m, 0.0)
        )
        for m in emulators
        if m != first
    ]
    return sorted(worth_of_each, key=lambda worth: -worth.bits_added)


def _mean_bits(
    emulators: Mapping[str, Emulator], measures: Sequence[str], truths: Sequence[np.ndarray]
) -> float:
    bits = []
    for truth in truths:
        targets = {
            m: Target(
                value=float(emulators[m].at(truth[None])[0][0]),
                sd=max(emulators[m].noise_sd, 1e-12),
            )
            for m in measures
        }
        bits.append(posterior(emulators, targets).bits)
    return float(np.mean(bits))
