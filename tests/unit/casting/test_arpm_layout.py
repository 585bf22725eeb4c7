from __future__ import annotations

import numpy as np
import pytest

from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.exchange import faces_of
from sandmould.casting.arpm.kernel import kernel_exchange, neighbours, volume_weight, weight
from sandmould.casting.arpm.raster import Raster, painted
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from tests.unit.meshes import CORNERS, FACETS


def square(name: str, low: float, high: float) -> Outline:
    return Outline(name, np.array([(low, low), (high, low), (high, high), (low, high)]))


def test_weights_by_hand() -> None:
    np.testing.assert_allclose(weight(np.array([1.0, 2.0, 3.0]), np.full(3, 2.1)), [1.1, 0.05, 0])
    r, small, large = np.array([1.5]), np.array([1.0]), np.array([2.0])
    # reach 2.1: 2.1/1.5 - 1 = 0.4; reach 4.2: 4.2/1.5 - 1 = 1.8; volumes 1 and 4
    for form, seen_by_small, seen_by_large in (
        ("printed", (4 * 0.4 + 4 * 1.8) / 2, (1 * 1.8 + 1 * 0.4) / 8),
        ("corrected", (4 * 0.4 + 1 * 1.8) / 2, (1 * 1.8 + 4 * 0.4) / 8),
    ):
        by_small = volume_weight(r, small, large, 2.1, 2, form)  # type: ignore[arg-type]
        by_large = volume_weight(r, large, small, 2.1, 2, form)  # type: ignore[arg-type]
        assert by_small[0] == pytest.approx(seen_by_small)
        assert by_large[0] == pytest.approx(seen_by_large)


def test_neighbours_of_a_lattice() -> None:
    elements = placed(Raster(np.zeros((7, 7), dtype=np.int64), 1.0, np.zeros(2)))
    own, _, distance = neighbours(elements, 2.1)
    # 4 at 1, 4 at the diagonal, 4 at 2; walls are mirrors, so that edges have as many
    assert (np.bincount(own) == 12).all()
    density = np.bincount(own, weight(distance, np.full(len(distance), 2.1)))
    np.testing.assert_allclose(density, 4 * 1.1 + 4 * (2.1 / 2**0.5 - 1) + 4 * 0.05)


def test_layers_stay_beside_the_interface() -> None:
    material = np.zeros((32, 32), dtype=np.int64)
    material[:16] = 1
    elements = placed(Raster(material, 1.0, np.zeros(2)), (2, 2))
    across = elements.position_m[:, 1] < 0.6 * elements.size_m
    sizes = elements.size_m[across][np.argsort(elements.position_m[across, 0])]
    # blocks of 4 stand on a grid of 4, so that from the interface on a third middle one stays
    outward = [1, 1, 2, 2, 2, 4, 4]
    assert sizes.tolist() == outward[::-1] + outward
    for kept in (1, 3):
        few = placed(Raster(material, 1.0, np.zeros(2)), (kept,))
        # a block of two that holds the last layer kept stays small
        assert (few.size_m == 1.0).sum() == 2 * 32 * (kept + 1)
    with pytest.raises(ValueError, match="none may be negative"):
        placed(Raster(material, 1.0, np.zeros(2)), (-1,))


def test_faces_between_unequal_squares() -> None:
    material = np.zeros((6, 4), dtype=np.int64)
    material[:2] = 1
    elements = placed(Raster(material, 0.5, np.zeros(2)), (2,))
    faces = faces_of(elements)
    assert elements.counts() == {0.5: 16, 1.0: 2}
    # by hand: 12 + 12 faces in the small part of 4 x 4, 4 on the large elements, 1 between these
    assert len(faces.first) == 12 + 12 + 4 + 1
    assert faces.area_m2.sum() == pytest.approx(28 * 0.5 + 1.0)


def test_elements_that_fill_no_box() -> None:
    place = np.array([[0.5, 0.5], [1.4, 0.5]])
    elements = Elements(
        place, np.ones(2), np.zeros(2, dtype=np.int64), np.zeros(2), np.array([2, 1])
    )
    with pytest.raises(ValueError, match="no multiple of the smallest"):
        faces_of(elements)
    gap = Elements(
        place[:1], np.ones(1), np.zeros(1, dtype=np.int64), np.zeros(2), np.array([2, 1])
    )
    with pytest.raises(ValueError, match="overlap or leave gaps"):
        faces_of(gap)


def test_solids_are_painted_and_boxes_rounded() -> None:
    low, high = np.zeros(2), np.full(2, 1.0)
    raster = painted(low, high, 0.1, {1: square("block", 0.2, 0.5), 2: square("chill", 0.5, 0.8)})
    assert (raster.material == 1).sum() == 9
    assert (raster.material == 2).sum() == 9
    # the last one has the place of both
    over = painted(low, high, 0.1, {1: square("block", 0.2, 0.5), 2: square("chill", 0.4, 0.8)})
    assert over.material[4, 4] == 2
    with pytest.raises(ValueError, match="holds no cell"):
        painted(low, high, 0.1, {1: square("block", 1.2, 1.5)})
    with pytest.raises(ValueError, match="must be a multiple"):
        painted(low, high, 0.3, {1: square("block", 0.0, 1.0)})
    for place, low_m in ((0.0, 0.0), (0.3, 0.0), (0.7, -0.2)):
        rounded = painted(low, high, 0.3, {1: square("block", place, place + 0.3)})
        assert rounded.material.shape == (4, 4)
        np.testing.assert_allclose(rounded.low_m, low_m)
    with pytest.raises(ValueError, match="the mould's"):
        painted(low, high, 0.1, {0: square("block", 0.2, 0.5)})


def test_a_mesh_is_painted() -> None:
    cube = TriangleMesh("cube", CORNERS, FACETS)
    raster = painted(np.full(3, -0.5), np.full(3, 1.5), 0.25, {1: cube})
    assert (raster.material == 1).sum() == 4**3


def test_ratios_beyond_the_kernel_are_refused() -> None:
    material = np.zeros((32, 32), dtype=np.int64)
    material[:16] = 1
    conductivity = np.ones(2)
    abrupt = placed(Raster(material, 1.0, np.zeros(2)), (2, 0))
    with pytest.raises(ValueError, match=r"an element of 1 m lies within the reach of one of 4 m"):
        kernel_exchange(abrupt, conductivity, 0.0)
    kernel_exchange(abrupt, conductivity, 0.0, refuse_ratio=False)
    kernel_exchange(placed(Raster(material, 1.0, np.zeros(2)), (4, 4)), conductivity, 0.0)
    with pytest.raises(ValueError, match="the kernel size is"):
        kernel_exchange(abrupt, conductivity, 0.0, 0.9)
    with pytest.raises(ValueError, match="resistance_m2k_w is -1"):
        kernel_exchange(abrupt, conductivity, -1.0)
