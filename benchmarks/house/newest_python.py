"""Whether every locked package has a wheel for the newest Python that is supported.

``make lock-check``. It asks the package index and installs nothing. The tests themselves run on the
oldest Python alone.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator

from packaging.markers import Marker, default_environment

from sandmould import ROOT
from sandmould.module_main import run_main

NEWEST = "3.13"
SOURCE_ALONE = {"connection-pool"}
"""Comes without wheels for any Python; it is pure Python."""


def pins(lock: str, python: str) -> Iterator[str]:
    """Pinned packages of a lock file that this machine needs with a Python, ``name==version``."""
    environment = {str(key): str(value) for key, value in default_environment().items()}
    environment |= {"python_version": python, "python_full_version": f"{python}.0"}
    for name, version, marker in re.findall(
        r"^([\w.-]+)==(\S+)(?: ; (.*?))? \\$", lock, re.MULTILINE
    ):
        if not marker or Marker(marker).evaluate(environment):
            yield f"{name}=={version}"


def main() -> int:
    """Have pip look for the wheels; its message names a package that has none."""
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    wanted = [pin for pin in pins(lock, NEWEST) if pin.split("==")[0] not in SOURCE_ALONE]
    command = [
        sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--no-deps",
        "--ignore-installed", "--target", "unused", "--only-binary=:all:",
        "--python-version", NEWEST, *wanted,
    ]  # fmt: skip
    status = subprocess.run(command, cwd=ROOT).returncode
    found = "missing" if status else "all there"
    print(f"{len(wanted)} locked packages, wheels for Python {NEWEST}: {found}")
    return status


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.house.newest_python")
