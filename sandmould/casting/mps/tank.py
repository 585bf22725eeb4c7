"""The paper's still fluid: 40 mm x 80 mm of molten aluminium at rest in a mould (figure 2)."""

from __future__ import annotations

import numpy as np

from sandmould.arrays import Flags, Floats
from sandmould.casting.mps.flow import Flow, FlowGuard
from sandmould.casting.mps.particles import (
    FLUID,
    WALL_LAYERS,
    Particles,
    at_rest,
    lattice,
    mould_around,
)
from sandmould.casting.mps.scheme import LiquidMetal, Scheme
from sandmould.casting.mps.weight import make_kernel

SPACING_M = 2e-3
COLUMNS, ROWS = 20, 40
WALL_ROWS = 51
"""Of the side walls: three layers by this height and a floor of three make the paper's 384."""


def still_tank(columns: int = COLUMNS, rows: int = ROWS, spacing_m: float = SPACING_M) -> Particles:
    """Fluid on its lattice in an open box, its walls as far above it as in the paper."""

    def is_cavity(place: Floats) -> Flags:
        inside = (place[:, 0] > 0.0) & (place[:, 0] < columns * spacing_m)
        return inside & (place[:, 1] > 0.0)

    top = rows + WALL_ROWS - ROWS
    sites = lattice((-WALL_LAYERS, -WALL_LAYERS), (columns + WALL_LAYERS, top), spacing_m)
    fluid = at_rest(lattice((0, 0), (columns, rows), spacing_m), FLUID)
    return fluid.joined(mould_around(sites, is_cavity, spacing_m))


def open_tank(
    scheme: Scheme,
    metal: LiquidMetal | None = None,
    columns: int = COLUMNS,
    rows: int = ROWS,
    spacing_m: float = SPACING_M,
) -> Flow:
    """Flow in the paper's tank, or in one of other size.

    The speed limit is that of a fall from three times the height of the walls: what started at
    rest can only be as fast if energy came from nowhere.
    """
    metal = metal or LiquidMetal()
    height_m = (rows + WALL_ROWS - ROWS) * spacing_m
    g = float(np.linalg.norm(metal.gravity_m_s2))
    margin = WALL_LAYERS * spacing_m
    guard = FlowGuard(
        float(np.sqrt(2.0 * g * 3.0 * height_m)),
        (-margin, -margin, -1.0),
        (columns * spacing_m + margin, 2.0 * height_m, 1.0),
    )
    tank = still_tank(columns, rows, spacing_m)
    return Flow(tank, make_kernel(2, spacing_m), metal, scheme, guard)
