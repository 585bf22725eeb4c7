"""Pressure at fixed places, and what its history says of stability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sandmould.arrays import Floats, Ints
from sandmould.casting.mps.flow import Flow
from sandmould.casting.mps.particles import DUMMY, weight


def pressure_at(flow: Flow, place_m: Floats) -> Floats:
    """Pressure at places: the mean of fluid and walls around, weighted by eq. (1).

    Gives (k,) float64, Pa; NaN where nothing is within the kernel. ``place_m``: (k, 3) float64, m.
    """
    state = flow.particles
    has_pressure = state.kind != DUMMY
    far = np.linalg.norm(state.position_m[has_pressure][None] - place_m[:, None], axis=2)
    pressure_pa = np.full(len(place_m), np.nan)
    for k, row in enumerate(far):
        near = np.flatnonzero(row < flow.kernel.reach_m)
        shares = np.array([weight(flow.kernel, float(r)) for r in row[near]])
        if shares.sum() > 0.0:
            pressure_pa[k] = shares @ flow.pressure_pa[has_pressure][near] / shares.sum()
    return pressure_pa


def pressure_nearest(flow: Flow, place_m: Floats) -> Floats:
    """Pressure of the fluid's particle nearest to each place; arguments as ``pressure_at``."""
    place = flow.particles.position_m[flow.fluid]
    far = np.linalg.norm(place[None] - place_m[:, None], axis=2)
    return flow.pressure_pa[flow.fluid][far.argmin(axis=1)]


def window_means(
    time_s: Floats, dt_s: Floats, values: Floats, window_s: float
) -> tuple[Ints, Floats, Floats]:
    """Means over windows of time, steps weighted by their length.

    ``time_s``, ``dt_s``, (t,) float64, s: ends and lengths of the steps. ``values``:
    (t, k) float64.

    Returns
    -------
    number : (w,) int64
        Of each window that holds the middle of a step.
    weight : (w,) float64, s
    mean : (w, k) float64
    """
    window = ((time_s - 0.5 * dt_s) / window_s).astype(np.int64)
    weight = np.bincount(window, dt_s).astype(np.float64)
    sums = [np.bincount(window, dt_s * column) for column in values.T]
    held = np.flatnonzero(weight > 0.0)
    return held, weight[held], np.stack(sums, axis=1)[held] / weight[held, None]


@dataclass(frozen=True)
class History:
    """What was watched, once a step."""

    time_s: Floats
    """(t,) float64, s."""
    dt_s: Floats
    """(t,) float64, s."""
    pressure_pa: Floats
    """(t, k) float64, Pa: around each place."""
    particle_pressure_pa: Floats
    """(t, k) float64, Pa: of the particle nearest to each place."""
    largest_speed_m_s: Floats
    """(t,) float64, m/s."""
    mean_speed_m_s: Floats
    """(t,) float64, m/s."""
    kinetic_energy_j_kg: Floats
    """(t,) float64, J/kg: mean over the fluid."""
    top_m: Floats
    """(t,) float64, m: height of the highest particle against gravity."""

    def mean_pa(self) -> Floats:
        """Mean in time of the pressure of the nearest particles, (k,) float64, Pa."""
        return np.asarray(np.average(self.particle_pressure_pa, axis=0, weights=self.dt_s))

    def deviation_pa(self, window_s: float = 0.0) -> Floats:
        """Standard deviation in time of the same, (k,) float64, Pa.

        ``window_s``: pressures are averaged over windows of this length before; 0 takes single
        steps. With c_poi = 1 the fluid is thrown up in one step and falls in the next: what such a
        run's deviation is depends on the window.
        """
        pressure, weights = self.particle_pressure_pa, self.dt_s
        if window_s > 0.0:
            _, weights, pressure = window_means(self.time_s, self.dt_s, pressure, window_s)
        apart = pressure - self.mean_pa()
        return np.asarray(np.sqrt(np.average(apart**2, axis=0, weights=weights)))


class Watch:
    """Collects a history; pass it to ``Flow.advance`` as ``each``."""

    def __init__(self, place_m: Floats) -> None:
        """Watch places, (k, 3) float64, m."""
        self._place = place_m
        self.rows: list[tuple[float, ...]] = []
        """One a step: time, speeds, energy, top, pressures around and of the nearest."""

    def __call__(self, flow: Flow) -> None:
        """Note the state after a step."""
        speed = flow.speed()
        g = np.asarray(flow.metal.gravity_m_s2)
        up = -g / max(float(np.linalg.norm(g)), 1e-300)
        self.rows.append(
            (
                flow.time_s,
                float(speed.max(initial=0.0)),
                float(speed.mean()),
                0.5 * float((speed**2).mean()),
                float((flow.particles.position_m[flow.fluid] @ up).max()),
                *pressure_at(flow, self._place),
                *pressure_nearest(flow, self._place),
            )
        )

    def history(self) -> History:
        """All that was noted so far."""
        k = len(self._place)
        rows = np.array(self.rows).reshape(-1, 5 + 2 * k)
        time_s = rows[:, 0]
        around, nearest = rows[:, 5 : 5 + k], rows[:, 5 + k :]
        dt_s = np.diff(time_s, prepend=0.0)
        return History(time_s, dt_s, around, nearest, *rows[:, 1:5].T)
