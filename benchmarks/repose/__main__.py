"""Angle of heaps by where the fit of their slope begins: ``python -m benchmarks.repose FOLDER``.

FOLDER is that of a finished study, such as results/repose_paper; its last snapshots are measured.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.frame import table
from sandmould.analysis import repose
from sandmould.bad_input import BadInputError, Problem
from sandmould.engines.snapshot import Snapshot
from sandmould.kinds.sand.moments import list_moments
from sandmould.kinds.sand.outflow import slopes
from sandmould.module_main import run_main
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.plan_files import read_run

FEET = (0.2, 0.3, repose.HEAP_FOOT, 0.4, 0.5)


def _heap(folder: Path) -> tuple[Scenario, Snapshot]:
    """Scenario and last snapshot of a run."""
    scenario = read_run(folder / "scenario.yaml").scenario
    try:
        return scenario, list_moments(folder)[-1].load()
    except (LookupError, ValueError) as error:
        valid = f"a folder of finished runs whose snapshots can be read ({error})"
        raise BadInputError([Problem("FOLDER", str(folder), valid)]) from error


def main(study_folder: str) -> None:
    """Measure, print."""
    study = Path(study_folder)
    heaps = [_heap(folder) for folder in sorted((study / "runs").iterdir())]
    rows = []
    for foot in FEET:
        repose.HEAP_FOOT = foot
        fits = [slopes(scenario, sand)[0] for scenario, sand in heaps]
        angle = [slope.angle_deg for slope in fits]
        error = np.mean([slope.se_deg for slope in fits])
        rows.append([f"{foot:.0%}", f"{np.mean(angle):.1f}", f"{np.std(angle, ddof=1):.1f}",
                     f"{error:.1f}"])  # fmt: skip
    head = ["fitted from", "angle, degrees", "sd of heaps", "error of one fit, mean"]
    print(table(head, rows))


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.repose FOLDER-OF-A-STUDY", (1,))
