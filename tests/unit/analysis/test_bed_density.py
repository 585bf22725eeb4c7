"""The bed's own solid fraction: that of a lattice, whatever lies beside the bed."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.analysis.solid_fraction import own_solid_fraction
from sandmould.geometry.geometry import Block, Cavity, Scene
from tests.unit.analysis.test_loose_zones import GRAIN_M, box, lattice_round

CUBIC = np.pi / 6.0
"""Solid fraction of spheres that touch in rows."""
TOLD = 0.02
"""Two standard errors of some ten thousand places drawn at random."""


def own(places: np.ndarray, scene: Scene) -> float:
    return own_solid_fraction(places, np.full(len(places), GRAIN_M / 2), scene, GRAIN_M)


@pytest.mark.parametrize("shift_m", [0.0, 0.5 * GRAIN_M])
def test_a_gap_beside_a_part_changes_nothing_wherever_the_part_lies(shift_m: float) -> None:
    # Between block and left wall, too near for a row of grains with room, no spheres are left.
    centre_m = np.array([0.0035 + shift_m, 0.007, 0.004])
    block = Block("part", centre_m, np.array([2.5, 7.0, 4.0]) * GRAIN_M, np.eye(3))
    places = lattice_round(block)
    empty = (places[:, 0] < centre_m[0]) & (places[:, 2] < 0.008)
    assert own(places[~empty], box(block)) == pytest.approx(CUBIC, rel=TOLD)


def test_an_empty_space_that_sand_should_fill_is_none_of_the_bed() -> None:
    hole = Block("hole", np.array([7.0, 7.0, 12.0]) * GRAIN_M, np.full(3, 3.0) * GRAIN_M, np.eye(3))
    scene = Scene(3, box().walls, (), (), cavities=(Cavity("hole", hole, -np.eye(3)[2]),))
    assert own(lattice_round(hole), scene) == pytest.approx(CUBIC, rel=TOLD)


def test_a_bed_too_small_for_undisturbed_sand_tells_nothing() -> None:
    low = lattice_round()
    assert np.isnan(own(low[low[:, 2] < 2 * GRAIN_M], box()))
    assert np.isnan(own(np.zeros((0, 3)), box()))
