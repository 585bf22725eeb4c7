from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.filling import Filling, check_casting
from sandmould.casting.arpm.material import ThermalMaterial, enthalpy_table
from sandmould.casting.arpm.raster import Raster

STEEL = ThermalMaterial("steel", 7200.0, 711.0, 29.3, 272e3, 1713.0, 1773.0)
SAND = ThermalMaterial("sand", 1600.0, 1130.0, 1.255)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"density_kg_m3": -1.0}, "density_kg_m3 is -1.0"),
        ({"heat_capacity_j_kg_k": 0.0}, "heat_capacity_j_kg_k is 0.0"),
        ({"conductivity_w_m_k": math.nan}, "conductivity_w_m_k is nan"),
        ({"latent_heat_j_kg": -5.0}, "latent_heat_j_kg is -5.0"),
        ({"liquidus_k": 1700.0}, "solidus_k is 1713.0 and liquidus_k 1700.0"),
        ({"liquidus_k": math.inf}, "both a solidus and a liquidus"),
        ({"solidus_k": math.inf, "liquidus_k": math.inf}, "latent heat needs a solidus"),
    ],
)
def test_no_material_has_such_properties(changed: dict[str, float], words: str) -> None:
    given = {**STEEL.__dict__, **changed}
    with pytest.raises(ValueError, match=words):
        ThermalMaterial(**given)


def test_enthalpy_by_hand() -> None:
    table = enthalpy_table([SAND, STEEL], 1000.0)
    kelvin = np.array([1000.0, 1500.0, 1713.0, 1743.0, 1773.0, 1823.0])
    steel = np.ones(6, dtype=np.int64)
    # rho c = 7200 x 711 = 5119200; to the solidus 713 K, then 60 K and 7200 x 272e3 of melting
    capacity, melting = 5119200.0, 60 * 5119200.0 + 7200 * 272e3
    at_solidus = 713 * capacity
    expected = [0.0, 500 * capacity, at_solidus, at_solidus + melting / 2, at_solidus + melting,
                at_solidus + melting + 50 * capacity]  # fmt: skip
    found = table.enthalpy_j_m3(kelvin, steel)
    np.testing.assert_allclose(found, expected, rtol=1e-14)
    np.testing.assert_allclose(table.temperature_k(found, steel), kelvin, rtol=1e-14)


def test_a_pure_metal_melts_at_one_temperature() -> None:
    metal = ThermalMaterial("metal", 1000.0, 1000.0, 1.0, 1e5, 500.0, 500.0)
    table = enthalpy_table([metal], 400.0)
    one = np.zeros(3, dtype=np.int64)
    half_melted = np.array([1e8 + 0.5e8])
    assert table.temperature_k(half_melted, one[:1])[0] == 500.0
    found = table.enthalpy_j_m3(np.array([499.0, 500.0, 501.0]), one)
    np.testing.assert_allclose(found, [0.99e8, 2e8, 2.01e8])


def box(casting: slice) -> Elements:
    material = np.zeros((8, 8), dtype=np.int64)
    material[casting, casting] = 1
    return placed(Raster(material, 0.01, np.zeros(2)))


def test_castings_that_cannot_solidify() -> None:
    good = Filling((SAND, STEEL), (293.0, 1823.0))
    check_casting(box(slice(2, 6)), good)
    with pytest.raises(ValueError, match="there must be a mould"):
        check_casting(box(slice(None)), good)
    with pytest.raises(ValueError, match="there must be a casting"):
        check_casting(box(slice(0)), good)
    with pytest.raises(ValueError, match=r"steel starts at 1500.0 K"):
        check_casting(box(slice(2, 6)), Filling((SAND, STEEL), (293.0, 1500.0)))
    with pytest.raises(ValueError, match="each needs one"):
        Filling((SAND, STEEL), (293.0,))
    with pytest.raises(ValueError, match="initial_k"):
        Filling((SAND, STEEL), (293.0, -1.0))
    with pytest.raises(ValueError, match="only 1 are listed"):
        Filling((SAND,), (293.0,)).heat(box(slice(2, 6)))
