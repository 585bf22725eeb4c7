"""Films of spheres: what the page unpacks is what the snapshots hold, within the bytes allowed."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.analysis.density import apparent_density
from sandmould.drawing import sphere_film
from sandmould.drawing.animation import ABSENT, BUDGET_BYTES
from sandmould.drawing.sphere_film import (
    MOST_BESIDE,
    UNKNOWN,
    SphereFilm,
    SphereFrames,
    sphere_frames,
)
from sandmould.kinds.sand.moments import list_moments
from tests.unit.report_study import scenario, write_study

SCALE = (1000.0, 2000.0)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results") / "tube"
    return write_study(folder, {50.0: 0.5}, 1, (), grains=300, dimension=3) / "runs" / "f50_r1"


@pytest.fixture(scope="module")
def frames(run: Path) -> SphereFrames:
    return sphere_frames(list_moments(run), scenario(50.0, 3), "f50_r1", "best", SCALE)


def unpacked(film: dict[str, Any]) -> dict[str, np.ndarray]:
    """Places in m, (3, frames, grains), NaN where absent; radii; layers; both shades."""
    raw = np.frombuffer(zlib.decompress(base64.b64decode(film["data"])), dtype=np.uint8)
    total, n = len(film["time_s"]), film["grains"]
    whole = 3 * total * (n + film["vertices"])
    folded = raw[:whole].astype(np.int64) | raw[whole : 2 * whole].astype(np.int64) << 8
    change = ((folded >> 1) ^ -(folded & 1)).reshape(3, total, -1)
    place = (np.cumsum(change, axis=1) & 0xFFFF)[:, :, :n]
    metres = np.array(film["origin_m"])[:, None, None] + film["quantum_m"] * place
    rest = raw[2 * whole :].astype(np.int64)
    assert len(rest) == 3 * n + 2 * total * n
    return {
        "place_m": np.where(place == ABSENT, np.nan, metres),
        "radius_m": (rest[:n] | rest[n : 2 * n] << 8) / 65535 * film["largest_radius_m"],
        "layer": rest[2 * n : 3 * n],
        "shade": rest[3 * n :].reshape(2, total, n),
    }


def test_film_holds_places_sizes_layers_and_shades(frames: SphereFrames, run: Path) -> None:
    film = frames.whole
    held = unpacked(film.values)
    moments = list_moments(run)
    assert len(film.time_s) == len(moments) == 12
    for number, moment in enumerate(moments):
        snapshot = moment.load()
        here = snapshot.id - 1
        apart = held["place_m"][:, number, here].T - snapshot.position_m
        assert np.abs(apart).max() <= 0.5 * film.quantum_m * (1 + 1e-9)
        absent = np.setdiff1d(np.arange(300), here)
        assert np.isnan(held["place_m"][:, number, absent]).all()
        assert (held["shade"][0, number, absent] == UNKNOWN).all()
        assert np.allclose(held["radius_m"][here], snapshot.radius_m, rtol=1e-4)
        assert np.array_equal(held["layer"][here], snapshot.layer)
        density = apparent_density(
            snapshot.position_m, snapshot.radius_m, 2400.0, scene=scenario(50.0, 3).scene
        ).corrected_kg_m3
        told = 1000.0 + 1000.0 / 254 * held["shade"][0, number, here]
        assert np.abs(told - np.clip(density, 1000.0, 2000.0)).max() <= 0.5 * 1000 / 254 + 1e-9
    assert film.is_filling == (True,) * 3 + (False,) * 9


def test_speeds_are_shaded_up_to_that_of_the_fastest_hundredth(run: Path) -> None:
    moments = [m.load() for m in list_moments(run)]
    for snapshot in moments:
        snapshot.velocity_m_s[:, 2] = 0.1 * (snapshot.layer - 1)
    film = sphere_frames(moments, scenario(50.0, 3), "f50_r1", "best", SCALE).whole
    assert film.fastest_m_s == pytest.approx(0.2)
    held = unpacked(film.values)
    assert np.array_equal(held["shade"][1, -1], 127 * (held["layer"] - 1))


def test_a_page_holds_a_slice_behind_the_cut_and_a_script_the_whole(
    frames: SphereFrames, monkeypatch: pytest.MonkeyPatch
) -> None:
    film, beside = frames.inside_and_beside(0.02, BUDGET_BYTES, "spheres/")
    assert (film.slice_m, film.grains, film.beside, beside) == (None, 300, "", {})
    monkeypatch.setattr(sphere_film, "MOST_INSIDE", 100)
    film, beside = frames.inside_and_beside(0.02, 1_800, "../spheres/")
    assert (film.grains, film.of_grains, film.beside) == (100, 300, "../spheres/f50_r1.js")
    assert len(film.data) <= 1_800
    assert 2 <= len(film.time_s) < 12
    assert (film.time_s[0], film.time_s[-1]) == (frames.film.time_s[0], frames.film.time_s[-1])
    held, whole = unpacked(film.values), unpacked(frames.whole.values)
    y, every = held["place_m"][1, -1], whole["place_m"][1, -1]
    # nothing between the plane and the far end of the slice is left out
    assert film.slice_m == pytest.approx((y.min(), y.max()))
    touched = every + whole["radius_m"] >= 0.02
    assert (every[touched] < y.max() - 1e-9).sum() <= 100
    assert (y + held["radius_m"]).min() >= 0.02
    ((name, script),) = beside.items()
    assert name == "f50_r1.js"
    assert film.beside_bytes == len(script)
    assert film.beside_frames == 12
    told = json.loads(script.removeprefix("sphereFilmArrived(").removesuffix(");\n"))
    assert told["grains"] == 300
    assert np.array_equal(unpacked(told)["place_m"], whole["place_m"], equal_nan=True)


def test_a_slice_has_as_many_grains_where_the_cut_lies_far_back(
    frames: SphereFrames, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sphere_film, "MOST_INSIDE", 100)
    film = frames.light(1.0, BUDGET_BYTES)
    assert film.grains == 100
    assert film.slice_m is not None
    assert film.slice_m[1] == unpacked(frames.whole.values)["place_m"][1, -1].max()


def test_as_many_spheres_as_the_paper_has_fit(frames: SphereFrames) -> None:
    """180 000 grains at 20 moments whose places and shades are noise: nothing of them deflates."""
    n, total = 180_000, 20
    assert n * total <= MOST_BESIDE
    rng = np.random.default_rng(1)
    empty = SphereFilm(**frames.film.values)  # type: ignore[arg-type]
    times: Any = {
        name: tuple(getattr(empty, name)[0] for _ in range(total))
        for name in ("time_s", "vibration_time_s", "stage", "is_filling", "reading")
    }
    noise = SphereFrames(
        rng.integers(0, ABSENT, (3, total, n), dtype=np.uint16, endpoint=True),
        rng.random(n),
        rng.integers(1, 9, n).astype(np.uint8),
        rng.integers(0, 256, (2, total, n), dtype=np.uint8),
        SphereFilm(**(empty.values | times | {"grains": n, "of_grains": n})),
    )
    film, beside = noise.inside_and_beside(0.02, BUDGET_BYTES, "spheres/")
    (script,) = beside.values()
    assert 30e6 < len(script) <= 40e6
    assert len(film.data) <= BUDGET_BYTES
    assert film.grains == sphere_film.MOST_INSIDE
