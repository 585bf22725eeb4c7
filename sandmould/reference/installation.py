"""What an installation has and lacks: the text of ``sandmould doctor``."""

from __future__ import annotations

import os
import platform
import re
import shutil
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from sandmould import SHIPPED
from sandmould.engines.registry import engine_module
from sandmould.execution.cluster.settings import CLUSTER_FILE
from sandmould.kernel_cache import cache_folder
from sandmould.runs.formatting import size_text
from sandmould.runs.provenance import commit, processor
from sandmould.scenario.engine import ENGINE_NAMES, EngineName

LOCK = SHIPPED / "requirements.lock"
"""The versions that the tests run with; a package may have one for older Pythons too."""
_PINNED = re.compile(r"^([\w.-]+)==(\S+)", re.M)
SMALLEST_DISK_BYTES = 2_000_000_000
"""A study of some dozen runs takes a tenth of it (docs/running.md)."""


@dataclass(frozen=True)
class InstallationPart:
    """One thing that was looked at."""

    what: str
    found: str
    wrong: str = ""
    """What to do about it; empty where nothing is wrong."""


def findings(folder: Path) -> list[InstallationPart]:
    """Look at the program, its engines, the machine, the cluster and the disk."""
    return [
        InstallationPart("sandmould", f"{metadata.version('sandmould')} ({commit()})"),
        InstallationPart("Python", f"{platform.python_version()}, {platform.platform(terse=True)}"),
        InstallationPart("processor", f"{processor()}, {os.cpu_count()} cores"),
        _packages(),
        *(_engine(name) for name in ENGINE_NAMES),
        _kernels(),
        _slurm(),
        _disk(folder),
    ]


def _packages() -> InstallationPart:
    """Packages whose versions are others than those that the tests run with."""
    tested: dict[str, list[str]] = {}
    for name, version in _PINNED.findall(LOCK.read_text(encoding="utf-8")):
        tested.setdefault(name, []).append(version)
    differ = [
        f"{name} {installed} (tested: {' or '.join(versions)})"
        for name, versions in tested.items()
        if (installed := _installed(name)) not in (None, *versions)
    ]
    text = f"not the versions that were tested: {', '.join(differ)}" if differ else "as tested"
    return InstallationPart("packages", text)


def _installed(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _engine(name: EngineName) -> InstallationPart:
    engine = engine_module(name)
    problem = engine.installation_problem()
    version = engine.installed_version()
    found = f"version {version}" if version else "not installed"
    wrong = f"studies on this engine need {problem}" if problem else ""
    return InstallationPart(f"engine {name}", found, wrong)


def _kernels() -> InstallationPart:
    folder = cache_folder()
    none = f"none yet; the first study compiles them into {folder}"
    said = f"kept in {folder}" if any(folder.glob("**/*.nbi")) else none
    return InstallationPart("compiled loops", said)


def _slurm() -> InstallationPart:
    if shutil.which("sbatch") is None:
        return InstallationPart("cluster", "no Slurm on this machine")
    settings = f"{CLUSTER_FILE} is there" if CLUSTER_FILE.is_file() else f"no {CLUSTER_FILE} here"
    return InstallationPart("cluster", f"Slurm; {settings} (docs/cluster.md)")


def _disk(folder: Path) -> InstallationPart:
    place = folder if folder.is_dir() else Path.cwd()
    free = shutil.disk_usage(place).free
    said = f"{size_text(free)} free in {place.absolute()}"
    if not os.access(place, os.W_OK):
        return InstallationPart("disk", said, "work in a folder that you may write to")
    wrong = "free some: a study can take a few hundred MB" if free < SMALLEST_DISK_BYTES else ""
    return InstallationPart("disk", said, wrong)


def doctor_text(found: list[InstallationPart]) -> str:
    """One line a finding; what to do stands below it."""
    width = max(len(finding.what) for finding in found)
    lines = []
    for finding in found:
        lines.append(f"{finding.what.ljust(width)}  {finding.found}")
        if finding.wrong:
            lines.append(f"{' ' * width}  -> {finding.wrong}")
    return "\n".join(lines)
