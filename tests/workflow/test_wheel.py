"""The built wheel alone, outside a clone: it has all that the command needs."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from sandmould import ROOT

SHIPPED = ("Snakefile", "config", "profiles", "requirements.lock", "templates", "workflow")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the installed wheel and nothing else of the house."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    zipfile.ZipFile(wheel).extractall(folder / "site")
    return folder / "site"


def test_it_holds_every_file_that_a_clone_has_in_git(site: Path) -> None:
    listed = subprocess.run(
        ["git", "ls-files", "--", *SHIPPED], cwd=ROOT, check=True, capture_output=True, text=True
    )
    missing = [
        name for name in listed.stdout.split() if not (site / "sandmould/shipped" / name).is_file()
    ]
    assert missing == []
    assert not (site / "tests").exists()
    assert (site / "sandmould" / "py.typed").is_file()


def test_it_takes_one_name_from_its_user(site: Path, tmp_path: Path) -> None:
    assert [path.name for path in site.iterdir() if path.suffix != ".dist-info"] == ["sandmould"]
    for name in ("analysis", "pattern_fe"):
        (tmp_path / f"{name}.py").write_text(
            "raise SystemExit('a file of the user was executed')\n"
        )
    script = (
        "import sandmould.pattern_fe, sandmould.analysis.density, sandmould.kinds.sand.planning"
    )
    ran = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(site)}, capture_output=True, text=True,
    )  # fmt: skip
    assert (ran.returncode, ran.stderr) == (0, "")


@pytest.mark.slow
def test_the_quick_demonstration_runs_from_it(site: Path, tmp_path: Path) -> None:
    # A folder above the packages comes before the clone that is installed here for development.
    # One core: runs side by side would each compile the kernels, which are new in this place.
    ran = subprocess.run(
        [sys.executable, "-m", "sandmould.cli", "demo", "--quick", "--cores", "1"],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(site)}, capture_output=True, text=True,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr[-3000:]
    last = ran.stdout.splitlines()[-1]
    assert last.startswith("The installation works. ")
    assert last.endswith("The report: results/tube_quick/report.html")
    assert (tmp_path / "results/tube_quick/report.html").is_file()
    page = (tmp_path / "results/tube_quick/report.html").read_text(encoding="utf-8")
    assert str(ROOT) not in page
    assert "sandmould 0." in page  # its version stands for a commit
