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


NO_RUNS = '{"study": "config/studies/l_stability.yaml"}'


@pytest.mark.parametrize("record", ["{", "{}", "[]", NO_RUNS])
def test_shares_of_a_damaged_record(
    record: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "record.json").write_text(record)
    (tmp_path / "runs.tsv").write_text("run\treplicate\tseed\n")
    (tmp_path / "summary.tsv").write_text("run\twall_s\none\t1.0\n")
    sentence = said("benchmarks.coupling", tmp_path, monkeypatch)
    assert sentence.startswith(f"FOLDER = '{tmp_path}' cannot be used: valid is the folder of a")
    assert len(sentence.splitlines()) == 1


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
