"""How hard a bed of sand is under its own weight: kappa, wave speed, and its first mode.

kappa is about the size of a grain over its mean overlap. A contact of spheres of diameter d under
the pressure P bears P d^2, so k_n over it is d over the overlap of k_n/(P d); one of discs of
thickness b bears P d b, which gives k_n/(P b) (Roux and Combe 2002; da Cruz et al. 2005).
"""

from __future__ import annotations

from dataclasses import dataclass

from sandmould.scenario.contact import wave_speed_m_s
from sandmould.scenario.placement import nominal_fraction, plan_counts, predicted_bed_depth_m
from sandmould.scenario.scenario import Scenario

LEAST_KAPPA = 1000.0
"""Below it packing, density and angles are those of softer grains: rigid ones want 1e3 to 1e4."""
DEEP_OVERLAP = 0.05
"""Of a radius: the same bound for the overlaps that were measured."""


@dataclass(frozen=True)
class Hardness:
    """What is known before a run of how hard its bed is."""

    depth_m: float
    pressure_pa: float
    """At the foot of the bed: its weight on the floor, static, none of it carried by walls."""
    kappa_bed: float
    kappa_walls: float
    wave_speed_m_s: float
    """Along a row of grains."""

    @property
    def column_hz(self) -> float:
        """First mode of the bed as a column of such rows, fixed below and free above, c/(4 H)."""
        return column_mode_hz(self.wave_speed_m_s, self.depth_m)

    @property
    def soft(self) -> tuple[str, ...]:
        """What of it is softer than packing allows: bed, walls, both or none."""
        of = {"bed": self.kappa_bed, "walls": self.kappa_walls}
        return tuple(name for name, kappa in of.items() if kappa < LEAST_KAPPA)


def column_mode_hz(wave_speed_m_s: float, depth_m: float) -> float:
    """Lowest frequency of a column, fixed below and free above: a quarter of a wave, c/(4 H)."""
    return wave_speed_m_s / (4.0 * depth_m)


def column_speed_m_s(mode_hz: float, depth_m: float) -> float:
    """Wave speed of a column whose lowest frequency is known, c = 4 H f."""
    return 4.0 * depth_m * mode_hz


def bed_hardness(scenario: Scenario) -> Hardness | None:
    """Hardness of a scene's bed, by the springs as they are computed; None where nothing presses.

    The pressure at the foot is rho phi g H: the sand's density times the solid fraction that turns
    a layer's height into grains, over the depth of the bed that is expected.
    """
    depth_m = predicted_bed_depth_m(scenario, plan_counts(scenario))
    sand, laws = scenario.sand, scenario.laws
    pressure_pa = sand.density_kg_m3 * nominal_fraction(scenario) * scenario.gravity_m_s2 * depth_m
    if pressure_pa <= 0.0:
        return None
    across_m = sand.thickness_m if scenario.dimension == 2 else sand.mass_median_diameter_m
    return Hardness(
        depth_m,
        pressure_pa,
        laws.grain_grain.normal_stiffness_n_m / (pressure_pa * across_m),
        laws.grain_wall.normal_stiffness_n_m / (pressure_pa * across_m),
        wave_speed_m_s(sand, laws, scenario.dimension),
    )
