"""The casting with four plates of section 4: layouts 2-1 to 2-3B, errors and times.

Its geometry and most of its materials are stand-ins that ``config/scenarios/plates.yaml`` and
``config/materials/hirata_2019.yaml`` list with their sources: the paper's Table 1 and Fig. 5 are
lost to us.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sandmould import ROOT
from sandmould.arrays import Floats
from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.casting.arpm.method import HeatMethod
from sandmould.casting.arpm.raster import Raster, painted
from sandmould.casting.arpm.solidification import CoolingProgress, SolidificationResult, solidify
from sandmould.geometry.outline import Outline
from sandmould.scenario.casting.shapes import FourPlates
from sandmould.scenario.reading import Origin, merge, read_yaml

MATERIALS = ROOT / "config" / "materials" / "hirata_2019.yaml"
ALUMINIUM = ROOT / "config" / "materials" / "hirata_2019_aluminium.yaml"
SCENARIO = ROOT / "config" / "scenarios" / "plates.yaml"
SMALL_M = 0.002
LAYERS: dict[str, tuple[int, ...]] = {
    "2-1": (), "2-2A": (2,), "2-2B": (4,), "2-3A": (2, 2), "2-3B": (4, 4),
}  # fmt: skip
"""Layers kept of 2 mm and, in 2-3, of 4 mm elements (section 4.1)."""
ERROR_TIME_S = 2000.0
"""t_sol in (7), used uniformly (section 4.3.3)."""


def read_values(path: Path) -> dict[str, Any]:
    """Values of a file, without their units and sources.

    Raises
    ------
    BadInputError
        When the file is missing or no YAML.
    """
    return merge({}, read_yaml(path, path.name), Origin(), path.name)


@dataclass(frozen=True)
class Plates:
    """Four plates that meet in the middle of a square box of sand."""

    filling: Filling
    box_m: float
    reach_m: float
    """Of each plate, from the centre."""
    thickness_m: tuple[float, float, float, float]
    """Upwards, to the right, downwards, to the left."""

    @property
    def outline(self) -> Outline:
        """The casting."""
        return FourPlates(reach_m=self.reach_m, thickness_m=self.thickness_m).solid

    @property
    def probes_m(self) -> dict[str, Floats]:
        """Points A to D half a thickness from the tips, and E in the centre: a stand-in."""
        up, right, down, left = (self.reach_m - 0.5 * t for t in self.thickness_m)
        places = {"A": (0.0, up), "B": (right, 0.0), "C": (0.0, -down), "D": (-left, 0.0),
                  "E": (0.0, 0.0)}  # fmt: skip
        return {name: np.array(place) for name, place in places.items()}

    def raster(self, cell_m: float) -> Raster:
        """Cells of a size; those that a material's edge cuts go where their centre lies."""
        half = np.full(2, 0.5 * self.box_m)
        return painted(-half, half, cell_m, {1: self.outline})


def read_plates() -> Plates:
    """The case of section 4 from its files."""
    values, scenario = read_values(MATERIALS), read_values(SCENARIO)["scenario"]
    (plates,), box, initial = scenario["shapes"], scenario["box"], values["initial_k"]
    materials = tuple(ThermalMaterial(**values[name]) for name in ("mould", "casting"))
    filling = Filling(
        materials, (initial["mould"], initial["casting"]), 1.0 / values["heat_transfer_w_m2_k"]
    )
    box_m = box["high_m"][0] - box["low_m"][0]
    return Plates(filling, box_m, plates["reach_m"], tuple(plates["thickness_m"]))


def read_aluminium() -> ThermalMaterial:
    """The metal of the contact test of section 3."""
    return ThermalMaterial(**read_values(ALUMINIUM))


@dataclass(frozen=True)
class PlatesRun:
    """A layout of the plates and how it solidifies."""

    elements: Elements
    result: SolidificationResult
    steps_s: float
    """Longest time step."""


def plates_layout(plates: Plates, case: str, size_m: float = SMALL_M) -> tuple[Raster, Elements]:
    """Elements of a case.

    Parameters
    ----------
    plates : Plates
    case : str
        A key of ``LAYERS``.
    size_m : float, m
        Of the small elements; in case 2-1 of all. The paper takes 1, 2, 2.5, 4, 5 and 10 mm
        there, else 2. Where the casting is no multiple of it, elements of half the size fill the
        blocks that hold both materials, as the paper fills its casting's middle.

    Raises
    ------
    ValueError
        When there is no such case.
    """
    if case not in LAYERS:
        raise ValueError(f"there is no case {case!r}; there are {', '.join(LAYERS)}")
    marks = np.array([plates.reach_m, *(0.5 * t for t in plates.thickness_m)]) / size_m
    if case == "2-1" and np.abs(marks - np.round(marks)).max() > 1e-6:
        raster = plates.raster(0.5 * size_m)
        return raster, placed(raster, (0,))
    raster = plates.raster(size_m)
    return raster, placed(raster, LAYERS[case])


def run_plates(plates: Plates, case: str, method: HeatMethod, size_m: float = SMALL_M,
               record_s: float = 5.0, until_s: float = 20_000.0,
               progress: Callable[[CoolingProgress], None] | None = None) -> PlatesRun:  # fmt: skip
    """Solidify a case; arguments as those of ``plates_layout`` and ``solidify``."""
    raster, elements = plates_layout(plates, case, size_m)
    marching = method.marching(elements, plates.filling, raster)
    result = solidify(
        elements, plates.filling, marching, plates.probes_m, record_s, until_s, progress
    )
    return PlatesRun(elements, result, marching.step_s)


def curve_error_percent(
    plates: Plates, result: SolidificationResult, reference: SolidificationResult
) -> dict[str, tuple[float, float]]:
    """Error (7) of each cooling curve, and its largest value, % of the initial difference.

    (7) calls itself K/s and lacks the time step in its sum; here it has it, and no unit.

    Parameters
    ----------
    plates : Plates
    result, reference : SolidificationResult
        Recorded at the same times; the shorter one counts, up to 2000 s.

    Returns
    -------
    dict of probe to (mean, largest)

    Raises
    ------
    ValueError
        When their records are at different times.
    """
    times = result.time_s[: np.searchsorted(result.time_s, ERROR_TIME_S, side="right")]
    k = min(len(times), len(reference.time_s))
    if not np.allclose(times[:k], reference.time_s[:k]):
        raise ValueError("cooling curves are recorded at different times; give one record_s")
    mould_k, pour_k = plates.filling.initial_k
    error = _differences(result.probe_k, reference.probe_k, k)
    lasted = np.gradient(times[:k])
    return {
        name: (
            100.0 * float(np.sum(off * lasted)) / ((pour_k - mould_k) * times[k - 1]),
            100.0 * float(off.max()) / (pour_k - mould_k),
        )
        for name, off in error.items()
    }


def _differences(result: Mapping[str, Floats], reference: Mapping[str, Floats], k: int
                 ) -> dict[str, Floats]:  # fmt: skip
    return {name: np.abs(result[name][:k] - reference[name][:k]) for name in result}
