"""The casting with four plates: finite differences, elements of one size and of several."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.casting.arpm.method import HeatMethod
from sandmould.casting.arpm.solidification import CoolingProgress
from tests.verification.castings.plates import (
    PlatesRun,
    curve_error_percent,
    plates_layout,
    read_plates,
    run_plates,
)

PLATES = read_plates()


@pytest.fixture(scope="module")
def grid() -> PlatesRun:
    """Finite differences at 10 mm."""
    return run_plates(PLATES, "2-1", HeatMethod("difference"), 0.01)


def test_finite_differences_find_the_known_time(grid: PlatesRun) -> None:
    # 2049.4 s by an independent program for the same stand-in, which counts whole steps of 4 s
    assert grid.result.solidification_time_s == pytest.approx(2047.4, abs=2.0)
    assert np.abs(grid.result.drift_percent).max() < 1e-10


def test_faces_of_one_size_are_finite_differences(grid: PlatesRun) -> None:
    # two programs for the same sums, so that only their order differs
    faces = run_plates(PLATES, "2-1", HeatMethod("faces", "explicit"), 0.01).result
    for name, curve in faces.probe_k.items():
        np.testing.assert_allclose(curve, grid.result.probe_k[name], rtol=1e-10)
    assert faces.solidification_time_s == pytest.approx(grid.result.solidification_time_s, rel=1e-9)


def test_probes_cool_in_the_order_of_thickness(grid: PlatesRun) -> None:
    below = {name: int(np.argmax(k < 1713.0)) for name, k in grid.result.probe_k.items()}
    assert sorted(below, key=below.__getitem__) == ["A", "B", "C", "D", "E"]


@pytest.mark.parametrize("exchange", ["faces", "corrected", "printed"])
def test_several_sizes_against_one(exchange: str) -> None:
    # 5 and 10 mm for the paper's 2 and 4 mm, 5 layers kept: the budget of a test
    told: list[CoolingProgress] = []
    uniform = run_plates(PLATES, "2-1", HeatMethod("difference"), 0.005, until_s=400.0)
    method = HeatMethod(exchange, "local")  # type: ignore[arg-type]
    adaptive = run_plates(PLATES, "2-2B", method, 0.005, until_s=400.0, progress=told.append)
    assert len(adaptive.elements.size_m) < 0.5 * len(uniform.elements.size_m)
    error = curve_error_percent(PLATES, adaptive.result, uniform.result)
    mean = max(mean for mean, _ in error.values())
    lost = float(np.abs(adaptive.result.drift_percent).max())
    if exchange == "faces":
        assert lost < 1e-10
        # 0.24 measured
        assert mean < 0.3
    elif exchange == "corrected":
        # 0.14 % measured; "around 0.05 %" in the paper's Fig. 14 with 2 mm elements
        assert 0.01 < lost < 0.2
        assert mean < 1.0
    else:
        # the printed weights lose percents of enthalpy: the paper cannot have used them
        assert lost > 1.0
    assert told[-1].percent == 100.0
    assert told[-1].element_steps_per_s > 0.0


def test_counts_of_the_papers_layouts() -> None:
    # an independent program counts within 1 % of these; the paper's own numbers are lost
    expected = {"2-2A": (5064, 38734), "2-3B": (9032, 3854, 8472)}
    for case, counts in expected.items():
        elements = plates_layout(PLATES, case)[1]
        assert elements.volume_m3.sum() == pytest.approx(0.64)
        assert list(elements.counts().values()) == pytest.approx(list(counts), rel=0.01)


def test_four_millimetres_keep_the_castings_shape_with_smaller_elements() -> None:
    elements = plates_layout(PLATES, "2-1", 0.004)[1]
    assert set(elements.counts()) == {0.002, 0.004}
    casting = elements.volume_m3[elements.material == 1].sum()
    assert casting == pytest.approx(PLATES.outline.measure)
