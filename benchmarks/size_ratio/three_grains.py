"""A small grain rolls down the groove between two large ones, and leaves them.

The large grains lie side by side on the floor between two walls, which hold them. Without rolling
resistance the small one leaves where nothing presses it any more, at an angle from the vertical
that energy gives; below the centres of the large grains nothing but an error can hold it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sandmould.arrays import Floats
from sandmould.scenario.scenario import Scenario
from tests.verification.cases.bench import Bench, scene

LARGE_M = 2e-3
"""Radius of the large grains, those of the paper's largest class at its scale 4."""
SPRING_N_M = 7e4
DENSITY_KG_M3 = 2400.0
STARTS = 16
PITCH_M = 8e-3
"""From one pair of large grains to the next."""
GAP_M = 1e-9
"""Between the grains at the start: a fall of it presses less than the weight does."""
APART = 1e-3
"""Gap, in radii of the small grain, at which it has left."""
DURATION_S = 0.15
SAMPLE_S = 2.5e-4


@dataclass(frozen=True)
class Groove:
    """One setting of three grains."""

    engine: str
    slip_normal: str
    ratio: float
    """Of the radii."""
    rolling_arm: float
    step: float
    """Over sqrt(m/k) of the small grain."""

    @property
    def small_m(self) -> float:
        """Radius of the small grain."""
        return LARGE_M / self.ratio

    @property
    def out_m(self) -> float:
        """Distance of the small grain from the line of the two centres."""
        return math.sqrt((LARGE_M + self.small_m) ** 2 - LARGE_M**2)

    def starts_deg(self) -> Floats:
        """Angles from the vertical at which it is let go; with a rolling arm it must be steeper."""
        least = 40.0 if self.rolling_arm else 15.0
        return np.linspace(least, least + 15.0, STARTS)

    def exact_deg(self) -> Floats:
        """Angles at which a grain that rolls without loss leaves.

        It turns (R + r)/r times as fast as it goes round, so that its energy is
        (1 + 0.4/cos2 b) m v2/2 with cos b = out/(R + r); nothing presses where v2 = g out cos a.
        """
        cos2 = (self.out_m / (LARGE_M + self.small_m)) ** 2
        share = 2.0 / (3.0 + 0.4 / cos2)
        return np.degrees(np.arccos(share * np.cos(np.radians(self.starts_deg()))))

    @property
    def scenario(self) -> Scenario:
        """The scene of all pairs."""
        return _scene(self)


def _scene(groove: Groove) -> Scenario:
    mass = DENSITY_KG_M3 * 4 / 3 * math.pi * groove.small_m**3
    pair = {
        "normal_stiffness_n_m": SPRING_N_M,
        "tangential_stiffness_n_m": SPRING_N_M,
        "rolling_stiffness_n_m": SPRING_N_M,
        "friction": 0.8,
        "damping_ratio": 1.0,
        "rolling_arm_fraction": groove.rolling_arm,
    }
    # Walls that hold the large grains.
    wall = pair | {
        "friction": 10.0,
        "rolling_arm_fraction": 1.0,
        "normal_stiffness_n_m": 10 * SPRING_N_M,
        "damping_ratio": 0.3,
    }
    return scene(
        groove.engine, 3, 4 * STARTS, (groove.small_m, LARGE_M), pair, wall,
        groove.step * math.sqrt(mass / SPRING_N_M),
        gravity_m_s2=9.81,
        box={"width_m": 4 * LARGE_M, "depth_m": (STARTS + 3) * PITCH_M, "height_m": 0.02},
        fill={"drop_height_m": 0.1},
        contact={"slip_normal": groove.slip_normal},
    )  # fmt: skip


def leaving_deg(groove: Groove) -> Floats:
    """Angle from the vertical at which each small grain leaves the large ones.

    Returns
    -------
    (STARTS,) float64, degrees
        That of the last sample in touch; up to 360 where a grain goes round below them, and the
        angle then where it never left.
    """
    start = np.radians(groove.starts_deg())
    row = (np.arange(STARTS) + 1.0) * PITCH_M
    turned, left = start.copy(), np.zeros(STARTS, dtype=bool)
    with Bench(groove.scenario) as bench:
        smalls, larges = (np.array(rows) for rows in bench.by_size())
        place = np.zeros((4 * STARTS, 3))
        for side, x in enumerate((LARGE_M, 3 * LARGE_M)):
            place[larges[side::2]] = np.column_stack(
                [np.full(STARTS, x), row, np.full(STARTS, LARGE_M)]
            )
        out = groove.out_m + GAP_M
        mine, idle = smalls[:STARTS], smalls[STARTS:]
        place[mine] = np.column_stack(
            [np.full(STARTS, 2 * LARGE_M), row + out * np.sin(start), LARGE_M + out * np.cos(start)]
        )
        number = np.arange(STARTS)
        place[idle] = np.column_stack(
            [
                LARGE_M * (0.5 + number % 4),
                (STARTS + 1.5) * PITCH_M + 2.2 * groove.small_m * (number // 4),
                np.full(STARTS, groove.small_m),
            ]
        )
        bench.place(place)
        for _ in range(round(DURATION_S / SAMPLE_S)):
            at = bench.advance(SAMPLE_S).position_m
            apart = np.max(
                [np.linalg.norm(at[mine] - at[larges[s::2]], axis=1) for s in (0, 1)], axis=0
            )
            left |= apart > LARGE_M + groove.small_m * (1.0 + APART)
            if left.all():
                break
            angle = np.arctan2(at[mine, 1] - row, at[mine, 2] - LARGE_M)
            on = turned + (angle - turned + math.pi) % (2 * math.pi) - math.pi
            turned = np.where(left, turned, on)
    return np.degrees(turned)
