"""A small grain in the groove between two large ones: where each engine takes the slip, it leaves.

In the plane of the normal of a whole step it is held below the large grains at a ratio of five.
LAMMPS with ``synchronized_verlet`` is the control of our solver's mend
(docs/developers/size_ratio.md).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.size_ratio import three_grains
from benchmarks.size_ratio.three_grains import Groove, leaving_deg
from sandmould.arrays import Floats
from tests.liggghts_scenes import needs_liggghts

RATIO = 5.0
GROOVE = Groove("reference", "half_step", RATIO, rolling_arm=0.0, step=0.2)
BELOW_DEG = 95.0
"""Past the centres of the large grains, where nothing but an error holds the small one."""


@pytest.fixture(autouse=True)
def _few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(three_grains, "STARTS", 2)
    monkeypatch.setattr(three_grains, "DURATION_S", 0.1)


@cache
def left_deg(engine: str, slip_normal: str) -> Floats:
    """Angles at which the small grains leave."""
    return leaving_deg(replace(GROOVE, engine=engine, slip_normal=slip_normal))


@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_in_the_plane_of_half_a_step_it_leaves_as_energy_says(engine: str) -> None:
    late_deg = left_deg(engine, "half_step") - GROOVE.exact_deg()
    # Some degrees: the slip until it rolls, and the dashpot.
    assert (late_deg > 0.0).all()
    assert late_deg.max() < 6.0


def test_our_mend_is_that_of_lammps() -> None:
    ours, theirs = (left_deg(engine, "half_step") for engine in ("reference", "lammps"))
    assert np.abs(ours - theirs).max() < 1.5


@pytest.mark.parametrize(
    "engine", ["reference", "lammps", pytest.param("liggghts", marks=needs_liggghts)]
)
def test_in_the_plane_of_the_whole_step_it_is_held_below_them(engine: str) -> None:
    assert (left_deg(engine, "full_step") > BELOW_DEG).all()
