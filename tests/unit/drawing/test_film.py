"""Films: what the page unpacks is what the snapshots hold; frames are dropped, grains never."""

from __future__ import annotations

import base64
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandmould import ROOT
from sandmould.drawing.animation import ABSENT, Film, make_film
from sandmould.drawing.figures import cut_m, section_of
from sandmould.engines.snapshot import stored_snapshots
from sandmould.kinds.sand.moments import list_moments, nearest
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.snapshots import damage, write_snapshots
from tests.unit.report_study import write_study


def unpack(film: Film) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (2, frames, grains) in m with NaN for absent grains, radii and layers."""
    raw = np.frombuffer(zlib.decompress(base64.b64decode(film.data)), dtype=np.uint8)
    frames, n = len(film.time_s), film.grains
    whole = 2 * frames * n
    folded = raw[:whole].astype(np.int64) | raw[whole : 2 * whole].astype(np.int64) << 8
    change = (folded >> 1) ^ -(folded & 1)
    place = np.cumsum(change.reshape(2, frames, n), axis=1) & 0xFFFF
    metres = np.array(film.origin_m)[:, None, None] + film.quantum_m * place
    metres = np.where(place == ABSENT, np.nan, metres)
    rest = raw[2 * whole :].astype(np.int64)
    radius = (rest[:n] | rest[n : 2 * n] << 8) / 65535 * film.largest_radius_m
    return metres, radius, rest[2 * n : 3 * n]


def test_page_shows_the_section_of_a_mesh_where_it_is_cut_open() -> None:
    (run,) = expand(open_study(ROOT / "config" / "studies" / "bracket_small.yaml"))
    assert cut_m(run.scenario) == pytest.approx(0.05)
    section = section_of(run.scenario, 0.12)
    (solid,) = section.solids_m
    assert solid.min(axis=0) == pytest.approx([0.03, 0.037], abs=1e-4)
    assert solid.max(axis=0) == pytest.approx([0.11, 0.053], abs=1e-4)
    assert section.bores_m == ()


def test_film_holds_the_snapshots(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube", {50.0: 0.5}, 1, (), grains=300)
    folder = study / "runs" / "f50_r1"
    film = make_film(folder, "best")
    assert film is not None
    metres, radius, layer = unpack(film)
    for number, moment in enumerate(list_moments(folder)):
        snapshot = moment.load()
        here = snapshot.id - 1
        apart = metres[:, number, here].T - snapshot.position_m
        assert np.abs(apart).max() <= 0.5 * film.quantum_m * (1 + 1e-9)
        absent = np.setdiff1d(np.arange(film.grains), here)
        assert np.isnan(metres[:, number, absent]).all()
        assert np.allclose(radius[here], snapshot.radius_m, rtol=1e-4)
        assert np.array_equal(layer[here], snapshot.layer)
        assert film.time_s[number] == pytest.approx(snapshot.time_s, abs=1e-6)
    # a quantum is below a tenth of a pixel of a wide screen
    assert film.quantum_m < 0.12 / 8000


def test_frames_are_dropped_to_keep_the_budget_and_grains_never(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube", {50.0: 0.5}, 1, (), grains=2000, count=40)
    folder = study / "runs" / "f50_r1"
    whole = make_film(folder, "best")
    small = make_film(folder, "best", budget_bytes=12_000)
    assert whole is not None
    assert small is not None
    assert len(whole.time_s) == 40
    assert len(small.data) <= 12_000
    assert 2 <= len(small.time_s) < 40
    assert small.grains == whole.grains == 2000
    assert (small.time_s[0], small.time_s[-1]) == (whole.time_s[0], whole.time_s[-1])


def test_broken_snapshots_are_passed_over(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube", {50.0: 0.5}, 1, ())
    folder = study / "runs" / "f50_r1"
    damage(folder, 3)
    damage(folder, 4)
    film = make_film(folder, "best")
    assert film is not None
    assert len(film.time_s) == 10
    assert make_film(study / "runs" / "f25_r9", "none") is None


def test_reading_is_that_of_the_frame(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube", {50.0: 0.5}, 1, ())
    known = (np.array([0.4, 2.4]), np.array([0.0, 1.0]))
    film = make_film(study / "runs" / "f50_r1", "best", known)
    assert film is not None
    assert film.reading[0] is None
    assert film.reading[-1] == 1.0
    assert film.vibration_time_s[0] is None
    middle = film.vibration_time_s.index(1.0)
    assert film.reading[middle] == 0.5


def test_nearest_moment(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube", {50.0: 0.5}, 1, ())
    moments = list_moments(study / "runs" / "f50_r1")
    assert nearest(moments, 0.0).vibration_time_s == 0.0
    assert nearest(moments, 9.0) == moments[-1]


def test_grain_that_is_lost_is_absent_afterwards(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube", {50.0: 0.5}, 1, ())
    folder = study / "runs" / "f50_r1"
    *before, whole = stored_snapshots(folder)
    last = whole.load()
    kept = last.id != 7
    names = ("id", "layer", "position_m", "velocity_m_s", "spin_rad_s", "radius_m")
    lacking = replace(last, **{name: getattr(last, name)[kept] for name in names})
    write_snapshots(folder, [lacking], after=len(before))
    film = make_film(folder, "best")
    assert film is not None
    metres, _, _ = unpack(film)
    assert np.isnan(metres[:, -1, 6]).all()
    assert not np.isnan(metres[:, -2, 6]).any()
