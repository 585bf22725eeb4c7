"""The source tree of a commit, beside that of today."""

from __future__ import annotations

import subprocess
from pathlib import Path

from sandmould import ROOT


def unpack(commit: str, folder: Path) -> Path:
    """Unpack the tree of a commit into a folder of its own, unless that is there.

    Raises
    ------
    subprocess.CalledProcessError
        When the clone does not have the commit.
    """
    tree = folder / commit
    if not tree.exists():
        command = ["git", "archive", commit]
        packed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout
        tree.mkdir(parents=True)
        subprocess.run(["tar", "-x", "-C", tree], input=packed, check=True)
    return tree
