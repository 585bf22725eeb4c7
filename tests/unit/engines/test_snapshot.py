"""Snapshots in files: what is absent there."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandmould.engines.snapshot import Snapshot, SnapshotFile, stored_snapshots

ONE = np.array([1])
FILLING = Snapshot(
    0.1, math.nan, "settle_1", ONE, ONE, np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, 3)),
    np.array([0.002]),
)  # fmt: skip


@pytest.mark.parametrize("shaken_s", [math.nan, 0.0, 0.5])
def test_time_of_vibration_is_absent_before_it(tmp_path: Path, shaken_s: float) -> None:
    snapshot = replace(FILLING, vibration_time_s=shaken_s)
    file = SnapshotFile(tmp_path, 0)
    file.append(snapshot)
    file.close()
    stored = np.load(tmp_path / "snapshots.npz")["000000/vibration_time_s"]
    np.testing.assert_equal(stored, shaken_s)
    (one,) = stored_snapshots(tmp_path)
    np.testing.assert_equal(one.times_s(), (0.1, shaken_s))
    np.testing.assert_equal(one.load().vibration_time_s, shaken_s)
