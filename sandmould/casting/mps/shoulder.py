"""The paper's casting with a shoulder: a cylinder, 40 mm wide below and 25 mm above (figure 8)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.casting.mps.flow import Cost, Flow, Guard, Progress
from sandmould.casting.mps.particles import (
    FLUID,
    WALL_LAYERS,
    Floats,
    Particles,
    at_rest,
    lattice,
    mould_around,
)
from sandmould.casting.mps.probes import pressure_at
from sandmould.casting.mps.scheme import Metal, Scheme
from sandmould.casting.mps.weight import make_kernel

HEIGHT_M, LOWER_M, UPPER_M = 0.18, 0.04, 0.025
"""Height of the casting and diameters of its halves."""
RATE_KG_S = 0.1
POURED_S = 4.0
SEEN_S = 4.5
"""When figure 8 is drawn."""
FREEBOARD = 10
"""Particles that the bore reaches above the casting."""
GRAVITY = (0.0, 0.0, -9.8)
POUR_M_S = 0.5
"""Downwards, at the top of the mould: the paper gives none. The stream is as wide as this and the
rate demand."""
HOP_SPEED_M_S = 0.5
"""Upward speed after pouring, beyond which metal hops: enough to rise 13 mm, six particles."""


def is_cavity(place_m: Floats, freeboard_m: float = 0.0) -> NDArray[np.bool_]:
    """Whether points are inside the mould, (n,) bool; the upper half may reach higher."""
    across_m = np.hypot(place_m[:, 0], place_m[:, 1])
    height_m = place_m[:, 2]
    wide = (height_m < 0.5 * HEIGHT_M) & (across_m < 0.5 * LOWER_M)
    narrow = (height_m < HEIGHT_M + freeboard_m) & (across_m < 0.5 * UPPER_M)
    return np.asarray((height_m > 0.0) & (wide | narrow))


def hydrostatic_pa(metal: Metal) -> float:
    """Pressure at the bottom of the full casting: 4410 Pa for aluminium."""
    return metal.density_kg_m3 * float(np.linalg.norm(metal.gravity_m_s2)) * HEIGHT_M


def _sites(size_m: float, freeboard_m: float) -> Floats:
    half = math.ceil(0.5 * LOWER_M / size_m) + WALL_LAYERS
    top = math.ceil((HEIGHT_M + freeboard_m) / size_m)
    return lattice((-half, -half, -WALL_LAYERS), (half, half, top), size_m)


def mould(size_m: float, freeboard_m: float) -> Particles:
    """Walls and dummies round the casting, open at the top."""
    return mould_around(
        _sites(size_m, freeboard_m), lambda place: is_cavity(place, freeboard_m), size_m
    )


def open_shoulder(size_m: float, scheme: Scheme, full: bool) -> Flow:
    """Flow in the mould, full of metal at rest or with a first layer to be poured on.

    Parameters
    ----------
    size_m : float, m
        Of the particles; the paper does not give it (2 mm make about 19 700 in the casting).
    scheme : Scheme
    full : bool

    Raises
    ------
    ValueError
        For particles too large to fill the narrow half with four.
    """
    if size_m > UPPER_M / 4:
        raise ValueError(
            f"particle size is {size_m} m: at most {UPPER_M / 4:.4g} m, a quarter of the bore"
        )
    freeboard_m = FREEBOARD * size_m
    sites = _sites(size_m, freeboard_m)
    casting = sites[is_cavity(sites)]
    fluid = at_rest(casting if full else casting[casting[:, 2] < size_m], FLUID)
    margin_m = (WALL_LAYERS + 1) * size_m
    half_m = 0.5 * LOWER_M + margin_m
    limit_m_s = 2.0 * math.sqrt(2.0 * 9.8 * (HEIGHT_M + freeboard_m)) + POUR_M_S
    guard = Guard(
        limit_m_s,
        (-half_m, -half_m, -margin_m),
        (half_m, half_m, HEIGHT_M + freeboard_m + HEIGHT_M),
    )
    everything = fluid.joined(mould(size_m, freeboard_m))
    return Flow(everything, make_kernel(3, size_m), Metal(gravity_m_s2=GRAVITY), scheme, guard)


class Ladle:
    """Pours layers of particles in at the top of the mould, at a constant rate."""

    def __init__(self, flow: Flow, rate_kg_s: float = RATE_KG_S) -> None:
        """Pour into a flow.

        Raises
        ------
        ValueError
            For a rate whose stream is wider than the bore at the pouring speed.
        """
        self._rate = rate_kg_s
        self._size_m = flow.kernel.spacing_m
        self._mass_kg = flow.metal.density_kg_m3 * self._size_m**3
        self._poured = 0
        area_m2 = rate_kg_s / flow.metal.density_kg_m3 / POUR_M_S
        cells = max(1, round(area_m2 / self._size_m**2))
        half = math.ceil(math.sqrt(cells))
        place = lattice((-half, -half), (half, half), self._size_m)
        layer = place[np.argsort(np.hypot(*place.T), kind="stable")][:cells]
        if np.hypot(*layer.T).max() > 0.5 * UPPER_M - 0.5 * self._size_m:
            raise ValueError(
                f"pouring rate is {rate_kg_s} kg/s: at {POUR_M_S} m/s the stream is wider than "
                f"the bore of {UPPER_M} m"
            )
        high_m = HEIGHT_M + 5 * self._size_m
        self._layer = np.column_stack((layer, np.full(cells, high_m)))

    @property
    def poured_kg(self) -> float:
        """Mass poured so far."""
        return self._poured * self._mass_kg

    def __call__(self, flow: Flow) -> None:
        """Add a layer whenever its mass is due; pass it to ``Flow.advance`` as ``each``."""
        due_kg = self._rate * min(flow.time_s, POURED_S)
        if self.poured_kg + len(self._layer) * self._mass_kg > due_kg:
            return
        fresh = at_rest(self._layer, FLUID)
        fresh.velocity_m_s[:, 2] = -POUR_M_S
        flow.pour(fresh)
        self._poured += len(self._layer)


@dataclass(frozen=True)
class Poured:
    """What figure 8 shows, as numbers."""

    particles: int
    """Of fluid."""
    bottom_pa: float
    """Mean in time, after the casting settled, round the middle of the bottom."""
    under_shoulder_pa: float
    """The same under the shoulder's ring, at half height."""
    ideal_bottom_pa: float
    """Of the depth that the metal really has."""
    ideal_shoulder_pa: float
    largest_rise_m_s: float
    """Fastest upward particle in the same time."""
    hops: bool
    """Whether that is faster than ``HOP_SPEED_M_S``."""
    stopped: str
    """Why a guard stopped the run, or nothing."""
    cost: Cost


def ring_m(size_m: float) -> Floats:
    """Places right under the shoulder, (8, 3) float64, m: between the halves' radii."""
    radius_m = 0.25 * (LOWER_M + UPPER_M)
    turn = np.arange(8) * math.pi / 4
    height_m = np.full(8, 0.5 * HEIGHT_M - size_m)
    return np.stack((radius_m * np.cos(turn), radius_m * np.sin(turn), height_m), axis=1)


def run_shoulder(
    flow: Flow,
    settle_s: float,
    watch_s: float,
    pour: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Poured:
    """Run a casting with a shoulder and measure its pressure at the end.

    Parameters
    ----------
    flow : Flow
        From ``open_shoulder``.
    settle_s : float, s
        Before measuring; with pouring ``SEEN_S`` less ``watch_s`` is the paper's.
    watch_s : float, s
        Over which pressures are averaged.
    pour : bool
        Whether metal is poured, or what is there is watched at rest.
    progress : function of a ``Progress``, optional
    """
    size_m = flow.kernel.spacing_m
    place = np.vstack(([[0.0, 0.0, 0.5 * size_m]], ring_m(size_m)))
    ladle = Ladle(flow) if pour else None
    rows: list[tuple[float, float, float]] = []

    def each(now: Flow) -> None:
        if ladle:
            ladle(now)
        if now.time_s > settle_s:
            around = pressure_at(now, place)
            rise = float(now.particles.velocity_m_s[now.fluid, 2].max())
            rows.append((around[0], float(around[1:].mean()), rise))

    stopped = ""
    try:
        flow.advance(settle_s + watch_s, each, progress)
    except ArithmeticError as error:
        stopped = str(error)
    seen = np.array(rows).reshape(-1, 3)
    nothing = not len(seen)
    bottom, ring = (math.nan, math.nan) if nothing else seen[:, :2].mean(axis=0).tolist()
    rise = math.nan if nothing else float(seen[:, 2].max())
    top_m = _level_m(flow)
    weight_pa_m = hydrostatic_pa(flow.metal) / HEIGHT_M
    return Poured(
        int(flow.fluid.sum()),
        bottom,
        ring,
        weight_pa_m * (top_m - float(place[0, 2])),
        weight_pa_m * max(0.0, top_m - float(place[1, 2])),
        rise,
        rise > HOP_SPEED_M_S,
        stopped,
        flow.cost,
    )


def _level_m(flow: Flow) -> float:
    """Height that the metal fills the mould to, by its volume."""
    size_m = flow.kernel.spacing_m
    freeboard_m = FREEBOARD * size_m
    sites = _sites(size_m, freeboard_m)
    height_m = np.sort(sites[is_cavity(sites, freeboard_m), 2])
    return float(height_m[min(int(flow.fluid.sum()), len(height_m)) - 1]) + 0.5 * size_m
