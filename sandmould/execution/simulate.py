"""One run from its folder: ``python -m sandmould.execution.simulate FOLDER``."""

from __future__ import annotations

import contextlib
import signal
import sys
from pathlib import Path
from typing import Any

import sandmould.runs.one_blas_thread  # noqa: F401
from sandmould.definition.run import EXPORTED, Run
from sandmould.kinds.registry import kind_of
from sandmould.module_main import run_main
from sandmould.runs.manifest import write_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import Cost, finish
from sandmould.runs.provenance import provenance_of
from sandmould.scenario.quantity import Section
from sandmould.study.plan.plan_files import read_run

RESTARTABLE_EXIT = 75
"""Exit status of a run that the same command continues (EX_TEMPFAIL of sysexits.h)."""


def render_run(folder: Path, run: Run | None = None) -> None:
    """Render the deck of a run into its folder; ``run``: read from there unless given."""
    run = run or read_run(folder / "scenario.yaml")
    kind_of(run.scenario).execution.render(run, folder)


def export_run(folder: Path) -> None:
    """Draw the end of a measured run, and write what other programs read."""
    run = read_run(folder / "scenario.yaml")
    kind_of(run.scenario).execution.export(run, folder)


def measure_run(folder: Path, run: Run | None = None) -> None:
    """Measure what a run left behind, and write down what that writes."""
    run = run or read_run(folder / "scenario.yaml")
    for old in EXPORTED:  # of other grains, or drawn by other code
        (folder / old).unlink(missing_ok=True)
    earlier = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    kind_of(run.scenario).execution.measure(run, folder)
    written = {
        path.relative_to(folder).as_posix(): path.stat().st_size
        for path in folder.rglob("*")
        if path.is_file() and earlier.get(path) != path.stat().st_mtime_ns
    }
    code = kind_of(run.scenario).planning.measured_by(run.scenario)
    write_manifest(folder, "measured", written, code=code)


def provenance(scenario: Any, *arguments: str) -> dict[str, Any]:
    """Versions, template hash, seed and machine of a run; arguments are those of its command."""
    command = " ".join(["python", "-m", "sandmould.execution.simulate", *arguments])
    template_hash = kind_of(scenario).planning.template_hash(scenario)
    return provenance_of(scenario, scenario.seed, template_hash, command)


def simulate(folder: Path, run: Run | None = None) -> int:
    """Compute a run in this process, or as one rank of several.

    ``run``: read from its folder unless given.

    Gives the exit status: 0 when the outcome is written, ``RESTARTABLE_EXIT`` when the run stopped
    early with a checkpoint.
    """
    run = run or read_run(folder / "scenario.yaml")
    computed = kind_of(run.scenario).execution.compute(run, folder)
    if not computed.is_root:
        return 0
    outcome = computed.outcome
    print(f"{run.run}: {outcome.outcome.label}. {outcome.detail}".strip(), file=sys.stderr)
    if outcome.outcome.restartable:
        with contextlib.suppress(OSError):  # the disk that refused more may refuse this too
            outcome.write(folder / "work" / "outcome.json")
        return RESTARTABLE_EXIT
    _finish(folder, run.scenario, outcome, computed.cost)
    return 0


def write_crash(folder: Path, detail: str) -> None:
    """Write the outcome that a crashed process could not."""
    scenario = read_run(folder / "scenario.yaml").scenario
    kind = kind_of(scenario)
    outcome = RunOutcome(Outcome.ENGINE_FAILED, detail, 0.0, kind.planning.planned_s(scenario))
    _finish(folder, scenario, outcome, kind.execution.no_cost(scenario))


def _finish(folder: Path, scenario: Section, outcome: RunOutcome, cost: Cost) -> None:
    execution = kind_of(scenario).execution
    execution.complete(scenario, folder / "work")
    finish(folder, execution.products, outcome, cost, provenance(scenario, str(folder)))


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it as a kill does, silently
    run_main(
        lambda folder: simulate(Path(folder)),
        "python -m sandmould.execution.simulate FOLDER-OF-A-RUN",
        (1,),
    )
