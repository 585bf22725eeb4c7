"""What a run of a flow says of its stability: pressure noise, speeds, and the paper's verdict.

The paper judges a flow in figure 6 and table 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import pandas as pd

from sandmould.casting.mps import scene
from sandmould.casting.mps.probes import History, window_means
from sandmould.casting.mps.shoulder import HOP_SPEED_M_S
from sandmould.scenario.casting.flow import MetalFlow, StillTank

STEPS_S, COUNTS = (1e-4, 5e-4, 1e-3, 2e-3), (1, 2, 5, 10)
"""Largest time steps and numbers of relaxations, table 2: paired there, crossed in figure 6."""
SHARES = (1.0, 0.5, 0.2, 0.1)
"""c_poi, table 2."""
QUIET_PA = 200.0
"""Standard deviation at 70 mm below which 'the ideal pressure distribution could be achieved'."""
HOP_PARTICLES = 3.0
"""Rise of the highest particle above the filled height, in particles, beyond which fluid hops:
waves of a noisy surface lift whole rows by one or two, a particle three above it has left."""


MOST_OFF = 0.02
"""Of the exact pressure, beyond which a mean is biased: what a pressure must be known to for a
casting, and twice what the paper's own tank is off."""
MAPPED_ROWS, MAPPED_M2_S = (16, 60), (3e-6, 3e-5)
"""Particles in depth and viscosities round those of the map of figure 6, 40 and 1e-5 m2/s. Tanks of
4 to 12 particles were -2 to +4 % off, those of 20 with other viscosities -4.5 to +2.5 %."""


class StabilityRating(Enum):
    """The signs of figure 6, and one for what the paper does not judge."""

    EXCELLENT = "excellent"
    """Pressure deviates by less than ``QUIET_PA``, its mean is right, and nothing hops."""
    BIASED = "biased"
    """The same, but the mean is off by more than ``MOST_OFF``."""
    GOOD = "good"
    """The run ends, but the pressure oscillates more or fluid hops."""
    FAILED = "failed"
    """A guard stopped the run: the velocity diverged, fluid left the mould, no pressure found."""


def rate_stability(stopped: str, hops: bool, deviation_pa: float, off: float) -> StabilityRating:
    """Rate a run as the paper's figure 6 does, by numbers its text gives, and by its bias.

    ``stopped``: why a guard stopped it, or nothing. ``deviation_pa``: standard deviation in time of
    the pressure at the deepest place. ``off``: error of its mean there, over the exact pressure.
    """
    if stopped:
        return StabilityRating.FAILED
    if hops or not deviation_pa < QUIET_PA:
        return StabilityRating.GOOD
    return StabilityRating.EXCELLENT if abs(off) < MOST_OFF else StabilityRating.BIASED


def beyond_map(scenario: MetalFlow) -> list[str]:
    """Keys whose values lie beyond the map of figure 6, on which the method's limits rest."""
    ranges: list[tuple[str, float, Sequence[float]]] = [
        ("dt_max_s", scenario.dt_max_s, STEPS_S),
        ("relaxations", scenario.relaxations, COUNTS),
        ("source_share", scenario.source_share, SHARES),
        ("metal.viscosity_m2_s", scenario.metal.viscosity_m2_s, MAPPED_M2_S),
    ]
    if isinstance(scenario.case, StillTank):
        ranges.append(("case.depth_m", scene.cells_of(scenario.case)[1], MAPPED_ROWS))
    return [key for key, value, of in ranges if not min(of) <= value <= max(of)]


def still_hops(history: History, filled_m: float, spacing_m: float) -> bool:
    """Whether a particle left fluid that started at rest, filled to a height."""
    return float(history.top_m.max(initial=0.0)) > filled_m + HOP_PARTICLES * spacing_m


NOISE_WINDOW_S = 0.01
"""A second deviation is taken of means over windows of this length: with c_poi = 1 fluid is thrown
up in one step and falls in the next."""
_MEANS = ("mean_speed_m_s", "kinetic_energy_j_kg", "step_iterations")


@dataclass(frozen=True)
class StabilityMeasures:
    """What is measured from ``measured_from_s`` on; NaN where a guard stopped the run."""

    mean_pa: dict[str, float]
    """By probe."""
    sd_pa: dict[str, float]
    """Standard deviation in time, step by step."""
    window_sd_pa: dict[str, float]
    """The same of means over ``NOISE_WINDOW_S``."""
    ideal_pa: dict[str, float]
    """Hydrostatic, of the metal that is there at the end."""
    peak_speed_m_s: float
    average_speed_m_s: float
    hops: bool
    verdict: StabilityRating


def measure_flow(scenario: MetalFlow, table: pd.DataFrame, stopped: str) -> StabilityMeasures:
    """Measure and rate a run.

    ``table``: ``series.tsv``. ``stopped``: why a guard stopped it, or nothing.
    """
    names = [probe.name for probe in scene.probes_of(scenario)]
    whole = _history(table, names)
    past = _later(whole, scenario.measured_from_s)
    particles = int(table["particles"].iloc[-1]) if len(table) else 0
    is_measured = not stopped and len(past.time_s) > 0
    nothing = [math.nan] * len(names)
    sd = past.deviation_pa().tolist() if is_measured else nothing
    windows = past.deviation_pa(NOISE_WINDOW_S).tolist() if is_measured else nothing
    sd_pa = dict(zip(names, sd, strict=True))
    hops = _hops(scenario, table, whole)
    mean = past.mean_pa().tolist() if is_measured else nothing
    mean_pa, ideal_pa = dict(zip(names, mean, strict=True)), scene.ideal_pa(scenario, particles)
    at = scene.deepest(scenario)
    return StabilityMeasures(
        mean_pa,
        sd_pa,
        dict(zip(names, windows, strict=True)),
        ideal_pa,
        float(past.largest_speed_m_s.max()) if is_measured else math.nan,
        float(np.average(past.mean_speed_m_s, weights=past.dt_s)) if is_measured else math.nan,
        hops,
        rate_stability(stopped, hops, sd_pa[at], mean_pa[at] / max(ideal_pa[at], 1e-9) - 1.0),
    )


def _history(table: pd.DataFrame, names: Sequence[str]) -> History:
    time_s = table["time_s"].to_numpy(dtype=np.float64)
    pressure = table[[f"{name}_pa" for name in names]].to_numpy(dtype=np.float64)
    speeds = ("largest_speed_m_s", "mean_speed_m_s", "kinetic_energy_j_kg", "top_m")
    columns = (table[name].to_numpy(dtype=np.float64) for name in speeds)
    return History(time_s, np.diff(time_s, prepend=0.0), pressure, pressure, *columns)


def _later(past: History, from_s: float) -> History:
    later = past.time_s > from_s
    return History(*(getattr(past, name)[later] for name in History.__dataclass_fields__))


def _hops(scenario: MetalFlow, table: pd.DataFrame, past: History) -> bool:
    """Whether metal at rest, or poured in before, is thrown up."""
    case = scenario.case
    if isinstance(case, StillTank):
        return still_hops(past, case.depth_m, case.particle_m)
    full = table["particles"] >= scene.fluid_of(scenario)  # what splashes before does not hop
    later = table[full & (table["time_s"] > scenario.measured_from_s)]
    return bool((later["largest_rise_m_s"] > HOP_SPEED_M_S).any())


def by_window(table: pd.DataFrame, names: Sequence[str], window_s: float) -> pd.DataFrame:
    """Means over windows, and the fastest particle of each.

    A row a window, at its middle. ``table``: ``series.tsv``. ``names``: probes.
    """
    time_s = table["time_s"].to_numpy(dtype=np.float64)
    dt_s = np.diff(time_s, prepend=0.0)
    columns = [*(f"{name}_pa" for name in names), *_MEANS]
    values = table[columns].to_numpy(dtype=np.float64)
    number, _, mean = window_means(time_s, dt_s, values, window_s)
    window = ((time_s - 0.5 * dt_s) / window_s).astype(np.int64)
    fastest = table["largest_speed_m_s"].groupby(window).max()
    windows = pd.DataFrame(mean, columns=columns)
    windows.insert(0, "time_s", (number + 0.5) * window_s)
    windows["largest_speed_m_s"] = fastest.to_numpy()
    return windows
