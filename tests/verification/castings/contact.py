"""The one-dimensional test of section 3: hot and cold aluminium in contact for 100 s."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.casting.arpm.method import HeatMethod
from sandmould.casting.arpm.raster import Raster
from tests.verification.castings.exact import contact_temperature_k

SMALL_M = 0.005
HALF_LENGTH_M, WIDTH_M = 0.5, 0.08
"""Stand-ins: Fig. 1's dimensions are lost to us. Error (6) goes as one over the half length."""
HOT_K, COLD_K = 393.0, 293.0
"""Section 3.1's text; below (6) it says 373 K for the hot side, taken for a slip."""
DURATION_S = 100.0
LAYERS: dict[str, tuple[int, ...] | None] = {
    "1-1": (), "1-2": (4,), "1-3": (2,), "1-4": None, "1-3A": (2,), "1-3B": (2,),
}  # fmt: skip
"""Layers of small elements kept beside the interface; in 1-4 all elements are large."""


@dataclass(frozen=True)
class ContactResult:
    """What one case found."""

    error_percent: float
    """Eq. (6), with its sign: over the hot area."""
    largest_k: float
    """Largest difference from the exact solution, K."""
    drift_percent: float
    """Change of the total enthalpy over that above the cold side."""
    elements: int


def contact_elements(case: str) -> Elements:
    """Elements of a case; the hot area is material 1, on the left.

    In 1-3A the hot area has large elements away from the interface and the cold one none; in 1-3B
    it is the other way round. Which of the two is which in Fig. 2 is not known to us.

    Parameters
    ----------
    case : str
        A key of ``LAYERS``.

    Raises
    ------
    ValueError
        When there is no such case.
    """
    if case not in LAYERS:
        raise ValueError(f"there is no case {case!r}; there are {', '.join(LAYERS)}")
    layers, cell = LAYERS[case], SMALL_M
    if layers is None:
        layers, cell = (), 2.0 * SMALL_M
    half, wide = round(HALF_LENGTH_M / cell), round(WIDTH_M / cell)
    material = np.zeros((2 * half, wide), dtype=np.int64)
    material[:half] = 1
    raster = Raster(material, cell, np.array([-HALF_LENGTH_M, 0.0]))
    elements = placed(raster, layers)
    if case in ("1-3A", "1-3B"):
        return _one_sided(elements, placed(raster), 1 if case == "1-3A" else 0)
    return elements


def _one_sided(several: Elements, uniform: Elements, side: int) -> Elements:
    """Elements of several sizes on one side of the interface and of one size on the other."""
    on_side, off_side = several.material == side, uniform.material != side
    return replace(
        several,
        position_m=np.concatenate([several.position_m[on_side], uniform.position_m[off_side]]),
        size_m=np.concatenate([several.size_m[on_side], uniform.size_m[off_side]]),
        material=np.concatenate([several.material[on_side], uniform.material[off_side]]),
    )


def run_contact(
    case: str, aluminium: ThermalMaterial, resistance_m2k_w: float, method: HeatMethod
) -> ContactResult:
    """Compute a case and compare it with the exact solution.

    Parameters
    ----------
    case : str
        A key of ``LAYERS``.
    aluminium : ThermalMaterial
        Of both areas.
    resistance_m2k_w : float, m2 K/W
        The paper takes 0 and 0.001.
    method : HeatMethod
        Small c_k break the rule of sizes, as in the paper: give ``refuse_ratio=False``.
    """
    elements = contact_elements(case)
    filling = Filling((aluminium, aluminium), (COLD_K, HOT_K), resistance_m2k_w)
    return compare_contact(elements, filling, method)


def compare_contact(elements: Elements, filling: Filling, method: HeatMethod) -> ContactResult:
    """Compute two areas in contact at x = 0 for 100 s; arguments as those of a case."""
    marching = method.stepping_of(elements, filling)
    heat = filling.heat(elements)
    before = heat.enthalpy_j_m3 @ marching.volume_m3
    marching.advance(heat, DURATION_S)
    hot = elements.material == 1
    exact = contact_temperature_k(
        elements.position_m[:, 0], DURATION_S, (filling.materials[1], filling.materials[0]),
        (filling.initial_k[1], filling.initial_k[0]), filling.resistance_m2k_w,
    )  # fmt: skip
    differ = heat.temperature_k - exact
    # the sum of T r0 along a line, averaged over all lines
    width = elements.high_m[1] - elements.low_m[1]
    over = float(np.sum((differ * elements.volume_m3)[hot])) / width
    scale = -elements.low_m[0] * (filling.initial_k[1] - filling.initial_k[0])
    return ContactResult(
        100.0 * over / scale,
        float(np.abs(differ).max()),
        100.0 * float(heat.enthalpy_j_m3 @ marching.volume_m3 / before - 1.0),
        len(elements.size_m),
    )
