"""Loose sand of a 3D run: its row of measures, its table of zones, and what the report says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sandmould.engines.snapshot import Snapshot
from sandmould.kinds.sand.measure import (
    LOOSE_ZONES,
    add_loose_sand,
    last_loose_sand,
    write_loose_zones,
)
from sandmould.report.loose_sand import loose_sand_pages
from sandmould.scenario.sand import Sand
from sandmould.scenario.scenario import Scenario
from tests.snapshots import write_snapshots

GRAIN_M = 0.001
PLATE = {"kind": "plate", "name": "part", "centre_m": [0.007, 0.007, 0.009],
         "size_m": [0.006, 0.006, 0.002]}  # fmt: skip


def scene(**keys: object) -> Scenario:
    """A plate in a small box, for grains whose median is 1 mm."""
    scale = GRAIN_M / Sand(size_scale=1.0).mass_median_diameter_m
    box = {"width_m": 0.014, "depth_m": 0.014, "height_m": 0.02}
    of_scene = {"dimension": 3, "box": box, "obstacles": [PLATE], "sand": {"size_scale": scale}}
    return Scenario.model_validate(of_scene | keys)


def hollow() -> np.ndarray:
    """Spheres in rows round the plate; 108 are missing under it."""
    axes = [GRAIN_M * (np.arange(n) + 0.5) for n in (14, 14, 16)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    for middle, half in (([7.0, 7.0, 9.0], [3.0, 3.0, 1.0]), ([7.0, 7.0, 6.5], [3.0, 3.0, 1.5])):
        outside = np.abs(places / GRAIN_M - middle) > np.array(half) + 0.01
        places = places[outside.any(axis=1)]
    return places


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Results of a study with one run that has one snapshot."""
    places = hollow()
    ids, none = np.arange(1, len(places) + 1), np.zeros((len(places), 3))
    radius = np.full(len(places), GRAIN_M / 2)
    still = Snapshot(0.1, np.nan, "settle_1", ids, np.ones_like(ids), places, none, none, radius)
    write_snapshots(tmp_path / "runs" / "one", [still])
    return tmp_path


def test_a_hollow_under_a_plate_is_measured_and_told(folder: Path) -> None:
    run = folder / "runs" / "one"
    loose = last_loose_sand(scene(), run)
    assert loose is not None
    table = add_loose_sand(pd.DataFrame({"time_s": [0.0, 0.1]}), loose)
    first, last = table.to_dict("records")
    assert np.isnan(first["loose_fraction"])
    assert last["loose_over_fraction"] == 0.0
    assert last["loose_zones"] == 1
    write_loose_zones(loose, run / LOOSE_ZONES)
    (written,) = pd.read_csv(run / LOOSE_ZONES, sep="\t").to_dict("records")
    assert (written["side"], written["near"]) == ("under", "part")
    assert written["z_from_m"] < written["z_to_m"] <= 0.008
    pages = loose_sand_pages(folder, "one", scene(), 0.02)
    assert pages is not None
    assert last["loose_under_fraction"] == 1.0
    assert pages["picture"].startswith("data:image/png;base64,")
    sentence = (
        "Sand lies loose at 100 % of the places straight under the obstacles, 0 % of the places"
    )
    assert pages["sentences"][0].startswith(sentence)
    share = f"{100 * last['loose_away_fraction']:.1f} %"
    assert pages["sentences"][1].startswith(f"By chance and in corners it is {share}: the share")
    (row,) = pages["table"].rows
    assert [cell.text for cell in row[:2]] == ["1", "under the part"]
    for cell, axis in zip(row[2:5], "xyz", strict=True):
        ends_mm = [1e3 * written[f"{axis}_{end}_m"] for end in ("from", "to")]
        # in whole mm
        assert [float(end) for end in cell.text.split(" to ")] == pytest.approx(ends_mm, abs=0.51)
    assert float(row[6].sort) == pytest.approx(
        last["largest_loose_zone_m3"] / (np.pi / 6 * GRAIN_M**3), rel=1e-4
    )


def test_a_hollow_is_told_in_2d_too(tmp_path: Path) -> None:
    axes = [GRAIN_M * (np.arange(n) + 0.5) for n in (14, 16)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    for middle, half in (([7.0, 9.0], [3.0, 1.0]), ([7.0, 6.5], [3.0, 1.5])):
        apart = np.abs(places / GRAIN_M - middle) > np.array(half) + 0.01
        places = places[apart.any(axis=1)]
    ids, none = np.arange(1, len(places) + 1), np.zeros_like(places)
    spin, radius = np.zeros(len(places)), np.full(len(places), GRAIN_M / 2)
    still = Snapshot(0.1, np.nan, "settle_1", ids, np.ones_like(ids), places, none, spin, radius)
    write_snapshots(tmp_path / "runs" / "one", [still])
    plate = PLATE | {"centre_m": [0.007, 0.009], "size_m": [0.006, 0.002]}
    own = scene(dimension=2, box={"width_m": 0.014, "height_m": 0.02}, obstacles=[plate])
    pages = loose_sand_pages(tmp_path, "one", own, 0.02)
    assert pages is not None
    assert pages["sentences"][0].startswith("Sand lies loose at 100 % of the places straight under")
    (row,) = pages["table"].rows
    # circles see it from up to 1.5 mm beside it
    assert [cell.text for cell in row[:4]] == ["1", "under the part", "3 to 11", "4 to 8"]
    assert [column.title for column in pages["table"].columns][4] == "area, mm²"
    assert pages["picture"].startswith("data:image/png;base64,")
    assert pages["surface"] is None


def test_none_is_measured_in_2d_or_without_obstacles(folder: Path) -> None:
    assert last_loose_sand(Scenario(dimension=3), folder / "runs" / "one") is None
    assert last_loose_sand(Scenario(), folder / "runs" / "one") is None
    assert loose_sand_pages(folder, "", scene(), 0.02) is None
