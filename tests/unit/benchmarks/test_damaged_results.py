"""Benchmarks that read results tell a damaged folder in one sentence."""

from __future__ import annotations

import runpy
import shutil
import sys
from pathlib import Path

import pytest

from tests.fuzz.readers import CORPUS


def said(module: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(sys, "argv", [module, str(folder)])
    with pytest.raises(SystemExit) as end:
        runpy.run_module(module, run_name="__main__")
    return str(end.value.code)


@pytest.mark.parametrize("snapshot", [None, b"no archive"])
def test_heaps_of_damaged_runs(
    snapshot: bytes | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "runs" / "one"
    (run / "snapshots").mkdir(parents=True)
    shutil.copyfile(CORPUS / "planned_run" / "tube.yaml", run / "scenario.yaml")
    if snapshot is not None:
        (run / "snapshots" / "000001.npz").write_bytes(snapshot)
    sentence = said("benchmarks.repose", tmp_path, monkeypatch)
    assert sentence.startswith(f"FOLDER = '{run}' cannot be used: valid is a folder of finished")
    assert len(sentence.splitlines()) == 1
