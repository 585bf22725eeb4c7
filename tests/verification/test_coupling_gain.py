"""The measured gain against that of springs and dashpots, and the loop at the limit it sets."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.gain import Gain, measure_gain
from tests.patterns import _one_thread  # noqa: F401
from tests.verification.one_grain import RADIUS_M
from tests.wedge import (
    SQUEEZE_M,
    WALL_N_M,
    end_moved_m,
    end_stiffness_n_m,
    put_disc,
    staggered,
    wedge_pattern,
    wedge_scene,
)

WINDOW_S = 2e-3
ENGINES = ("reference", "lammps")
BAND = 1e-3


def shares(young_pa: float, damping_ratio: float) -> tuple[float, float]:
    """Spring a and dashpot b over a window of two contacts in series, over the bar's stiffness."""
    pattern = wedge_pattern(young_pa)
    mass_kg = wedge_scene(pattern).sand.grain_mass_kg(2 * RADIUS_M, 2)
    dashpot = 2.0 * damping_ratio * math.sqrt(mass_kg * WALL_N_M)
    bar_n_m = end_stiffness_n_m(pattern)
    return 0.5 * WALL_N_M / bar_n_m, 0.5 * dashpot / WINDOW_S / bar_n_m


def squeezed(
    folder: Path,
    young_pa: float,
    damping_ratio: float,
    records: int,
    engine: str = "reference",
    every: int = 1,
    **changes: Any,
) -> tuple[Any, float]:
    """The loop after some records, and how far the bar is from its exact rest, as a share."""
    pattern = wedge_pattern(young_pa)
    rest = {"load_every_steps": every, "check_every_s": WINDOW_S}
    scenario = wedge_scene(pattern, damping_ratio, engine={"name": engine}, rest=rest)
    session = staggered(pattern, scenario, folder, window_s=WINDOW_S, **changes)
    put_disc(session)
    for _ in range(records):
        session.advance()
    bar_n_m = end_stiffness_n_m(pattern)
    exact_m = 2 * SQUEEZE_M / (2 / WALL_N_M + 1 / bar_n_m) / bar_n_m
    return session, abs(end_moved_m(session, pattern) / exact_m - 1.0)


@pytest.mark.parametrize(("young_pa", "damping_ratio"), [(2e5, 0.95), (2e5, 0.3), (5e4, 0.95)])
def test_gain_is_that_of_two_contacts_in_series(
    young_pa: float, damping_ratio: float, tmp_path: Path
) -> None:
    session, _ = squeezed(tmp_path, young_pa, damping_ratio, 3, scheme="fixed", factor=1e-3)
    shown = session.displacement_m.copy()
    found = measure_gain(session.sand, session._body, "pattern", shown, WINDOW_S)
    a, b = shares(young_pa, damping_ratio)
    assert found is not None
    # the disc itself lags by about a thirtieth of the window
    assert found.gain == pytest.approx(a + 2.0 * b, rel=0.05)
    session.close()


def test_a_fixed_factor_holds_up_to_its_limit_and_not_beyond(tmp_path: Path) -> None:
    a, b = shares(2e5, 0.95)
    true_limit = 2.0 / (1.0 + 2.0 * b)
    assert Gain(a + 2.0 * b).limit < true_limit
    # error after many windows: above the limit it stays as large as the bar's whole way
    factors = (Gain(a + 2.0 * b).limit, 0.9 * true_limit, 1.05 * true_limit)
    left = [squeezed(tmp_path, 2e5, 0.95, 40, scheme="fixed", factor=f)[1] for f in factors]
    assert left[0] < 1e-6
    assert left[1] < 0.1
    assert left[2] > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_measured_scheme_finds_its_factor_and_comes_to_rest(engine: str, tmp_path: Path) -> None:
    loop = {"scheme": "measured", "factor": 1e-3}
    # LAMMPS is stopped at every sample: one in four steps leans to the window's end by 1 %
    session, left = squeezed(tmp_path, 5e4, 0.95, 30, engine, every=4, **loop)
    session.close()
    assert left < 1e-4
    a, b = shares(5e4, 0.95)
    log = read_convergence_log(tmp_path / CONVERGENCE_LOG)
    assert log.gain.iloc[-1] == pytest.approx(a + 2.0 * b, rel=0.05)
    np.testing.assert_allclose(log.factor, 0.5 * 2.0 / (1.0 + log.gain), rtol=1e-6)


def test_engines_measure_the_same_gain(tmp_path: Path) -> None:
    gains = []
    for engine in ENGINES:
        session, _ = squeezed(tmp_path, 2e5, 0.3, 3, engine, scheme="fixed", factor=1e-3)
        shown = session.displacement_m.copy()
        found = measure_gain(session.sand, session._body, "pattern", shown, WINDOW_S)
        session.close()
        assert found is not None
        gains.append(found.gain)
    # 4e-4 apart: LAMMPS finds the first forces after going back with velocities of whole steps.
    assert gains[1] == pytest.approx(gains[0], rel=BAND)


def test_engines_repeat_windows_alike(tmp_path: Path) -> None:
    ends, passes = [], []
    for engine in ENGINES:
        (folder := tmp_path / engine).mkdir()
        loop = {"scheme": "quasi_newton", "repeats": 6, "tolerance": 1e-4}
        session, _ = squeezed(folder, 2e5, 0.95, 3, engine, **loop)
        session.close()
        ends.append(session.displacement_m)
        passes.append(read_convergence_log(folder / CONVERGENCE_LOG).passes.tolist())
    assert max(passes[0]) > 2
    # The first window ends at round-off, and the third depends on the secants of that.
    assert passes[1][:2] == passes[0][:2]
    np.testing.assert_allclose(ends[1], ends[0], atol=BAND * np.abs(ends[0]).max())


def test_measuring_leaves_the_session_as_it_was(tmp_path: Path) -> None:
    ends = []
    for times in (0, 1):
        session, _ = squeezed(tmp_path, 2e5, 0.95, 2, scheme="fixed", factor=0.1)
        for _ in range(times):
            measure_gain(session.sand, session._body, "pattern", session.displacement_m, WINDOW_S)
        for _ in range(2):  # what a window finds is shown in the next one
            session.advance()
        ends.append(session.displacement_m)
        session.close()
    np.testing.assert_array_equal(*ends)


def test_without_sand_there_is_no_gain(tmp_path: Path) -> None:
    pattern = wedge_pattern(2e5)
    session = staggered(pattern, wedge_scene(pattern), tmp_path, window_s=WINDOW_S)
    put_disc(session, 0.04)
    rest = np.zeros_like(session.displacement_m)
    assert measure_gain(session.sand, session._body, "pattern", rest, WINDOW_S) is None
    session.close()
