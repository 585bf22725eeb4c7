"""What a pattern that is stepped inside an engine may touch, as its compiled step takes it."""

from __future__ import annotations

import numpy as np

from sandmould.arrays import Floats, Ints
from sandmould.pattern_fe.coupling.contact_step import ContactArrays
from sandmould.pattern_fe.surroundings import Surroundings


def contact_arrays(
    surroundings: Surroundings | None, drawn_m: Floats, pressed: Ints, size: int
) -> ContactArrays:
    """Arrays of a pattern that touches nothing yet.

    Parameters
    ----------
    surroundings : Surroundings, optional
        In 3D its floor and walls alone; nothing unless given.
    drawn_m : (nv, d) float64, m
    pressed : (d nv,) int64
        Components of these vertices.
    size : int
        Number of all components.
    """
    low, high = np.full(size, -np.inf), np.full(size, np.inf)
    sides: list[Floats] = []
    if surroundings is not None:
        least_m, most_m = surroundings.bounds_m()
        low[pressed], high[pressed] = least_m.ravel(), most_m.ravel()
        sides = surroundings.outlines_m() if surroundings.dimension == 2 else []
    ends = [np.hstack([line, np.roll(line, -1, axis=0)]) for line in sides]
    vertices = len(drawn_m)
    return ContactArrays(
        low,
        high,
        np.concatenate([np.zeros((0, 4)), *ends]),
        np.cumsum([0, *map(len, ends)]).astype(np.int64),
        np.concatenate([np.zeros((0, 2)), *sides]),
        np.ascontiguousarray(drawn_m),
        np.zeros(vertices + 1),
        np.zeros((vertices, 2)),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
    )
