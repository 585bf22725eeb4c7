"""The pattern of the in-step scheme: arrays for its compiled step, and what they amount to."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from sandmould.dem.addresses import table_of
from sandmould.engines.session import StepMover
from sandmould.pattern_fe.condensation import CondensedSurface
from sandmould.pattern_fe.coupling.contact_rows import ContactRows
from sandmould.pattern_fe.coupling.contact_step import ContactArrays
from sandmould.pattern_fe.coupling.foam_step import (
    CONTACT,
    DAMPED,
    OMEGA2,
    STEPS,
    STOPPED,
    WORK,
    FoamArrays,
    address_of_step,
)
from sandmould.pattern_fe.coupling.selective_mass import SelectiveMass, selective_mass
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.surroundings import Surroundings

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class InStepFoam:
    """A pattern condensed on its surface, stepped by central differences inside an engine.

    Small displacements. Weight and the box's own acceleration of the light foam are left out, as
    in the other schemes.
    """

    _STATE: ClassVar[tuple[str, ...]] = (
        "load", "speed", "load_sum", "momentum", "moved_mass", "displacement", "before",
        "velocity", "sums", "clear", "clear_at", "wall", "push", "push_sum",
    )  # fmt: skip

    def __init__(
        self,
        pattern: Pattern,
        step_s: float,
        contacts: ContactRows,
        largest_m: float,
        mass_scale: float | None = None,
        damping_ratio: float = 0.0,
        surroundings: Surroundings | None = None,
    ) -> None:
        """Stand at rest as drawn.

        ``largest_m``: displacement beyond which the pattern has run away and stops.
        ``damping_ratio``: of the slowest mode, by mass damping.
        """
        surface = pattern.condensed
        line = pattern.surface.outer_line
        self.vertices_m = pattern.surface.vertices_m[line]
        """Of the outer line as drawn, (nv, d) float64, m."""
        self.mass: SelectiveMass = selective_mass(surface, contacts, step_s, mass_scale)
        alpha_1_s = 4.0 * math.pi * self.mass.first_hz * damping_ratio
        first = line.start * self.vertices_m.shape[1]
        pressed = first + np.arange(self.vertices_m.size)
        self._arrays = _at_rest(surface, self.mass, self.vertices_m, pressed, surroundings)
        half = 0.5 * step_s * alpha_1_s
        self._arrays.numbers[:] = (
            step_s,
            (1.0 - half) / (1.0 + half),
            step_s / (1.0 + half),
            self.mass.omega_1_s**2,
            alpha_1_s,
            largest_m,
        )
        self._table = table_of(self._arrays)
        self.mean_contact_n = np.zeros_like(self.vertices_m)
        """(nv, d) float64, N: of what it touches, in the mean that was asked for last."""

    @property
    def mover(self) -> StepMover:
        """What an engine is given; it lives as long as this pattern."""
        arrays = self._arrays
        return StepMover(address_of_step(), self._table.ctypes.data, arrays.load, arrays.speed)

    @property
    def displacement_m(self) -> Array:
        """Of the vertices of the outer line, (nv, d) float64, m."""
        arrays = self._arrays
        return arrays.displacement[arrays.pressed].reshape(self.vertices_m.shape)

    @property
    def ran_away(self) -> bool:
        """Whether the pattern has stopped beyond its largest displacement."""
        return bool(self._arrays.sums[STOPPED])

    @property
    def work_j(self) -> float:
        """Work of the loads since the start."""
        return float(self._arrays.sums[WORK])

    @property
    def damped_j(self) -> float:
        """What damping took of it."""
        return float(self._arrays.sums[DAMPED])

    @property
    def contact_j(self) -> float:
        """What contact took of it: the kinetic energy of what it stops."""
        return float(self._arrays.sums[CONTACT])

    @property
    def kinetic_j(self) -> float:
        """Kinetic energy of the scaled masses, half a step ago."""
        return 0.5 * float(self._arrays.velocity @ self._arrays.momentum)

    @property
    def elastic_j(self) -> float:
        """Elastic energy half a step ago, u_n S u_n+1 / 2."""
        arrays = self._arrays
        force = arrays.moved_mass - arrays.mass * arrays.displacement
        return 0.5 * float(arrays.numbers[OMEGA2] * (arrays.before @ force))

    def take_mean_load_n(self) -> Array:
        """Mean load on the outer line since the last asking, (nv, d) float64, N; 0 at first."""
        arrays = self._arrays
        steps = max(1.0, arrays.sums[STEPS])
        mean = arrays.load_sum / steps
        self.mean_contact_n = (arrays.push_sum[arrays.pressed] / steps).reshape(mean.shape)
        arrays.load_sum[:] = 0.0
        arrays.push_sum[:] = 0.0
        arrays.sums[STEPS] = 0.0
        return np.asarray(mean)

    def state(self) -> dict[str, Array]:
        """All that moves, by name."""
        return {name: getattr(self._arrays, name).copy() for name in self._STATE}

    def restore(self, arrays: dict[str, Array]) -> None:
        """Go on from what ``state`` gave."""
        for name in self._STATE:
            getattr(self._arrays, name)[:] = arrays[name]


def _at_rest(
    surface: CondensedSurface,
    mass: SelectiveMass,
    vertices_m: Array,
    pressed: Indices,
    surroundings: Surroundings | None,
) -> FoamArrays:
    """A surface at rest, its numbers not set."""
    free = np.isfinite(surface.mass_kg)
    n = len(free)
    more = -n % 4  # components that the compiled product wants, held like those of supports

    def none() -> Array:
        return np.zeros(n + more)

    return FoamArrays(
        inverse=np.pad(mass.inverse_1_kg(), (0, more)),
        mass=np.pad(np.where(free, mass.scale * surface.mass_kg, 0.0), (0, more)),
        free=np.pad(free.astype(np.float64), (0, more)),
        numbers=np.zeros(6),
        pressed=pressed,
        load=np.zeros_like(vertices_m),
        speed=np.zeros_like(vertices_m),
        load_sum=np.zeros_like(vertices_m),
        momentum=none(),
        moved_mass=none(),
        displacement=none(),
        before=none(),
        velocity=none(),
        force=none(),
        mean_momentum=none(),
        sums=np.zeros(5),
        impulse=none(),
        **_contact_arrays(surroundings, vertices_m, pressed, n + more)._asdict(),
    )


def _contact_arrays(
    surroundings: Surroundings | None, drawn_m: Array, pressed: Indices, size: int
) -> ContactArrays:
    """What a pattern of some components may touch, in 3D floor and walls alone; nothing as yet."""
    low, high = np.full(size, -np.inf), np.full(size, np.inf)
    sides: list[Array] = []
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
