"""What moves a surface in every step, driven by the loads of the step before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StepMover:
    """A compiled function that an engine calls before every step, and what both exchange.

    The engine writes the loads, calls, and moves the vertices with the velocities through one
    step. What lies behind the function is known to its owner alone.
    """

    call: int
    """Address of a compiled function of two integers, ``table`` and the step's number."""
    table: int
    """Address that it is given."""
    load_n: Array
    """(nv, d) float64, N: of the grains on the vertices, at the last step."""
    velocity_m_s: Array
    """(nv, d) float64, m/s: of the vertices until the next step, in the frame of the box."""
