"""What CONTRIBUTING.md names is there: files, folders, targets of make and modules that run."""

from __future__ import annotations

import importlib.util
import re

from sandmould import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
FOLDERS = r"sandmould|analysis|pattern_fe|tests|docs|config|templates|benchmarks|\.ci"
PATHS = set(re.findall(rf"[`(]((?:{FOLDERS})/[\w./*-]*)", PAGE))
MADE = ("NAME", "RESULTS")
"""Stand in a path for what the reader makes."""


def test_files_and_folders_are_there() -> None:
    named = [path for path in PATHS if not any(made in path for made in MADE)]
    assert len(named) > 40
    assert [path for path in named if not any(ROOT.glob(path))] == []


def test_commands_are_there() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"[`\n]make ([a-z-]+)", PAGE))
    modules = set(re.findall(r"python -m ([\w.]+)", PAGE))
    assert len(targets) > 8
    assert len(modules) > 3
    assert [each for each in targets if f"\n{each}:" not in makefile] == []
    assert [each for each in modules if importlib.util.find_spec(each) is None] == []
