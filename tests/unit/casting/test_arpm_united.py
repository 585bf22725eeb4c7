"""Shells of one file that touch or overlap, off the grid: volume and surface of the union alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sandmould.casting.arpm.cut import with_cut
from sandmould.casting.arpm.elements import placed
from sandmould.casting.arpm.raster import painted
from tests.unit.geometry.test_mesh_union import SCENES, mesh_of

OFF = np.array([0.7, 0.4, 0.6])
"""From the grid, whose cells are 2 wide."""


@pytest.mark.parametrize("name", ["part of a face", "overlap with flush sides"])
def test_elements_have_the_volume_and_faces_the_area_of_the_union(
    name: str, tmp_path: Path
) -> None:
    mesh = mesh_of([(vertices + OFF, facets) for vertices, facets in SCENES[name][0]], tmp_path)
    raster = with_cut(painted(np.zeros(3), np.full(3, 52.0), 2.0, {1: mesh}), [mesh])
    elements = placed(raster)
    # counted at 64 points of each cut cell
    assert elements.volume_m3[elements.material == 1].sum() == pytest.approx(10880.0, rel=1e-3)
    assert raster.cut is not None
    # a cube of 20, and four sides of 20 by 12 of the arm
    area = raster.cut.area_share.sum() * 2.0**2
    assert area == pytest.approx(6 * 20**2 + 4 * 20 * 12, rel=1e-6)
