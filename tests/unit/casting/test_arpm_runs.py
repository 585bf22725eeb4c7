from __future__ import annotations

import numpy as np
import pytest

from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.marching import stage_weights
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.casting.arpm.method import HeatMethod, power_exchange
from sandmould.casting.arpm.raster import Raster
from sandmould.casting.arpm.solidification import UnstableError, probe_weights, solidify
from tests.verification.castings.contact import contact_elements
from tests.verification.castings.plates import plates_layout, read_plates

STEEL = ThermalMaterial("steel", 7200.0, 711.0, 29.3, 272e3, 1713.0, 1773.0)
SAND = ThermalMaterial("sand", 1600.0, 1130.0, 1.255)
FILLING = Filling((SAND, STEEL), (293.0, 1823.0), 1 / 837.0)


def block(dimensions: int) -> Raster:
    material = np.zeros([12] * dimensions, dtype=np.int64)
    material[tuple([slice(4, 8)] * dimensions)] = 1
    return Raster(material, 0.01, np.zeros(dimensions))


def test_a_cube_freezes_faster_than_a_bar() -> None:
    time_s = {}
    for dimensions in (2, 3):
        raster = block(dimensions)
        elements = placed(raster)
        for exchange in ("faces", "difference"):
            marching = HeatMethod(exchange, "explicit").marching(elements, FILLING, raster)
            found = solidify(elements, FILLING, marching, record_s=20.0)
            time_s[dimensions, exchange] = found.solidification_time_s
            assert np.abs(found.drift_percent).max() < 1e-10
    assert time_s[3, "faces"] < 0.8 * time_s[2, "faces"]
    for dimensions in (2, 3):
        a, b = (time_s[dimensions, name] for name in ("faces", "difference"))
        assert a == pytest.approx(b, rel=1e-9)


def test_too_long_a_step_is_told() -> None:
    raster = block(2)
    elements = placed(raster)
    marching = HeatMethod("faces", "explicit", step_share=8.0).marching(elements, FILLING, raster)
    with pytest.raises(UnstableError, match="the time step is too long"):
        solidify(elements, FILLING, marching, record_s=100.0)


def test_runs_that_make_no_sense() -> None:
    raster = block(2)
    elements = placed(raster)
    marching = HeatMethod("faces").marching(elements, FILLING, raster)
    with pytest.raises(ValueError, match="probe A is at"):
        solidify(elements, FILLING, marching, {"A": np.array([0.5, 0.5])})
    with pytest.raises(ValueError, match="it needs 2 coordinates"):
        solidify(elements, FILLING, marching, {"A": np.array([0.05])})
    with pytest.raises(ValueError, match="record_s is"):
        solidify(elements, FILLING, marching, record_s=0.0)
    with pytest.raises(ValueError, match="at least 3"):
        stage_weights(2)
    with pytest.raises(ValueError, match="no layers"):
        HeatMethod("difference").marching(placed(raster, (0,)), FILLING, raster)
    with pytest.raises(ValueError, match="no case"):
        contact_elements("1-9")
    with pytest.raises(ValueError, match="no case"):
        plates_layout(read_plates(), "2-9")


def test_probes_give_linear_temperatures_exactly() -> None:
    elements = placed(Raster(np.zeros((16, 16), dtype=np.int64), 0.01, np.zeros(2)), (0,))
    places = {"corner": np.array([0.08, 0.08]), "centre": np.array([0.05, 0.07]),
              "anywhere": np.array([0.0731, 0.0577])}  # fmt: skip
    weights = probe_weights(elements, places)
    linear = 300.0 + elements.position_m @ np.array([100.0, -40.0])
    exact = [300.0 + place @ np.array([100.0, -40.0]) for place in places.values()]
    np.testing.assert_allclose(weights @ linear, exact, rtol=1e-12)


def test_probes_look_at_their_own_material_alone() -> None:
    elements = placed(block(2))
    hot = np.where(elements.material == 1, 1800.0, 300.0)
    beside = {"casting": np.array([0.0401, 0.06]), "mould": np.array([0.0399, 0.06])}
    np.testing.assert_allclose(probe_weights(elements, beside) @ hot, [1800.0, 300.0])


def test_power_diagrams_refuse_elements_without_a_cell() -> None:
    place = np.array([[0.5, 0.5], [1.5, 0.5], [1.55, 0.5]])
    flat = Elements(place, np.array([1.0, 1.0, 0.1]), np.zeros(3, dtype=np.int64), np.zeros(2),
                    np.array([2.0, 1.0]))  # fmt: skip
    with pytest.raises(ValueError, match="lies in no cell of its own"):
        power_exchange(flat, np.ones(1), 0.0)
    cubes = placed(block(3))
    with pytest.raises(ValueError, match="drawn in 2D"):
        power_exchange(cubes, np.ones(2), 0.0)
