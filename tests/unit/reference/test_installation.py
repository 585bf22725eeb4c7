"""What ``sandmould doctor`` finds, and what it says where something is missing."""

from __future__ import annotations

import shutil
from collections import namedtuple
from importlib.metadata import version
from pathlib import Path

import pytest

from sandmould.engines.liggghts import engine as liggghts
from sandmould.reference import installation
from sandmould.reference.installation import doctor_text, findings
from sandmould.scenario.engine import ENGINE_NAMES


def test_every_engine_is_told_and_nothing_is_wrong_with_a_whole_installation(
    tmp_path: Path,
) -> None:
    found = findings(tmp_path)
    assert {f"engine {name}" for name in ENGINE_NAMES} <= {each.what for each in found}
    assert [each.what for each in found if each.wrong] == []


def test_versions_that_were_not_tested_are_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def packages() -> str:
        return next(each.found for each in findings(tmp_path) if each.what == "packages")

    assert packages() == "as tested"
    lock = tmp_path / "requirements.lock"
    lock.write_text(
        "numpy==1.0 \\\n    --hash=sha256:0\nabsent==2.0\n"
        f"scipy=={version('scipy')} ; python_version < '3.12'\nscipy==0.1\n"
    )
    monkeypatch.setattr(installation, "LOCK", lock)
    numpy = f"numpy {version('numpy')} (tested: 1.0)"
    assert packages() == f"not the versions that were tested: {numpy}"


def test_what_is_missing_is_told_with_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(liggghts, "installed_version", lambda: 0)
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(10**10, 10**10 - 10**8, 10**8))
    monkeypatch.setattr(shutil, "which", lambda _: None)
    text = doctor_text(findings(tmp_path))
    assert "engine liggghts   not installed\n" in text
    assert "-> studies on this engine need an installed LIGGGHTS: apt install liggghts" in text
    assert "100.0 MB free" in text
    assert "-> free some" in text
    assert "no Slurm on this machine" in text
