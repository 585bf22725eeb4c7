"""Liquid that is cut off from risers, worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.analysis.feeding import Array, cut_off, feeding, neighbours

CELL_M = 0.001
PLACE_M = CELL_M * (np.indices((30, 10)).reshape(2, -1).T + 0.5)
X = PLACE_M[:, 0] / CELL_M
SIZE_M = np.full(len(X), CELL_M)
# a bar with two swellings: at 5 mm it flows for 100 s, at 25 mm for 60 s, between them for 30 s
FLOWS_S = np.interp(X, [0, 5, 15, 25, 30], [50, 100, 30, 60, 20])


def found(riser: Array, flows_s: Array = FLOWS_S) -> list[tuple[list[float], float, float, float]]:
    """Ends along x (mm) and volume (mm2), cut off, flows until, and path (mm) of each part."""
    return [
        (
            [1e3 * it.region.low_m[0], 1e3 * it.region.high_m[0], 1e6 * it.region.volume_m3],
            it.cut_off_s,
            it.solid_s,
            1e3 * it.path_m,
        )
        for it in cut_off(PLACE_M, SIZE_M, SIZE_M**2, flows_s, riser.astype(bool))
    ]


def test_without_risers_what_flows_last_feeds() -> None:
    ((ends, at_s, until_s, path_mm),) = found(np.zeros(len(X)))
    # the throat lies at 15.5 mm and closes after 31.5 s; at 28.5 mm metal flows for 32 s
    assert ends == pytest.approx([16.0, 29.0, 130.0])
    assert at_s == pytest.approx(31.5)
    assert until_s == FLOWS_S[X == 24.5].max()
    assert path_mm == pytest.approx(19.0, abs=1.5)


def test_a_riser_at_the_smaller_swelling_leaves_the_other_alone() -> None:
    ((ends, at_s, until_s, path_mm),) = found(X > 22)
    assert ends == pytest.approx([0.0, 15.0, 150.0])
    assert at_s == pytest.approx(31.5)
    assert until_s == FLOWS_S.max()
    # from 5 mm to where the riser begins
    assert path_mm == pytest.approx(17.5, abs=1.0)


def test_a_riser_that_freezes_first_feeds_nothing() -> None:
    parts = found(X > 28)
    assert len(parts) == 2
    # the riser's last liquid goes after 32 s, before the throat closes
    assert [part[1] for part in parts] == pytest.approx([31.5, 32.0])
    assert parts[1][0] == pytest.approx([16.0, 28.0, 120.0])


def test_what_is_fed_or_falls_straight_is_not_told() -> None:
    assert found(X < 10, np.interp(X, [0, 30], [100, 20])) == []
    assert found(np.zeros(len(X)), np.interp(X, [0, 30], [100, 20])) == []


def test_a_casting_that_touches_no_riser_is_cut_off_from_the_beginning() -> None:
    apart = (X < 12) | (X > 18)
    (part,) = cut_off(PLACE_M[apart], SIZE_M[apart], SIZE_M[apart] ** 2, FLOWS_S[apart],
                      (X > 18)[apart])  # fmt: skip
    assert part.cut_off_s == 0.0
    assert np.isnan(part.path_m)
    assert 1e6 * part.region.volume_m3 == pytest.approx(120.0)


def test_elements_of_two_sizes_touch_by_faces() -> None:
    place = np.array([[1.0, 1.0], [2.5, 0.5], [2.5, 1.5], [3.5, 2.5]])
    first, second = neighbours(place, np.array([2.0, 1.0, 1.0, 1.0]))
    assert set(zip(first.tolist(), second.tolist(), strict=True)) == {(0, 1), (0, 2), (1, 2)}


def test_a_low_niyama_is_told_by_its_place_and_without_risers() -> None:
    niyama = np.where((X > 10) & (X < 14), 300.0, 2000.0)
    niyama[X == 12.5] = 100.0
    niyama[X > 22] = 0.0
    fields = {
        "melts": np.ones(len(X), bool), "position_m": PLACE_M, "size_m": SIZE_M,
        "volume_m3": SIZE_M**2, "flows_s": FLOWS_S, "riser": X > 22, "niyama_sqrt_ks_m": niyama,
    }  # fmt: skip
    it = feeding(fields)
    assert it.low is not None
    assert (1e3 * it.low.low_m[0], 1e3 * it.low.high_m[0]) == pytest.approx((10.0, 14.0))
    assert it.low_fraction == pytest.approx(4 / 22)
    assert (1e3 * it.lowest_m[0], it.least_niyama) == pytest.approx((12.5, 100.0))
    flowing = FLOWS_S.copy()
    flowing[X == 5.5] = np.nan
    early = feeding(fields | {"flows_s": flowing})
    assert early is not None
    assert np.isnan(early.cut_off_fraction)
    in_riser = feeding(fields | {"flows_s": np.where(X > 22, np.nan, FLOWS_S)})
    assert in_riser is not None
    assert in_riser.cut_off_fraction == pytest.approx(15 / 22)
    nowhere = feeding(fields | {"niyama_sqrt_ks_m": np.full(len(X), np.nan)})
    assert nowhere.low is None
    assert np.isnan(nowhere.low_fraction)
