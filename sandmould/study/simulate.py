"""One run from its folder: a process of its own, so that an outcome is written whatever happens.

``python -m sandmould.study.simulate FOLDER`` computes; ``launch`` starts and watches it.
"""

from __future__ import annotations

import collections
import contextlib
import ctypes
import fcntl
import os
import platform
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, TextIO

from sandmould import ROOT
from sandmould.engines.choosing import render
from sandmould.engines.driver import Driver
from sandmould.engines.lammps.render import template_hash
from sandmould.engines.outcome import Outcome, RunOutcome
from sandmould.engines.products import Cost, finish
from sandmould.engines.program import build_program
from sandmould.scenario.scenario import Scenario
from sandmould.study.expand import scenario_hash
from sandmould.study.plan import read_run

RESTARTABLE_EXIT = 75
"""Exit status of a run that the same command continues (EX_TEMPFAIL of sysexits.h)."""
_PR_SET_PDEATHSIG = 1


def render_run(folder: Path) -> None:
    """Render the deck of a run into its folder."""
    run = read_run(folder / "scenario.yaml")
    render(build_program(run.scenario), run.sources, folder, run.run, run.study)


def provenance(scenario: Scenario) -> dict[str, Any]:
    """Versions, template hash, seed and machine of a run."""
    packages = ("lammps", "numpy", "scipy", "snakemake", "pydantic", "jinja2")
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True
    )
    return {
        "command": " ".join(["python", "-m", "sandmould.study.simulate", *sys.argv[1:]]),
        "scenario_sha256": scenario_hash(scenario),
        "template_sha256": template_hash(),
        "seed": scenario.seed,
        "commit": commit.stdout.strip() or "not a git checkout",
        "versions": {p: metadata.version(p) for p in packages}
        | {"python": platform.python_version()},
        "machine": {
            "system": f"{platform.system()} {platform.machine()}",
            "processor": _processor(),
            "cores": os.cpu_count(),
        },
    }


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
        outcome.write(folder / "work" / "outcome.json")
        return RESTARTABLE_EXIT
    finish(folder, run.scenario.dimension, outcome, driver.cost, provenance(run.scenario))
    return 0


def _die_with_parent() -> None:
    """Ask Linux to end this process softly when the one that started it is killed."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def launch(folder: Path, log: Path, mpi: str = "mpiexec") -> None:
    """Run ``simulate`` as a process of its own, under MPI where the scenario asks for ranks.

    Parameters
    ----------
    folder : Path
        Holds ``scenario.yaml`` and the deck.
    log : Path
        Takes all that the process prints, which also goes to the terminal.
    mpi : str
        Command that starts ranks, such as ``srun --mpi=pmix``.

    Raises
    ------
    SystemExit
        When the run stopped early and the same command continues it.

    Notes
    -----
    A run whose outcome is already there is left as it is: Snakemake removes the outcome of a run
    that must be computed again.
    """
    _die_with_parent()
    run = read_run(folder / "scenario.yaml")
    command = [sys.executable, "-m", "sandmould.study.simulate", str(folder)]
    ranks = run.scenario.engine.ranks
    if ranks > 1:
        launcher = mpi.split()
        own = Path(sys.executable).parent / launcher[0]
        command = [str(own) if own.exists() else launcher[0], *launcher[1:], "-n", str(ranks),
                   *command]  # fmt: skip
    with log.open("a", encoding="utf-8") as log_file, _only_one(folder):
        if (folder / "outcome.json").exists():
            return  # finished meanwhile by a process that outlived its own snakemake
        status, tail = _watch(command, log_file)
    if status == 0:
        return
    if status == RESTARTABLE_EXIT:
        raise SystemExit(f"{run.run} stopped early with a checkpoint: the same command continues.")
    if status < 0 and -status in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT):
        raise SystemExit(f"{run.run} was killed: the same command continues from its checkpoint.")
    detail = f"the process ended with status {status}: {tail}"
    _write_crash(folder, run.scenario, detail)


@contextlib.contextmanager
def _only_one(folder: Path) -> Iterator[None]:
    """Wait for any other process that computes in a run's folder.

    One can outlive a killed snakemake; the next snakemake then finds what it finished.
    """
    (folder / "work").mkdir(exist_ok=True)
    with (folder / "lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            print(f"{folder}: waiting for the process that computes it already", file=sys.stderr)
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _watch(command: list[str], log: TextIO) -> tuple[int, str]:
    """Run a command, pass on what it prints, and keep its last words."""
    words: collections.deque[str] = collections.deque(maxlen=3)
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        preexec_fn=_die_with_parent,
    )
    signal.signal(signal.SIGTERM, lambda number, frame: process.terminate())
    assert process.stdout is not None
    for line in process.stdout:
        log.write(line)
        log.flush()
        sys.stderr.write(line)
        sys.stderr.flush()
        if line.strip():
            words.append(line.strip())
    return process.wait(), " / ".join(words)


def _write_crash(folder: Path, scenario: Scenario, detail: str) -> None:
    """Write the outcome that a crashed process could not."""
    program = build_program(scenario)
    outcome = RunOutcome(Outcome.ENGINE_FAILED, detail, 0.0, program.expected_s)
    finish(folder, scenario.dimension, outcome, Cost.of(scenario), provenance(scenario))


if __name__ == "__main__":
    raise SystemExit(simulate(Path(sys.argv[1])))
