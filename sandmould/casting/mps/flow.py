"""Flow of metal step by step: prediction, relaxations, collisions, guards (figure 1).

A particle that falls is a surface, without pressure, until it has come far into the metal it meets;
then the density asks for a jump. So particles nearer than a share of their size that still approach
collide as rigid balls do, with little restitution (Lee, Park, Kim and Hwang 2011).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandmould.casting.mps.neighbours import (
    Neighbours,
    VerletList,
    find_candidates,
    find_neighbours,
    list_is_old,
)
from sandmould.casting.mps.operators import (
    LAPLACIANS,
    approach,
    crowding,
    density_rate,
    pressure_gradient,
    velocity_gradient,
)
from sandmould.casting.mps.particles import FLUID, OPTIONS, Floats, Kernel, Kinds, Particles
from sandmould.casting.mps.pressure import solve_pressure
from sandmould.casting.mps.scheme import SOURCES, VISCOUS_SHARE, LiquidMetal, Scheme, Tentative
from sandmould.compiled import njit

MOULD_SHARE = 0.2
"""Of the time that a particle of metal takes; measured 0.15 in space, 0.4 in the plane."""


@njit(**OPTIONS)
def collisions(
    near: Neighbours, velocity: Floats, kind: Kinds, distance_m: float, restitution: float
) -> Floats:
    """Change of velocity in the collisions of one instant, (n, 3) float64, m/s.

    All of a particle's collisions start from the same velocities; those of two particles of fluid
    cancel, so that momentum is kept.

    0 on walls and dummies.

    Parameters
    ----------
    velocity : (n, 3) float64, m/s
    kind : (n,) int8
        The mould does not give way.
    distance_m : float, m
        Nearer than which particles collide.
    restitution : float
        Speed of parting over that of approach.
    """
    change = np.zeros_like(velocity)
    for i in range(len(kind)):
        if kind[i] == FLUID:
            for k in range(near.start[i], near.start[i + 1]):
                away = near.away_m[k]
                r2 = away[0] ** 2 + away[1] ** 2 + away[2] ** 2
                closing = -approach(near, velocity, k, i)
                if r2 < distance_m**2 and closing > 0.0:
                    share = 0.5 if kind[near.other[k]] == FLUID else 1.0
                    change[i] -= (1.0 + restitution) * share * closing / r2 * away
    return change


class DivergedError(ArithmeticError):
    """Velocities are not numbers, or beyond the limit."""


class EscapedError(ArithmeticError):
    """Fluid left the mould."""


@dataclass(frozen=True)
class FlowGuard:
    """When a run is stopped."""

    speed_m_s: float = math.inf
    """Largest speed that can be true."""
    low_m: tuple[float, float, float] = (-math.inf,) * 3
    high_m: tuple[float, float, float] = (math.inf,) * 3
    """Bounds that no fluid may leave."""


@dataclass
class RunningCost:
    """What a run has taken so far."""

    steps: int = 0
    iterations: int = 0
    """Of the Poisson solver, over all relaxations."""
    particle_solves: int = 0
    """Particles over all steps, once and once for every relaxation; one of the mould counts as
    ``MOULD_SHARE`` of one of fluid, and each step as a whole number."""
    wall_s: float = 0.0
    pressure_s: float = 0.0
    """Building and solving the Poisson equation."""
    neighbours_s: float = 0.0


@dataclass(frozen=True)
class FlowProgress:
    """Where a run is."""

    time_s: float
    percent: float
    particle_solves_per_s: float
    left_s: float
    """Wall time to the end, at the rate so far."""


def solves(scheme: Scheme, fluid: int, particles: int) -> int:
    """Work of one step, as ``Cost.particle_solves``, from the fluid's particles and all."""
    return round((fluid + MOULD_SHARE * (particles - fluid)) * (1 + scheme.relaxations))


class Flow:
    """Particles moved by MPS; ``particles``, ``pressure_pa`` and ``time_s`` may be read at will."""

    def __init__(
        self,
        particles: Particles,
        kernel: Kernel,
        metal: LiquidMetal | None = None,
        scheme: Scheme | None = None,
        guard: FlowGuard | None = None,
    ) -> None:
        """Start at time 0, without pressure; what is not given is the paper's."""
        self.kernel = kernel
        self.metal = metal or LiquidMetal()
        self.scheme = scheme or Scheme()
        self.guard = guard or FlowGuard()
        self.time_s = 0.0
        self.cost = RunningCost()
        self._set(particles)

    def _set(self, particles: Particles) -> None:
        self.particles = particles
        self.fluid = particles.fluid
        self.pressure_pa = np.zeros(len(particles.kind))
        """(n,) float64, Pa: sum over the relaxations of the last step, whose impulse it is."""
        self._solved_pa = np.zeros((self.scheme.relaxations, len(particles.kind)))
        """Of each relaxation of the last step, close to that of the same one in the next."""
        self._listed: VerletList | None = None

    def pour(self, particles: Particles) -> None:
        """Add particles."""
        pressure, solved = self.pressure_pa, self._solved_pa
        self._set(self.particles.joined(particles))
        self.pressure_pa[: len(pressure)] = pressure
        self._solved_pa[:, : len(pressure)] = solved

    def arrays(self) -> dict[str, Any]:
        """All that the next step depends on, and the cost so far, for a checkpoint."""
        cost = {f"cost_{name}": value for name, value in vars(self.cost).items()}
        return vars(self.particles) | cost | {
            "flow_pressure_pa": self.pressure_pa, "solved_pa": self._solved_pa,
            "time_s": self.time_s,
        }  # fmt: skip

    def take_up(self, arrays: Mapping[str, Any]) -> None:
        """Go on from what ``arrays`` gave: the rest comes out bit for bit as in one run."""
        self._set(Particles(arrays["position_m"], arrays["velocity_m_s"], arrays["kind"]))
        self.pressure_pa, self.time_s = arrays["flow_pressure_pa"], float(arrays["time_s"])
        self.cost = RunningCost(*(arrays[f"cost_{name}"].item() for name in vars(self.cost)))
        self._solved_pa = arrays["solved_pa"]

    def speed(self) -> Floats:
        """Speeds of the fluid, (m,) float64, m/s."""
        return np.sqrt((self.particles.velocity_m_s[self.fluid] ** 2).sum(axis=1))

    def next_dt_s(self) -> float:
        """Longest step that eq. (8), the viscosity and the scheme allow."""
        size_m, nu = self.kernel.spacing_m, self.metal.viscosity_m2_s
        fastest = float(self.speed().max(initial=0.0))
        courant = self.scheme.courant * size_m / fastest if fastest > 0.0 else math.inf
        viscous = VISCOUS_SHARE * size_m**2 / nu if nu > 0.0 else math.inf
        return min(self.scheme.dt_max_s, courant, viscous)

    def step(self, dt_s: float | None = None) -> None:
        """Make one time step.

        Raises
        ------
        DivergedError, EscapedError
            When a guard strikes.
        ClosedRegionError, NotSolvedError
            From ``solve_pressure``.
        """
        begin = time.perf_counter()
        dt = dt_s or self.next_dt_s()
        state, kernel, scheme = self.particles, self.kernel, self.scheme
        near = self._neighbours()
        x, u = state.position_m, state.velocity_m_s
        compression_before = near.density / kernel.lattice_density - 1.0
        rate_before = density_rate(kernel, near, u) / kernel.lattice_density
        friction = self.metal.viscosity_m2_s * LAPLACIANS[scheme.laplacian](
            kernel, near, u, state.kind
        )
        u[self.fluid] += dt * (friction[self.fluid] + np.asarray(self.metal.gravity_m_s2))
        x[self.fluid] += dt * u[self.fluid]
        if scheme.collision_distance > 0.0:
            self._collide(dt)
        self.pressure_pa = np.zeros(len(state.kind))
        for number in range(scheme.relaxations):
            self._relax(number, dt, compression_before, rate_before)
        if scheme.shifting > 0.0:
            self._shift()
        self.time_s += dt
        self.cost.steps += 1
        self.cost.particle_solves += solves(scheme, int(self.fluid.sum()), len(self.fluid))
        self._check()
        self.cost.wall_s += time.perf_counter() - begin

    def advance(
        self,
        until_s: float,
        each: Callable[[Flow], None] | None = None,
        progress: Callable[[FlowProgress], None] | None = None,
    ) -> None:
        """Step until a time.

        ``each``, function of the flow: called after every step. ``progress``, function of a
        ``FlowProgress``: called after every step.
        """
        begin_s, wall_s, done = self.time_s, self.cost.wall_s, self.cost.particle_solves
        while self.time_s < until_s * (1.0 - 1e-12):
            # equal parts of what is left: a last crumb of a step would have a huge pressure
            left_s = until_s - self.time_s
            self.step(left_s / math.ceil(left_s / self.next_dt_s() - 1e-9))
            if each:
                each(self)
            if progress:
                spent_s = self.cost.wall_s - wall_s
                share = (self.time_s - begin_s) / (until_s - begin_s)
                rate = (self.cost.particle_solves - done) / spent_s
                end_s = spent_s * (1.0 - share) / share
                progress(FlowProgress(self.time_s, 100.0 * share, rate, end_s))

    def _neighbours(self) -> Neighbours:
        """Neighbours of now; candidates are listed anew when particles moved too far."""
        begin = time.perf_counter()
        x, kind = self.particles.position_m, self.particles.kind
        if self._listed is None or list_is_old(self.kernel, self._listed.listed_m, x):
            self._listed = find_candidates(self.kernel, x, kind)
        near = find_neighbours(self.kernel, self._listed, x, kind)
        self.cost.neighbours_s += time.perf_counter() - begin
        return near

    def _relax(
        self, number: int, dt: float, compression_before: Floats, rate_before: Floats
    ) -> None:
        """Correct velocities and positions once, for the number-th time in a step."""
        state, kernel, scheme = self.particles, self.kernel, self.scheme
        near = self._neighbours()
        compression = near.density / kernel.lattice_density - 1.0
        now = Tentative(
            kernel, near, state.kind, state.velocity_m_s, dt, compression, compression_before,
            rate_before,
        )  # fmt: skip
        source = SOURCES[scheme.source](now)
        surface = near.density < scheme.surface * kernel.lattice_density
        factor = scheme.source_share * self.metal.density_kg_m3 / dt**2
        begin = time.perf_counter()
        pressure, iterations = solve_pressure(
            kernel, near, state.kind, surface, factor * source, self._solved_pa[number],
            scheme.tolerance,
        )  # fmt: skip
        self.cost.pressure_s += time.perf_counter() - begin
        self.cost.iterations += iterations
        self._solved_pa[number] = pressure
        if not scheme.tension:
            np.maximum(pressure, 0.0, out=pressure)
        gradient = pressure_gradient(kernel, near, pressure, state.kind, scheme.gradient)
        change = dt / self.metal.density_kg_m3 * gradient
        state.velocity_m_s -= change
        state.position_m -= dt * change
        self.pressure_pa += pressure

    def _collide(self, dt: float) -> None:
        """Let what came too near part, and move on with the change."""
        state, scheme = self.particles, self.scheme
        distance_m = scheme.collision_distance * self.kernel.spacing_m
        change = collisions(
            self._neighbours(), state.velocity_m_s, state.kind, distance_m, scheme.restitution
        )
        state.velocity_m_s += change
        state.position_m += dt * change

    def _shift(self) -> None:
        """Move inner particles to where fewer are, with the velocity there; the surface stays."""
        state, kernel = self.particles, self.kernel
        near = self._neighbours()
        inner = self.fluid & (near.density >= self.scheme.surface * kernel.lattice_density)
        share_m2 = self.scheme.shifting * kernel.spacing_m**2
        shift_m = -share_m2 * crowding(kernel, near, state.kind)[inner]
        gradient = velocity_gradient(kernel, near, state.velocity_m_s, state.kind)[inner]
        state.velocity_m_s[inner] += np.einsum("ia,iab->ib", shift_m, gradient)
        state.position_m[inner] += shift_m

    def _check(self) -> None:
        """Stop a run that went wrong."""
        fastest = float(self.speed().max(initial=0.0))
        if not fastest <= self.guard.speed_m_s:  # also where it is no number
            raise DivergedError(
                f"the flow diverged at {self.time_s:.4g} s: a particle is as fast as "
                f"{fastest:.4g} m/s, the limit is {self.guard.speed_m_s:.4g} m/s"
            )
        place = self.particles.position_m[self.fluid]
        out = ((place < self.guard.low_m) | (place > self.guard.high_m)).any(axis=1)
        if out.any():
            raise EscapedError(
                f"{int(out.sum())} particles left the mould at {self.time_s:.4g} s, "
                f"the first at {np.round(place[out][0], 4).tolist()} m"
            )
