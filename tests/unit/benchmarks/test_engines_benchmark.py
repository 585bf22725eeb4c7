"""The speed measurements: beds copied side by side, ratios, and the committed page."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.engines.beds import Bed, solver_on, tiled
from benchmarks.engines.scale import advance, bytes_of
from benchmarks.engines.timing import interleaved, ratio


@pytest.fixture
def bed() -> Bed:
    """Three discs on the floor of a box 10 mm wide, two of them against its walls."""
    position = np.array([[0.009, 0.001], [0.001, 0.001], [0.0045, 0.001]])
    radius = np.array([0.001, 0.001, 0.0011])
    return Bed(2, 0.01, 0.01, position, np.zeros((3, 2)), np.zeros((3, 3)), radius)


def test_copies_stand_side_by_side(bed):
    five = tiled(bed, 5)
    assert five.position_m[:, 0].tolist() == pytest.approx([0.001, 0.0045, 0.009, 0.011, 0.0145])
    assert five.radius_m.tolist() == [0.001, 0.0011, 0.001, 0.001, 0.0011]
    assert five.width_m == pytest.approx(0.0156)
    assert tiled(bed, 3).width_m == pytest.approx(bed.width_m)


def test_a_solver_takes_a_bed_as_it_is(bed):
    solver = solver_on(bed)
    radius = solver.grains.radius[np.argsort(solver.grains.id)]
    assert radius.tolist() == bed.radius_m.tolist()
    advance(solver, 3)
    assert solver.steps == 3
    assert bytes_of(solver)["grains position"] == 3 * 2 * 8


def test_ratios_are_taken_within_turns():
    turns = iter([1.0, 10.0, 2.0, 4.0, 3.0, 9.0])
    found = interleaved({"a": lambda: next(turns), "b": lambda: next(turns)}, 3)
    assert found == {"a": [1.0, 2.0, 3.0], "b": [10.0, 4.0, 9.0]}
    assert ratio(found["b"], found["a"]) == {"median": 3.0, "least": 2.0, "most": 10.0}
