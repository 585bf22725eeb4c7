"""Watch a run: overlaps, energy, lost grains, numbers that are none."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sandmould.engines.neighbours import touching_pairs
from sandmould.engines.program import Stage
from sandmould.engines.session import EngineStop
from sandmould.engines.snapshot import Snapshot, scene_at
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind

ENERGY_FACTOR = 5.0
"""Kinetic energy, over the most that the fall and the vibration can give, that stops a run."""


@dataclass(frozen=True)
class Health:
    """What the guard saw in one snapshot."""

    kinetic_energy_j: float
    """Translational, relative to the box."""
    rms_speed_m_s: float
    largest_overlap_fraction: float
    """Over the smaller radius, walls included."""
    clearance_m: np.ndarray
    """(n,) float64, m: distance of the centres from the nearest wall or solid, exact up
    to the largest radius."""


def grain_masses_kg(scenario: Scenario, snapshot: Snapshot) -> np.ndarray:
    """Masses of all grains, (n,) float64, kg."""
    d = scenario.dimension
    unit = scenario.sand.grain_mass_kg(1.0, d)
    return unit * (2 * snapshot.radius_m) ** d


def measure_health(scenario: Scenario, snapshot: Snapshot) -> Health:
    """Kinetic energy, mean speed and largest overlap of a snapshot."""
    mass = grain_masses_kg(scenario, snapshot)
    energy = 0.5 * float(mass @ (snapshot.velocity_m_s**2).sum(axis=1))
    if not np.isfinite(snapshot.position_m).all():
        return Health(float("nan"), float("nan"), float("nan"), np.full(len(mass), np.nan))
    radius, largest = snapshot.radius_m, 0.0
    for first, second, overlap_m in touching_pairs(snapshot.position_m, radius):
        smaller = np.minimum(radius[first], radius[second])
        largest = max(largest, float((overlap_m / smaller).max(initial=0.0)))
    # beyond the largest grain's reach nothing can overlap, and meshes need not be searched
    reach_m = float(radius.max(initial=0.0))
    clearance = scene_at(scenario, snapshot).clearance_m(snapshot.position_m, reach_m)
    largest = max(largest, float((1 - clearance / radius).max(initial=0.0)))
    return Health(energy, float(np.sqrt(2 * energy / mass.sum())), largest, clearance)


class Guard:
    """Stops a run whose numbers cannot be trusted."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._energy_bound_j = np.inf

    def start_stage(self, stage: Stage, snapshot: Snapshot) -> None:
        """Bound the kinetic energy of a stage.

        All sand falling from the highest grain to the floor gives M g h; a bed thrown by walls
        of velocity A omega and meeting them head-on gains at most twice that, 2 M (A omega)^2.
        A table on mounts moves at most twice as fast as steadily where the sand tunes it best: it
        swings at its own frequency too when it starts.
        """
        s = self._scenario
        mass = float(grain_masses_kg(s, snapshot).sum())
        top = float((snapshot.position_m[:, -1] + snapshot.radius_m).max())
        piston = s.piston if stage.kind is StageKind.PRESS else None
        wall = 0.0 if piston is None else abs(piston.velocity_m_s)
        if stage.vibration is not None:
            omega, unbalance = stage.vibration.angular_frequency_rad_s, stage.vibration.unbalance
            if unbalance is None:
                wall = stage.vibration.amplitude_m * omega
            else:
                sand_kg = mass * s.sand_share(unbalance)
                wall = 2 * unbalance.largest_amplitude_m(omega, sand_kg) * omega
        fastest = max((math.hypot(*g.velocity_m_s) for g in s.fill.grains if g.velocity_m_s),
                      default=0.0)  # fmt: skip
        bound = mass * (s.gravity_m_s2 * top + 2 * wall**2 + 0.5 * fastest**2)
        self._energy_bound_j = ENERGY_FACTOR * bound

    def check(self, snapshot: Snapshot) -> Health:
        """Measure a snapshot.

        Raises
        ------
        EngineStop
            With the outcome that fits and the worst grain's place.
        """
        health = measure_health(self._scenario, snapshot)
        at = f"at {snapshot.time_s:.6g} s in {snapshot.stage}"
        if not np.isfinite(health.kinetic_energy_j):
            raise EngineStop(Outcome.UNSTABLE, f"a position or velocity is not a number {at}")
        if health.kinetic_energy_j > self._energy_bound_j:
            raise EngineStop(
                Outcome.UNSTABLE,
                f"kinetic energy {health.kinetic_energy_j:.4g} J exceeds the bound "
                f"{self._energy_bound_j:.4g} J {at}",
            )
        clearance = health.clearance_m
        if (clearance < 0).any():
            i = int(clearance.argmin())
            place = ", ".join(f"{x:.4g}" for x in snapshot.position_m[i])
            raise EngineStop(
                Outcome.LOST_GRAINS,
                f"{int((clearance < 0).sum())} grains have their centre in or behind a wall {at}, "
                f"the deepest is grain {snapshot.id[i]} at ({place}) m",
            )
        limit = self._scenario.guard.largest_overlap_fraction
        if health.largest_overlap_fraction > limit:
            raise EngineStop(
                Outcome.OVERLAP_TOO_LARGE,
                f"an overlap of {health.largest_overlap_fraction:.3g} of the smaller radius {at}, "
                f"allowed is guard.largest_overlap_fraction = {limit:g}",
            )
        return health
