"""The state of every grain at one instant, in the frame of the moulding box."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.geometry import Scene
from sandmould.scenario.scenario import Scenario


@dataclass(frozen=True)
class Snapshot:
    """Grains at one instant, sorted by id; positions and velocities relative to the box."""

    time_s: float
    """Simulated time since the first grain was inserted."""
    vibration_time_s: float
    """Time since the first vibration stage began; NaN before it."""
    stage: str
    id: NDArray[np.int64]
    """(n,) int64, starting at 1."""
    layer: NDArray[np.int64]
    """(n,) int64: the layer of fill that brought the grain, starting at 1."""
    position_m: NDArray[np.float64]
    """(n, d) float64, m."""
    velocity_m_s: NDArray[np.float64]
    """(n, d) float64, m/s."""
    spin_rad_s: NDArray[np.float64]
    """(n, 3) float64, rad/s; in 2D only the last component differs from zero."""
    radius_m: NDArray[np.float64]
    """(n,) float64, m."""
    orientation: NDArray[np.float64] | None = None
    """(n, 1) float64, rad, in 2D or (n, 9) float64, rotation matrices row by row, in 3D; None where
    ``record.orientation`` does not ask for it."""
    pattern_m: NDArray[np.float64] | None = None
    """(nv, d) float64, m: vertices of the pattern's outer line, where it bends."""
    pattern_load_n: NDArray[np.float64] | None = None
    """(nv, d) float64, N: the sand's force on each, its mean over the last record, or that of the
    last step where the pattern is stepped with the grains."""

    def arrays(self) -> dict[str, Any]:
        """Values by name, as files hold them."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in values.items() if value is not None}

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, Any]) -> Snapshot:
        """The snapshot that such values are of; a KeyError or TypeError where some are missing."""
        values = {f.name: arrays[f.name] for f in fields(cls) if f.name in arrays}
        values["time_s"] = float(values["time_s"])
        values["vibration_time_s"] = float(values["vibration_time_s"])
        values["stage"] = str(values["stage"])
        return cls(**values)


def scene_at(scenario: Scenario, snapshot: Snapshot) -> Scene:
    """Geometry that sand feels at a snapshot: opened gates away, the pattern bent.

    Loads of one way bend a pattern that the sand feels as drawn.
    """
    scene, pattern = scenario.scene_in(snapshot.stage), scenario.pattern
    if pattern is None or snapshot.pattern_m is None or pattern.loop.scheme == "one_way":
        return scene
    return scene.bent(pattern.name, snapshot.pattern_m)
