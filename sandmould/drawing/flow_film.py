"""Films of metal that flows: particles coloured by pressure or speed, packed into the page.

Packed as the films of sand are; ``templates/report/flow_film.js`` unpacks and draws them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.drawing import animation

Array = NDArray[np.float64]
MOST_FRAMES = 150
LEVELS = 4095
"""Quanta across the longest side."""
SHADES = 255


@dataclass(frozen=True, kw_only=True)
class FlowFilm(animation.PackedFilm):
    """Particles.

    ``data`` has coordinates by axis, frame and particle, then shades of pressure and of speed by
    frame and particle (uint8).
    """

    dimension: int
    particles: int
    low_m: tuple[float, ...]
    high_m: tuple[float, ...]
    """Corners of what is shown: the mould with its walls."""
    particle_m: float
    wall_m: tuple[tuple[float, float], ...]
    """Walls across and up."""
    highest_pa: float
    """Full shade of the pressure, and below of the speed."""
    highest_m_s: float


def make_flow_film(
    fields: Mapping[str, Array], run: str, label: str, highest_pa: float, budget_bytes: int
) -> FlowFilm:
    """Pack the records of a run; records are left out to keep the budget, particles never."""
    total = len(fields["time_s"])
    return animation.within_budget(
        lambda chosen: _pack(fields, chosen, run, label, highest_pa),
        total, min(total, MOST_FRAMES), budget_bytes,
    )  # fmt: skip


def _pack(
    fields: Mapping[str, Array],
    chosen: Sequence[int],
    run: str,
    label: str,
    highest_pa: float,
) -> FlowFilm:
    ends = np.cumsum(fields["count"])
    most, d = int(fields["count"].max()), fields["position_m"].shape[1]
    size_m, wall = float(fields["particle_m"]), fields["wall_m"]
    low_m, high_m = wall.min(axis=0) - 0.5 * size_m, wall.max(axis=0) + 0.5 * size_m
    quantum_m = float((high_m - low_m).max()) / LEVELS
    speed = np.linalg.norm(fields["velocity_m_s"], axis=1)
    # the few that splash may be far faster than the rest
    highest_m_s = float(np.nanquantile(speed, 0.99)) or 1.0
    place = np.full((d, len(chosen), most), animation.ABSENT, dtype=np.uint16)
    shade = np.zeros((2, len(chosen), most), dtype=np.uint8)
    for number, record in enumerate(chosen):
        own = slice(int(ends[record] - fields["count"][record]), int(ends[record]))
        count = int(fields["count"][record])
        steps = np.rint((fields["position_m"][own] - low_m) / quantum_m)
        # not what flew out, or NaN
        seen = (steps >= 0).all(axis=1) & (steps < animation.ABSENT).all(axis=1)
        place[:, number, :count] = np.where(seen, steps.T, animation.ABSENT)
        for k, share in enumerate(
            (fields["pressure_pa"][own] / highest_pa, speed[own] / highest_m_s)
        ):
            shade[k, number, :count] = np.rint(SHADES * np.clip(np.nan_to_num(share), 0.0, 1.0))
    raw = animation.split_bytes(animation.changes(place)) + shade.tobytes()
    near = wall if d == 2 else wall[(wall[:, 1] > 0.0) & (wall[:, 1] <= size_m)]
    return FlowFilm(
        run=run,
        label=label,
        dimension=d,
        particles=most,
        time_s=tuple(np.round(fields["time_s"][chosen], 6).tolist()),
        low_m=tuple(low_m.tolist()),
        high_m=tuple(high_m.tolist()),
        quantum_m=quantum_m,
        particle_m=size_m,
        wall_m=tuple(map(tuple, np.round(near[:, [0, -1]].astype(float), 6).tolist())),
        highest_pa=highest_pa,
        highest_m_s=highest_m_s,
        data=animation.encoded(raw),
    )
