"""The response of a bed to a small shake: its own resonances, told from the loads on its box."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PEAK = 1.2
"""Amplification from which a highest response counts as a resonance: a rigid bed has 1."""


def transfer(
    time_s: Array, force_n: Array, frequency_hz: float, window_s: float, rigid_n: float
) -> float:
    """Amplitude of a force at one frequency over that of a rigid bed, from its second half.

    NaN where less than one period is left to fit.

    Parameters
    ----------
    time_s : (n,) float64, s
        Ends of the windows over which the force is a mean.
    force_n : (n,) float64, N
    rigid_n : float, N
        Mass of the bed times the amplitude of its box's acceleration.
    """
    late = time_s >= 0.5 * (time_s[0] + time_s[-1])
    if np.ptp(time_s[late]) * frequency_hz < 1.0:
        return float("nan")
    phase = 2 * np.pi * frequency_hz * (time_s[late] - 0.5 * window_s)
    parts = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(phase)])
    sine, cosine, _ = np.linalg.lstsq(parts, force_n[late])[0]
    # A mean over a window has this share of the amplitude.
    seen = float(np.sinc(frequency_hz * window_s))
    return float(np.hypot(sine, cosine)) / seen / rigid_n


def first_resonance_hz(frequency_hz: Array, response: Array) -> float:
    """The lowest frequency whose response is higher than its neighbours', and amplified.

    Of the parabola through the highest and its neighbours, over logarithms; NaN where the bed
    amplifies nothing between the ends. ``frequency_hz``, ``response``: (n,) float64.
    """
    x = np.log(frequency_hz)
    for i in range(1, len(x) - 1):
        near = response[i - 1 : i + 2]
        if np.isfinite(near).all() and near[1] == near.max() and near[1] > PEAK:
            a, b, _ = np.polyfit(x[i - 1 : i + 2] - x[i], near, 2)
            top = -0.5 * b / a if a < 0 else 0.0
            return float(np.exp(x[i] + top))
    return float("nan")
