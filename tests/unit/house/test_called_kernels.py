"""Compiled functions that one process has called are loaded by the next before they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numba import prange

from sandmould import called_kernels
from sandmould.called_kernels import keep_kernels, kept_kernels, load_kernels, loaded_kernels
from sandmould.compiled import njit
from sandmould.execution.jobs import load_for
from tests.scenes import tube_scene


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(called_kernels, "FOLDER", tmp_path)
    monkeypatch.setattr(called_kernels, "KEEPS", True)
    return tmp_path


def test_what_was_called_is_kept_and_loaded(kept: Path) -> None:
    @njit()
    def twice(values):  # type: ignore[no-untyped-def]
        return 2.0 * values

    before = loaded_kernels()
    twice(np.ones(3))
    (called,) = loaded_kernels() - before
    assert kept_kernels("disc_2") == set()
    keep_kernels("disc_2", {called})
    keep_kernels("disc_2", {'["gone.function", []]'})
    assert kept_kernels("disc_2") == {called, '["gone.function", []]'}
    assert kept_kernels("sphere_3") == set()

    @njit()
    def again(values):  # type: ignore[no-untyped-def]
        return 2.0 * values

    again_called = called.replace("twice", "again")
    load_kernels([again_called, '["gone.function", []]'])
    assert again_called in loaded_kernels()


def test_a_damaged_list_stops_no_run(kept: Path) -> None:
    scenario = tube_scene(engine={"name": "reference"})
    (kept / "called_reference_2.txt").write_text("[torn")
    before = loaded_kernels()
    load_for(scenario)
    assert loaded_kernels() == before


def test_what_calls_parallel_code_is_not_loaded_before_it_is_called(kept: Path) -> None:
    @njit(parallel=True)
    def shared_out(values):  # type: ignore[no-untyped-def]
        for i in prange(len(values)):
            values[i] += 1.0

    @njit()
    def between(values):  # type: ignore[no-untyped-def]
        shared_out(values)

    @njit()
    def caller(values):  # type: ignore[no-untyped-def]
        between(values)

    @njit()
    def alone(values):  # type: ignore[no-untyped-def]
        return values.sum()

    before = loaded_kernels()
    caller(np.ones(3))
    alone(np.ones(3))
    (called,) = loaded_kernels() - before
    assert "alone" in called

    @njit()
    def later(values):  # type: ignore[no-untyped-def]
        between(values)

    load_kernels([called.replace("alone", "later")])
    assert later.signatures == []  # type: ignore[attr-defined]
