"""When a plan says that a casting is solid, against the run and against what no mould can beat."""

from __future__ import annotations

import pytest

from sandmould.casting.arpm import scene
from sandmould.casting.arpm.elements import placed
from sandmould.casting.arpm.estimates import heat_to_lose_j_m3
from sandmould.casting.arpm.solidification import solidify
from sandmould.scenario.casting.solidification import Solidification

HALF_M = 0.01
"""Of the square that freezes, ten elements wide."""
METALS = {
    "aluminium": {
        "density_kg_m3": 2380, "heat_capacity_j_kg_k": 1080, "conductivity_w_m_k": 100,
        "latent_heat_j_kg": 398e3, "solidus_k": 930, "liquidus_k": 933, "initial_k": 970,
    },
    "steel": {
        "density_kg_m3": 7200, "heat_capacity_j_kg_k": 711, "conductivity_w_m_k": 29.3,
        "latent_heat_j_kg": 272e3, "solidus_k": 1713, "liquidus_k": 1773, "initial_k": 1823,
    },
}  # fmt: skip
MOULDS = {
    "sand": (1600, 1130, 1.255, 293),
    "dry sand": (1600, 1130, 0.4, 293),
    "steel die": (7800, 600, 30, 473),
    "chill": (8900, 4000, 50, 300),
}
"""Density, heat capacity, conductivity and initial temperature, in SI units."""


def square_in(mould: str, metal: str, h_w_m2_k: float) -> Solidification:
    density, heat_capacity, conductivity, cold_k = MOULDS[mould]
    poured = dict(METALS[metal])
    poured_k = poured.pop("initial_k")
    tree = {
        "casting": {"name": metal, **poured},
        "mould": {
            "name": mould, "density_kg_m3": density, "heat_capacity_j_kg_k": heat_capacity,
            "conductivity_w_m_k": conductivity,
        },
        "initial_k": {"casting": poured_k, "mould": cold_k},
        "heat_transfer_w_m2_k": h_w_m2_k,
        "box": {"low_m": [-0.06, -0.06], "high_m": [0.06, 0.06]},
        "shapes": [{"kind": "rectangle", "low_m": [-HALF_M] * 2, "high_m": [HALF_M] * 2}],
        "element_m": 0.002,
        "until_s": 20000,
    }  # fmt: skip
    return Solidification.model_validate(tree)


@pytest.mark.parametrize("mould", MOULDS)
@pytest.mark.parametrize("metal", METALS)
@pytest.mark.parametrize("h_w_m2_k", [50.0, 300.0, 1000.0])
def test_a_plan_is_near_its_run(mould: str, metal: str, h_w_m2_k: float) -> None:
    """0.7 to 1.3 of the run: one modulus and one depth stand for the whole casting."""
    asked = square_in(mould, metal, h_w_m2_k)
    raster, filling = scene.drawn_raster(asked), scene.filling_of(asked)
    elements = placed(raster, asked.layers)
    marching = scene.method_of(asked).marching(elements, filling, raster)
    run_s = solidify(elements, filling, marching, {}, 50.0, asked.until_s).solidification_time_s
    plan_s = scene.expected_s(asked)
    assert 0.7 < plan_s / run_s < 1.3
    # all heat down to the solidus through h into a mould that stays cold
    warming_k = asked.casting.solidus_k - asked.initial_k.mould
    assert plan_s > heat_to_lose_j_m3(asked) * HALF_M / 2 / (h_w_m2_k * warming_k)


def test_metal_poured_at_its_solidus_has_nothing_to_lose() -> None:
    asked = square_in("sand", "steel", 300.0)
    at_solidus = asked.initial_k.model_copy(update={"casting": asked.casting.solidus_k})
    assert scene.expected_s(asked.model_copy(update={"initial_k": at_solidus})) < 1e-3
