"""Arrays by what they hold: one name each, for all rooms."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Places = NDArray[np.uint32]
"""Places in long arrays, in half the memory."""
WholeNumbers = NDArray[np.integer[Any]]
"""Of any width."""
Flags = NDArray[np.bool_]
Centres = NDArray[np.float64]
"""(n, d) float64, m: of grains, in the order of their ids."""
Radii = NDArray[np.float64]
"""(n,) float64, m: of the same grains."""
