"""Error against cost in 3D: a block with a plate in sand, all of whose sides lie on every grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.marching import Marching
from sandmould.casting.arpm.method import HeatMethod
from sandmould.casting.arpm.raster import Raster
from sandmould.casting.arpm.solidification import SolidificationResult, solidify

Array = NDArray[np.float64]
BOX_M = (0.088, 0.072, 0.072)
BLOCK_M = ((0.024, 0.024, 0.024), (0.048, 0.048, 0.048))
PLATE_M = ((0.048, 0.024, 0.032), (0.064, 0.048, 0.040))
"""Corners of least and of most coordinates; multiples of 8 mm."""
PROBES_M = {"block": np.array([0.036, 0.036, 0.036]), "plate": np.array([0.056, 0.036, 0.036])}
RECORD_S, UNTIL_S, WARMING_S = 0.5, 200.0, 1.0
REFERENCE_MM, COARSE_MM = 0.5, 4.0
Way = tuple[HeatMethod, tuple[int, ...], tuple[float, ...]]
"""Method, layers kept of each size, and smallest sizes in mm."""
SPACE_WAYS: dict[str, Way] = {
    "uniform, corrected": (HeatMethod("corrected", "explicit"), (), (4.0, 2.0, 1.0)),
    # with fewer layers a kernel would reach over two sizes, which is refused
    "two and three layers, corrected, local steps": (
        HeatMethod("corrected", "local"),
        (2, 3),
        (2.0, 1.0),
    ),
    "uniform, faces, local steps": (HeatMethod("faces", "local"), (), (4.0, 2.0, 1.0)),
    "one layer, faces, local steps": (HeatMethod("faces", "local"), (1, 1), (2.0, 1.0, 0.5)),
    "two layers, faces, local steps": (HeatMethod("faces", "local"), (2, 2), (2.0, 1.0, 0.5)),
    "finite differences": (HeatMethod("difference"), (), (4.0, 2.0, 1.0)),
}


def space_rows(filling: Filling, reference_mm: float = REFERENCE_MM) -> list[dict[str, Any]]:
    """Compute all ways against finite differences.

    Parameters
    ----------
    filling : Filling
        Mould and metal.
    reference_mm : float, mm
        Cells of the reference; ways with smaller elements are left out.

    Returns
    -------
    list of dict
        The reference first; errors are those of the solidification time and, of each cooling
        curve up to it, the mean over the initial difference of temperature.
    """
    difference = HeatMethod("difference")
    _solidified(filling, difference, (), COARSE_MM, WARMING_S)
    elements, reference = _solidified(filling, difference, (), reference_mm)
    rows = [_row("finite differences", reference_mm, filling, elements, reference, reference)]
    for name, (method, layers, sizes_mm) in SPACE_WAYS.items():
        _solidified(filling, method, layers, COARSE_MM, WARMING_S)  # compiled before it is timed
        for size_mm in sizes_mm:
            if size_mm < reference_mm:
                continue
            elements, found = _solidified(filling, method, layers, size_mm)
            rows.append(_row(name, size_mm, filling, elements, found, reference))
            told = rows[-1]
            print(
                f"3D, {name}, {size_mm:g} mm: {told['cpu_s']:.2f} s, mean errors "
                f"{told['mean_error_percent']}, {told['time_error_percent']:+.2f} % in time",
                flush=True,
            )
    return rows


def _solidified(
    filling: Filling, method: HeatMethod, layers: tuple[int, ...], size_mm: float,
    until_s: float = UNTIL_S,
) -> tuple[Elements, SolidificationResult]:  # fmt: skip
    raster = _raster(1e-3 * size_mm)
    elements = placed(raster, layers)
    marching: Marching = method.marching(elements, filling, raster)
    return elements, solidify(elements, filling, marching, PROBES_M, RECORD_S, until_s)


def _raster(cell_m: float) -> Raster:
    material = np.zeros([round(side / cell_m) for side in BOX_M], dtype=np.int64)
    for low, high in (BLOCK_M, PLATE_M):
        part = [slice(round(a / cell_m), round(b / cell_m)) for a, b in zip(low, high, strict=True)]
        material[tuple(part)] = 1
    return Raster(material, cell_m, np.zeros(3))


def _row(
    name: str, size_mm: float, filling: Filling, elements: Elements, found: SolidificationResult,
    reference: SolidificationResult,
) -> dict[str, Any]:  # fmt: skip
    count = min(len(found.time_s), len(reference.time_s))
    span_k = max(filling.initial_k) - min(filling.initial_k)
    late = found.solidification_time_s / reference.solidification_time_s - 1.0
    return {
        "way": name,
        "size_mm": size_mm,
        "elements": len(elements.size_m),
        "element_steps": found.heat.element_steps,
        "cpu_s": found.cpu_s,
        "solidification_time_s": found.solidification_time_s,
        "time_error_percent": 100.0 * late,
        "mean_error_percent": {
            probe: 100.0 * float(np.abs(curve[:count] - reference.probe_k[probe][:count]).mean())
            / span_k
            for probe, curve in found.probe_k.items()
        },
        "largest_drift_percent": float(abs(found.drift_percent).max()),
    }  # fmt: skip
