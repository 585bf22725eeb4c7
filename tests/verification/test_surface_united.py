"""Grains on parts of one STL that touch or overlap feel the surface of the union alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sandmould.dem.surfaces import Surfaces
from tests.unit.geometry.test_mesh_union import Part, box, mesh_of
from tests.verification.probe import LAW, RADIUS_M, STEP_S, Probe

MM = 1e-3
LOW = box([-8 * MM, -4 * MM, -6 * MM], [0, 4 * MM, 0])
FLUSH = {
    "touching": box([0, -4 * MM, -6 * MM], [8 * MM, 4 * MM, 0]),
    "touching in part": box([0, -3 * MM, -5 * MM], [8 * MM, 3 * MM, 0]),
    "overlapping": box([-1 * MM, -3 * MM, -5 * MM], [8 * MM, 3 * MM, 0]),
    "just overlapping": box([-0.002 * MM, -3 * MM, -5 * MM], [8 * MM, 3 * MM, 0]),
}


def surfaces_of(parts: list[Part], folder: Path) -> Surfaces:
    mesh = mesh_of(parts, folder)
    surfaces = Surfaces(3)
    surfaces.add_facets("parts", mesh.vertices_m, mesh.triangles)
    return surfaces


@pytest.mark.parametrize("name", FLUSH)
def test_seam_of_flush_parts_is_not_felt(name: str, tmp_path: Path) -> None:
    plane = Surfaces(3)
    plane.add_plane("floor", np.zeros(3), np.array([0.0, 0.0, 1.0]))
    one, many = Probe(plane), Probe(surfaces_of([LOW, FLUSH[name]], tmp_path))
    scale = LAW.k_n * 0.02 * RADIUS_M
    velocity, spin = np.array([2.0, 0.3, 0.0]), np.array([30.0, -20.0, 10.0])
    place = np.array([-1500 * STEP_S * 2.0, 0.0, RADIUS_M * 0.98])
    for _ in range(3000):
        place = place + STEP_S * velocity
        a, b = one.touch(place, velocity, spin), many.touch(place, velocity, spin)
        assert b.contacts == a.contacts == 1
        # vertices of the file are rounded to seven digits
        assert np.abs(a.force - b.force).max() < 1e-3 * scale
        assert np.abs(a.moment - b.moment).max() < 1e-3 * scale * RADIUS_M


@pytest.mark.parametrize("sunk", [0.0, 0.002, 0.05, 2.0])
def test_corner_of_sunk_parts_has_two_contacts(sunk: float, tmp_path: Path) -> None:
    """A grain in the corner of a step touches floor and step, not what of the step lies below."""
    step = box([0, -3 * MM, -sunk * MM], [6 * MM, 3 * MM, 4 * MM])
    floor = box([-8 * MM, -4 * MM, -6 * MM], [8 * MM, 4 * MM, 0])
    probe = Probe(surfaces_of([floor, step], tmp_path))
    near = 0.98 * RADIUS_M
    still = np.zeros(3)
    force = probe.touch(np.array([-near, 0.0, near]), still, still)
    assert force.contacts == 2
    pushed = np.array([-force.force[2], 0.0, force.force[2]])
    np.testing.assert_allclose(force.force, pushed, atol=1e-3 * float(force.force[2]))
