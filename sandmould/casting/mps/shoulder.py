"""The paper's casting with a shoulder: a cylinder, 40 mm wide below and 25 mm above (figure 8)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sandmould.arrays import Flags, Floats
from sandmould.casting.mps.flow import Flow, FlowGuard
from sandmould.casting.mps.particles import (
    FLUID,
    WALL_LAYERS,
    at_rest,
    lattice,
    make_kernel,
    mould_around,
)
from sandmould.casting.mps.scheme import LiquidMetal, Scheme

RATE_KG_S = 0.1
FREEBOARD = 10
"""Particles that the bore reaches above the casting."""
POUR_HEIGHT = 5
"""Particles above the casting where metal comes in."""
GRAVITY = (0.0, 0.0, -9.8)
POUR_M_S = 0.5
"""Downwards, at the top of the mould: the paper gives none. The stream is as wide as this and the
rate demand."""
HOP_SPEED_M_S = 0.5
"""Upward speed after pouring, beyond which metal hops: enough to rise 13 mm, six particles."""


@dataclass(frozen=True)
class Casting:
    """A cylinder with a shoulder at half its height; the paper's unless given."""

    height_m: float = 0.18
    lower_m: float = 0.04
    """Diameter of the lower half."""
    upper_m: float = 0.025

    def holds(self, place_m: Floats, freeboard_m: float = 0.0) -> Flags:
        """Whether points are inside the mould, (n,) bool; the upper half may reach higher."""
        across_m = np.hypot(place_m[:, 0], place_m[:, 1])
        height_m = place_m[:, 2]
        wide = (height_m < 0.5 * self.height_m) & (across_m < 0.5 * self.lower_m)
        narrow = (height_m < self.height_m + freeboard_m) & (across_m < 0.5 * self.upper_m)
        return np.asarray((height_m > 0.0) & (wide | narrow))

    def sites(self, size_m: float) -> Floats:
        """Lattice over casting, mould and bore above it, (n, 3) float64, m."""
        half = math.ceil(0.5 * self.lower_m / size_m) + WALL_LAYERS
        top = math.ceil((self.height_m + FREEBOARD * size_m) / size_m)
        return lattice((-half, -half, -WALL_LAYERS), (half, half, top), size_m)

    def filled_m(self, size_m: float) -> Floats:
        """Sites of the metal that fills it, (n, 3) float64, m."""
        sites = self.sites(size_m)
        return sites[self.holds(sites)]

    @property
    def volume_m3(self) -> float:
        """As drawn."""
        return math.pi / 8.0 * (self.lower_m**2 + self.upper_m**2) * self.height_m

    def level_m(self, size_m: float, particles: int) -> float:
        """Height that so many particles fill the mould to."""
        sites = self.sites(size_m)
        height_m = np.sort(sites[self.holds(sites, FREEBOARD * size_m), 2])
        return float(height_m[min(particles, len(height_m)) - 1]) + 0.5 * size_m


PAPERS = Casting()


def open_shoulder(
    size_m: float,
    scheme: Scheme,
    full: bool,
    metal: LiquidMetal | None = None,
    casting: Casting = PAPERS,
) -> Flow:
    """Flow in the mould, full of metal at rest or with a first layer to be poured on.

    ``size_m``: of the particles; the paper does not give it (2 mm make about 19 700 in the
    casting). ``metal``: the paper's unless given; its gravity is along -z.

    Raises
    ------
    ValueError
        For particles too large to fill the narrow half with four.
    """
    if size_m > casting.upper_m / 4 * (1.0 + 1e-9):
        raise ValueError(
            f"particle size is {size_m} m: at most {casting.upper_m / 4:.4g} m, a quarter of the "
            "bore"
        )
    metal = metal or LiquidMetal(gravity_m_s2=GRAVITY)
    freeboard_m = FREEBOARD * size_m
    walls = mould_around(
        casting.sites(size_m), lambda place: casting.holds(place, freeboard_m), size_m
    )
    filled = casting.filled_m(size_m)
    fluid = at_rest(filled if full else filled[filled[:, 2] < size_m], FLUID)
    margin_m = (WALL_LAYERS + 1) * size_m
    half_m = 0.5 * casting.lower_m + margin_m
    g = float(np.linalg.norm(metal.gravity_m_s2))
    top_m = casting.height_m + freeboard_m
    guard = FlowGuard(
        2.0 * math.sqrt(2.0 * g * top_m) + POUR_M_S,
        (-half_m, -half_m, -margin_m),
        (half_m, half_m, top_m + casting.height_m),
    )
    return Flow(fluid.joined(walls), make_kernel(3, size_m), metal, scheme, guard)


def stream(size_m: float, rate_kg_s: float, density_kg_m3: float, casting: Casting) -> Floats:
    """Sites across a stream at the pouring speed, (n, 2) float64, m.

    Raises
    ------
    ValueError
        For a rate whose stream is wider than the bore.
    """
    area_m2 = rate_kg_s / density_kg_m3 / POUR_M_S
    cells = max(1, round(area_m2 / size_m**2))
    half = math.ceil(math.sqrt(cells))
    place = lattice((-half, -half), (half, half), size_m)
    layer = place[np.argsort(np.hypot(*place.T), kind="stable")][:cells]
    if np.hypot(*layer.T).max() > 0.5 * casting.upper_m - 0.5 * size_m:
        raise ValueError(
            f"pouring rate is {rate_kg_s} kg/s: at {POUR_M_S} m/s the stream is wider than the "
            f"bore of {casting.upper_m} m"
        )
    return layer


class Ladle:
    """Pours layers of particles in at the top of the mould, at a constant rate until it is full."""

    def __init__(self, flow: Flow, rate_kg_s: float = RATE_KG_S, casting: Casting = PAPERS) -> None:
        """Pour into a flow; ValueErrors are those of ``stream``."""
        size_m = flow.kernel.spacing_m
        across = stream(size_m, rate_kg_s, flow.metal.density_kg_m3, casting)
        high_m = casting.height_m + POUR_HEIGHT * size_m
        self._layer = np.column_stack((across, np.full(len(across), high_m)))
        self._rate = rate_kg_s
        self._mass_kg = flow.metal.density_kg_m3 * size_m**3
        self.poured = 0
        """Particles so far."""
        self._wanted = len(casting.filled_m(size_m)) - int(flow.fluid.sum())

    @property
    def poured_kg(self) -> float:
        """Mass poured so far."""
        return self.poured * self._mass_kg

    @property
    def lasts_s(self) -> float:
        """Time until the casting is full."""
        return self._wanted * self._mass_kg / self._rate

    def __call__(self, flow: Flow) -> None:
        """Add a layer whenever its mass is due; pass it to ``Flow.advance`` as ``each``."""
        count = min(len(self._layer), self._wanted - self.poured)
        if count <= 0 or self.poured_kg + count * self._mass_kg > self._rate * flow.time_s:
            return
        fresh = at_rest(self._layer[:count], FLUID)
        fresh.velocity_m_s[:, 2] = -POUR_M_S
        flow.pour(fresh)
        self.poured += count


def ring_m(radius_m: float, height_m: float) -> Floats:
    """Places round the axis, (8, 3) float64, m."""
    turn = np.arange(8) * math.pi / 4
    return np.stack(
        (radius_m * np.cos(turn), radius_m * np.sin(turn), np.full(8, height_m)), axis=1
    )
