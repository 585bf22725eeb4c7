"""One run from its folder: ``python -m sandmould.study.simulate FOLDER``.

``sandmould.study.process`` starts and watches it as a process of its own.
"""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import Any

from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import Cost, finish
from sandmould.runs.provenance import provenance_of
from sandmould.study.kinds.kind import AnyScenario, kind_of
from sandmould.study.plan_files import read_run
from sandmould.study.process import RESTARTABLE_EXIT


def render_run(folder: Path) -> None:
    """Render the deck of a run into its folder."""
    run = read_run(folder / "scenario.yaml")
    kind_of(run.scenario).render(run, folder)


def measure_run(folder: Path) -> None:
    """Measure what a run left behind."""
    run = read_run(folder / "scenario.yaml")
    kind_of(run.scenario).measure(run, folder)


def provenance(scenario: AnyScenario) -> dict[str, Any]:
    """Versions, template hash, seed and machine of a run."""
    command = " ".join(["python", "-m", "sandmould.study.simulate", *sys.argv[1:]])
    template_hash = kind_of(scenario).template_hash(scenario)
    return provenance_of(scenario, scenario.seed, template_hash, command)


def simulate(folder: Path) -> int:
    """Compute a run in this process, or as one rank of several.

    Returns
    -------
    int
        Exit status: 0 when the outcome is written, ``RESTARTABLE_EXIT`` when the run stopped
        early with a checkpoint.
    """
    run = read_run(folder / "scenario.yaml")
    computed = kind_of(run.scenario).compute(run, folder)
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
    outcome = RunOutcome(Outcome.ENGINE_FAILED, detail, 0.0, kind.planned_s(scenario))
    _finish(folder, scenario, outcome, kind.no_cost(scenario))


def _finish(folder: Path, scenario: AnyScenario, outcome: RunOutcome, cost: Cost) -> None:
    kind = kind_of(scenario)
    kind.complete(scenario, folder / "work")
    finish(folder, kind.PRODUCTS, outcome, cost, provenance(scenario))


def main(folder: Path, crash: str | None = None) -> int:
    """Compute a run, or write down how another process of it crashed."""
    if crash is None:
        return simulate(folder)
    write_crash(folder, crash)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]), *sys.argv[2:]))
