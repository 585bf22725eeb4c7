"""Error against cost of the ways to solidify the casting with four plates, on one thread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from benchmarks.arpm.fem import fem_exchange
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.marching import Marching, Substance
from sandmould.casting.arpm.method import STEPS, HeatMethod
from sandmould.casting.arpm.solidification import SolidificationResult, solidify
from tests.verification.castings.plates import (
    Plates,
    PlatesRun,
    curve_error_percent,
    plates_layout,
)

ADAPTIVE = "2-3B"
WARMING_S = 10.0
COARSE_M = 0.01
"""Elements of the run that only compiles."""
FEM = "scikit-fem"


@dataclass(frozen=True)
class Way:
    """A layout of the paper and a method; scikit-fem takes the layout's cells."""

    case: str
    method: HeatMethod
    sizes_mm: tuple[float, ...]
    is_fem: bool = False

    def made(self, plates: Plates, size_m: float) -> tuple[Elements, Marching]:
        """Elements and what takes them forward in time."""
        raster, elements = plates_layout(plates, self.case, size_m)
        if not self.is_fem:
            return elements, self.method.marching(elements, plates.filling, raster)
        nodes, exchange = fem_exchange(raster, plates.filling)
        steps = STEPS[self.method.stepping]
        return nodes, steps(exchange, Substance(nodes.material, plates.filling.table))


_UNIFORM, _FINE = (10.0, 5.0, 4.0, 2.5, 2.0, 1.0), (5.0, 2.5, 2.0)
# the paper's, the corrected, the conservative, local and super steps, and the competitors
WAYS: dict[str, Way] = {
    "uniform, printed or corrected": Way("2-1", HeatMethod("corrected", "explicit"), _UNIFORM),
    "2-2A, corrected": Way("2-2A", HeatMethod("corrected", "explicit"), (2.0,)),
    "2-2B, corrected": Way("2-2B", HeatMethod("corrected", "explicit"), (2.0,)),
    "2-3A, corrected": Way("2-3A", HeatMethod("corrected", "explicit", refuse_ratio=False), (2.0,)),
    "2-3B, corrected": Way(ADAPTIVE, HeatMethod("corrected", "explicit"), _FINE),
    "2-3B, printed": Way(ADAPTIVE, HeatMethod("printed", "explicit"), _FINE),
    "2-3B, symmetric": Way(ADAPTIVE, HeatMethod("symmetric", "explicit"), _FINE),
    "2-3B, corrected, local steps": Way(ADAPTIVE, HeatMethod("corrected", "local"), _FINE),
    "2-3B, faces": Way(ADAPTIVE, HeatMethod("faces", "explicit"), _FINE),
    "2-3B, faces, super steps": Way(ADAPTIVE, HeatMethod("faces", "super"), _FINE),
    "2-3B, faces, local steps": Way(ADAPTIVE, HeatMethod("faces", "local"), (*_FINE, 1.0)),
    "uniform, faces, local steps": Way("2-1", HeatMethod("faces", "local"), (10.0, *_FINE, 1.0)),
    "finite differences": Way("2-1", HeatMethod("difference"), (10.0, *_FINE)),
    FEM: Way("2-1", HeatMethod("faces", "explicit"), (10.0, *_FINE), is_fem=True),
}
REFERENCE = Way("2-1", HeatMethod("difference"), (1.0,))
PAPERS = ("uniform, printed or corrected", "2-2A, corrected", "2-2B, corrected",
          "2-3A, corrected", "2-3B, corrected")  # fmt: skip
"""The paper's own cases: their courses over time are kept."""
COURSE_S = 25.0
"""Between the records that are kept of them, a multiple of 5 s."""


def way_rows(plates: Plates, least_mm: float) -> list[dict[str, Any]]:
    """Compute all ways with elements of a size or more against differences of the reference.

    Parameters
    ----------
    plates : Plates
    least_mm : float
        1 for the paper's sizes; the reference has half of it, but no less than 1 mm.
    """
    finest_mm = max(1.0, 0.5 * least_mm)
    run_way(REFERENCE, plates, COARSE_M, WARMING_S)
    reference = run_way(REFERENCE, plates, 1e-3 * finest_mm)
    rows = [_row("finite differences", finest_mm, plates, reference, reference.result)]
    for name, way in WAYS.items():
        run_way(way, plates, COARSE_M, WARMING_S)  # compiled before it is timed
        for size_mm in way.sizes_mm:
            if size_mm < least_mm:
                continue
            run = run_way(way, plates, 1e-3 * size_mm)
            rows.append(_row(name, size_mm, plates, run, reference.result))
            row = rows[-1]
            print(
                f"{name}, {size_mm:g} mm: {row['cpu_s']:.2f} s, "
                f"{row['mean_error_percent']['A']:.3f} % at A, solid at "
                f"{row['solidification_time_s']:.1f} s ({row['time_error_percent']:+.2f} %), "
                f"drift {row['largest_drift_percent']:.1e} %",
                flush=True,
            )
            if name in PAPERS:
                rows[-1] |= _courses(plates, run.result, reference.result)
    return rows


def run_way(way: Way, plates: Plates, size_m: float, until_s: float = 20_000.0) -> PlatesRun:
    """Solidify the plates in one way."""
    elements, marching = way.made(plates, size_m)
    solidification = solidify(elements, plates.filling, marching, plates.probes_m, until_s=until_s)
    return PlatesRun(elements, solidification, marching.step_s)


def _row(
    name: str, size_mm: float, plates: Plates, run: PlatesRun, reference: SolidificationResult
) -> dict[str, Any]:
    solidification = run.result
    error = curve_error_percent(plates, solidification, reference)
    late = solidification.solidification_time_s / reference.solidification_time_s - 1.0
    return {
        "way": name,
        "size_mm": size_mm,
        "elements": len(run.elements.size_m),
        "counts": {f"{1e3 * size:g}": count for size, count in run.elements.counts().items()},
        "step_s": run.steps_s,
        "element_steps": solidification.heat.element_steps,
        "cpu_s": solidification.cpu_s,
        "solidification_time_s": solidification.solidification_time_s,
        "time_error_percent": 100.0 * late,
        "mean_error_percent": {probe: mean for probe, (mean, _) in error.items()},
        "largest_error_percent": {probe: most for probe, (_, most) in error.items()},
        "largest_drift_percent": float(abs(solidification.drift_percent).max()),
    }


def _courses(
    plates: Plates, solidification: SolidificationResult, reference: SolidificationResult
) -> dict[str, Any]:
    """Error of the cooling curve at A and drift of the enthalpy over time: Figures 9, 11 and 14."""
    recorded = solidification.time_s[: len(reference.time_s)] % COURSE_S == 0.0
    mould_k, pour_k = plates.filling.initial_k
    count = len(recorded)
    warmer_k = solidification.probe_k["A"][:count] - reference.probe_k["A"][:count]
    return {
        "course_s": solidification.time_s[:count][recorded].tolist(),
        "course_error_percent": (100.0 * warmer_k[recorded] / (pour_k - mould_k)).round(4).tolist(),
        "course_drift_percent": solidification.drift_percent[:count][recorded].round(5).tolist(),
    }
