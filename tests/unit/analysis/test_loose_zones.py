"""Loose sand: none in a lattice, and exactly where spheres of it were taken away."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.analysis.loose_zones import LOOSE, SIDES, LooseSand, find_loose_sand
from sandmould.geometry.geometry import Block, Scene, Wall

GRAIN_M = 0.001
ACROSS, DEEP = 14, 16
"""Spheres of the lattice along the box and up."""
WIDTH_M = ACROSS * GRAIN_M
BLOCK = Block(
    "part", np.array([7.0, 7.0, 9.0]) * GRAIN_M, np.array([3.0, 3.0, 1.0]) * GRAIN_M, np.eye(3)
)


def box(*blocks: Block) -> Scene:
    """A box of the lattice's size, open at the top."""
    walls = (
        Wall("floor", np.zeros(3), np.array([0.0, 0.0, 1.0])),
        *(
            Wall(name, np.array(point), np.array(normal))
            for name, point, normal in (
                ("left", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
                ("right", (WIDTH_M, 0.0, 0.0), (-1.0, 0.0, 0.0)),
                ("front", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
                ("back", (0.0, WIDTH_M, 0.0), (0.0, -1.0, 0.0)),
            )
        ),
    )
    return Scene(3, walls, blocks, ())


def lattice_round(*blocks: Block) -> np.ndarray:
    """Spheres that touch, in rows parallel to the box, but for those in blocks."""
    axes = [GRAIN_M * (np.arange(n) + 0.5) for n in (ACROSS, ACROSS, DEEP)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    for block in blocks:
        places = places[np.any(np.abs(places - block.centre_m) > block.half_size_m, axis=1)]
    return places


def found(places: np.ndarray) -> LooseSand:
    """What is loose of these spheres."""
    return find_loose_sand(places, np.full(len(places), GRAIN_M / 2), box(BLOCK), GRAIN_M)


def test_a_lattice_round_a_block_is_loose_nowhere() -> None:
    loose = found(lattice_round(BLOCK))
    assert loose.loose_fraction == 0.0
    assert loose.zones == ()
    assert all(loose.side_fraction[side] == 0.0 for side in SIDES)


def test_spheres_taken_from_under_a_block_leave_one_zone_under_it() -> None:
    places = lattice_round(BLOCK)
    under = np.abs(places - [0.007, 0.007, 0.0065]) <= np.array([0.0031, 0.0031, 0.0016])
    loose = found(places[~under.all(axis=1)])
    assert under.all(axis=1).sum() == 6 * 6 * 3
    (zone,) = loose.zones
    assert zone.side == "under"
    middle_m = 0.5 * (zone.low_m + zone.high_m)
    np.testing.assert_allclose(middle_m, [0.007, 0.007, 0.0065], atol=0.0005)
    assert (zone.near, zone.is_inside) == (BLOCK.name, False)
    own = loose.field.zone == 1
    # loose is what lies below 0.9 of the usual there
    assert (loose.field.share[own] < LOOSE).all()
    assert own.sum() * loose.field.cell_m**3 == pytest.approx(zone.measure)
    x_m = loose.field.low_m[0] + loose.field.cell_m * np.flatnonzero(own.any(axis=(1, 2)))
    assert (x_m[0], x_m[-1]) == pytest.approx((zone.low_m[0], zone.high_m[0]))
    # the space of 108 cells; its border is known to the ball's radius of 1.5 grains
    assert 4 * 4 * 2 < zone.measure / GRAIN_M**3 < 9 * 9 * 6
    assert zone.solid_fraction < 0.3
    assert loose.side_fraction["over"] == 0.0
    assert loose.side_fraction["under"] > 0.5


def test_a_heap_has_no_loose_sand_under_its_slope() -> None:
    """What lies within a ball of the open surface is no place of the bed."""
    places = lattice_round(BLOCK)
    loose = found(places[places[:, 2] < 0.008 + 0.5 * places[:, 0]])
    assert loose.loose_fraction < 0.01


def test_no_grains_are_loose_nowhere() -> None:
    loose = found(np.zeros((0, 3)))
    assert np.isnan(loose.loose_fraction)
    assert loose.zones == ()
