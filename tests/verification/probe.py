"""One grain that is put against surfaces of the reference solver, step by step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.dem.broad_phase import find_candidates
from sandmould.dem.contact_law import Law
from sandmould.dem.surface_contacts import surface_forces
from sandmould.dem.surfaces import Surfaces
from sandmould.dem.vectors import dim_of
from sandmould.dem.wall_history import new_history

Array = NDArray[np.float64]
RADIUS_M, MASS_KG, STEP_S = 1e-3, 1e-5, 1e-6
LAW = Law(2e4, 2e4, 0.35, 0.95, 0.1, 2e4, clip_total=True, torsion=False)
SMOOTH = LAW._replace(friction=0.0, damping_ratio=0.0, rolling_arm=0.0)


@dataclass
class Touch:
    """What one grain feels in one step."""

    force: Array
    moment: Array
    loads: Array
    contacts: int


class Probe:
    """One grain and its memory of the surfaces."""

    def __init__(self, surfaces: Surfaces, law: Law = LAW) -> None:
        self.surfaces, self.law = surfaces, law
        self.d = surfaces.dimension
        self.dim = dim_of(self.d)
        self.history = new_history(self.dim, 1)

    def touch(
        self, position: Array, velocity: Array, spin: Array, shift_velocity: Array | None = None
    ) -> Touch:
        """Put the grain somewhere for one step."""
        arrays = self.surfaces.arrays
        radius, mass, still = np.array([RADIUS_M]), np.array([MASS_KG]), (0.0,) * self.d
        x, v, w = (np.array([a], dtype=float) for a in (position, velocity, spin))
        force, moment = np.zeros_like(x), np.zeros_like(w)
        loads = np.zeros_like(arrays.vertices)
        found = find_candidates(self.dim, x, radius, 0.0, arrays, still)
        shift_v = still if shift_velocity is None else tuple(shift_velocity)
        surface_forces(
            self.dim, 0, len(found.rows), found, x, v, w, np.zeros(1, np.uint8), radius,
            mass, force, moment, arrays, still, shift_v, self.law, STEP_S, True, self.history,
            loads, 0.0, np.empty(0),
        )  # fmt: skip
        contacts = int(self.history.used[0]) if len(found.rows) else 0
        return Touch(force[0], moment[0], loads, contacts)
