"""Metal that moves: four scenes with known answers, at a few settings of the method.

``python -m tests.verification.castings.moving`` computes all, a quarter of an hour of one core,
and prints the table of ``docs/how-to/metal_flow.md``.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from sandmould.arrays import Flags, Floats
from sandmould.casting.mps import computation
from sandmould.casting.mps.flow import Flow, FlowGuard
from sandmould.casting.mps.particles import (
    FLUID,
    WALL_LAYERS,
    at_rest,
    lattice,
    make_kernel,
    mould_around,
)
from sandmould.casting.mps.scheme import G_M_S2, LiquidMetal, Scheme
from sandmould.casting.mps.stability_measures import measure_flow
from sandmould.scenario.casting.flow import MetalFlow

SETTINGS = {
    "MR1-0.5, 0.1 ms, collisions": Scheme(1e-4, 1, 0.5, collision_distance=0.8),
    "MR5-0.5, 1 ms": Scheme(),
    "MR5-0.5, 1 ms, collisions": Scheme(collision_distance=0.8),
    "MR10-0.5, 2 ms, collisions": Scheme(2e-3, 10, 0.5, collision_distance=0.8),
}
WATER = LiquidMetal(1000.0, 1e-6)
MOST_OFF = 0.02
"""Of a period or a pressure, beyond which a run is biased."""
MOST_LOST = 0.05
"""Of the amplitude, in half a period, likewise; walls take less than half of it in these scenes."""
MOST_FRONT = 0.05
"""Of the distance run by a dam's front, likewise: what measured fronts differ by."""
MOST_GAINED = 0.01
"""Of the energy at the start, beyond which a run is noisy: nothing adds energy."""


@dataclass(frozen=True)
class Moved:
    """What came out of a scene."""

    stopped: str
    gained: float
    """Most energy over that at the start less 1, or the noise of the pressure over its limit."""
    off: float
    """Error of a period, front or pressure, as a share."""
    lost: float = 0.0
    """Share of the amplitude lost in half a period beyond what walls take."""
    most_off: float = MOST_OFF
    most_gained: float = MOST_GAINED

    @property
    def word(self) -> str:
        """Holds, noisy, biased or diverges; the worst that is true."""
        if self.stopped:
            return "diverges"
        if not (abs(self.off) <= self.most_off and self.lost <= MOST_LOST):
            return "biased"
        return "noisy" if self.gained > self.most_gained else "holds"


Inside = Callable[[Floats], Flags]


def plane(
    cavity: Inside, metal: Inside, columns: int, rows: int, size_m: float, scheme: Scheme
) -> Flow:
    """Water-like metal at rest in part of a plane cavity, open above."""
    low, high = (-WALL_LAYERS, -WALL_LAYERS), (columns + WALL_LAYERS, rows)
    sites = lattice(low, high, size_m)
    fluid = at_rest(sites[metal(sites) & cavity(sites)], FLUID)
    # thrice the fall from the top of the scene: energy came from nowhere
    guard = FlowGuard(math.sqrt(2.0 * G_M_S2 * 3.0 * rows * size_m))
    walls = mould_around(sites, cavity, size_m)
    return Flow(fluid.joined(walls), make_kernel(2, size_m), WATER, scheme, guard)


def watched(flow: Flow, until_s: float, see: Callable[[Floats], float]) -> tuple[str, Floats]:
    """Why a guard stopped the run, and time, what was seen, energy (J/kg) of each step."""
    rows = []

    def note(now: Flow) -> None:
        place, speed = now.particles.position_m[now.fluid], now.speed()
        energy = float((G_M_S2 * place[:, 1] + 0.5 * speed**2).mean())
        rows.append((now.time_s, see(place), energy))

    note(flow)
    stopped = ""
    try:
        flow.advance(until_s, note)
    except ArithmeticError as error:
        stopped = str(error)
    return stopped, np.array(rows).T


def swings(flow: Flow, until_s: float, see: Callable[[Floats], float], half_s: float, kept: float
           ) -> Moved:  # fmt: skip
    """Compare a swing that starts at rest at its extreme with its exact half period."""
    stopped, (time_s, value, energy) = watched(flow, until_s, see)
    sign = np.flatnonzero((value[:-1] > 0.0) != (value[1:] > 0.0))
    zero_s = time_s[sign] - value[sign] * np.diff(time_s)[sign] / np.diff(value)[sign]
    # counted particles flicker where a swing passes its mean: that is one passage
    zero_s = zero_s[np.diff(zero_s, prepend=-math.inf) > 0.25 * half_s]
    if len(zero_s) < 2:
        return Moved(stopped or "never swings back", math.nan, math.nan)
    # from the quarter at the start to the last passage
    off = (zero_s[-1] / (len(zero_s) - 0.5)) / half_s - 1.0
    within = (time_s > zero_s[-2]) & (time_s < zero_s[-1])
    left = float(np.abs(value[within]).max() / abs(value[0])) ** (1.0 / (len(zero_s) - 1))
    return Moved(stopped, float(energy.max() / energy[0] - 1.0), off, kept - left)


def slosh(scheme: Scheme) -> Moved:
    """A tank of 100 by 50 mm, 20 particles deep, its surface tilted by 6 mm up and down."""
    width, depth, size = 0.1, 0.05, 0.0025
    k = math.pi / width
    flow = plane(
        lambda p: (p[:, 0] > 0) & (p[:, 0] < width) & (p[:, 1] > 0),
        lambda p: p[:, 1] < depth + 0.006 * np.cos(k * p[:, 0]),
        40, 44, size, scheme,
    )  # fmt: skip
    half_s = math.pi / math.sqrt(G_M_S2 * k * math.tanh(k * depth))  # linear waves
    return swings(flow, 1.0, lambda p: float(p[:, 0].mean()) - 0.5 * width, half_s, 1.0)


def u_tube(scheme: Scheme) -> Moved:
    """Legs and base 20 mm wide (10 particles), 0.24 m long, 12 mm out of balance."""
    size, wide, gap, full, up = 0.002, 10, 40, 40, 6

    def cavity(p: Floats) -> Flags:
        x, y = p[:, 0] / size, p[:, 1] / size
        legs = ((x > 0) & (x < wide)) | ((x > wide + gap) & (x < 2 * wide + gap))
        base = (y < wide) & (x > 0) & (x < 2 * wide + gap)
        return np.asarray((y > 0) & (legs | base))

    def metal(p: Floats) -> Flags:
        left = p[:, 0] / size < wide + gap / 2
        return np.asarray(p[:, 1] / size < np.where(left, full + up, full - up))

    def level(p: Floats) -> float:
        return float((p[:, 0] < (wide + gap / 2) * size).sum() - len(p) / 2)

    length_m = (2 * (full - wide / 2) + wide + gap) * size
    half_s = math.pi / math.sqrt(2.0 * G_M_S2 / length_m)
    # a Stokes layer on both walls takes 7 %
    return swings(plane(cavity, metal, 2 * wide + gap, 80, size, scheme), 0.75, level, half_s, 0.93)


def dam_break(scheme: Scheme) -> Moved:
    """A column 57.15 mm wide (12 particles) and twice as high.

    The front is that of Martin and Moyce (1952) as remembered, over times t sqrt(2 g / a).
    """
    wide, per_width, far = 0.05715, 12, 5
    size, scale = wide / per_width, math.sqrt(2.0 * G_M_S2 / wide)
    measured = np.array([(1.219, 1.474), (1.997, 2.292), (2.547, 2.995), (3.345, 4.134)])

    def front(p: Floats) -> float:
        low = np.sort(p[p[:, 1] < 3.0 * size, 0])
        gap = np.flatnonzero(np.diff(low) > 2.1 * size)  # drops ahead of it do not count
        return float(low[gap[0]] if len(gap) else low[-1]) + 0.5 * size

    flow = plane(
        lambda p: (p[:, 0] > 0) & (p[:, 0] < far * wide) & (p[:, 1] > 0),
        lambda p: (p[:, 0] < wide) & (p[:, 1] < 2.0 * wide),
        far * per_width, 12 * per_width, size, scheme,
    )  # fmt: skip
    stopped, (time_s, at_m, energy) = watched(flow, 12.0 / scale, front)
    off = np.interp(measured[:, 0], time_s * scale, at_m / wide) / measured[:, 1] - 1.0
    return Moved(stopped, float(energy.max() / energy[0] - 1.0), float(off.mean()),
                 most_off=MOST_FRONT)  # fmt: skip


def pour(scheme: Scheme) -> Moved:
    """The paper's casting with a shoulder in particles of 6 mm; pressure at its bottom at rest."""
    scenario = MetalFlow(
        case={"kind": "shoulder", "particle_m": 0.006}, dt_max_s=scheme.dt_max_s,
        relaxations=scheme.relaxations, source_share=scheme.source_share,
        collision_distance=scheme.collision_distance, duration_s=4.5, measured_from_s=4.0,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        detail = computation.compute(scenario, Path(folder), "pour").outcome.detail
        series = pd.read_csv(Path(folder) / "work" / "series.tsv", sep="\t")
    found = measure_flow(scenario, series, detail)
    mean, ideal = found.mean_pa["bottom"], found.ideal_pa["bottom"]
    return Moved(detail, found.sd_pa["bottom"] / ideal, mean / ideal - 1.0, most_gained=0.1)


SCENES: Mapping[str, Callable[[Scheme], Moved]] = {
    "slosh": slosh,
    "U tube": u_tube,
    "dam break": dam_break,
    "pour": pour,
}


def main() -> None:
    """Compute the scenes that are named, or all, and print a row each."""
    for scene in sys.argv[1:] or SCENES:
        for name, scheme in SETTINGS.items():
            begun_s = time.process_time()
            it = SCENES[scene](scheme)
            print(
                f"| {scene} | {name} | {it.word} | {100 * it.off:+.1f} | {100 * it.lost:.0f} | "
                f"{100 * it.gained:+.1f} | {time.process_time() - begun_s:.0f} s | {it.stopped} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
