"""What share of a recorded study of bent patterns went into anything but grains.

``python -m benchmarks.coupling docs/results/l_deflection`` prints, for each run, the share of
its wall time outside the engine (opening, guards, tables), in the pattern's solves, and in the
pattern's own steps inside the engine: their number times what one takes on this machine now.
"""

from __future__ import annotations

import ctypes
import json
import time
from pathlib import Path

import pandas as pd

from sandmould import ROOT
from sandmould.bad_input import BadInputError, Problem
from sandmould.execution.records import runs_in
from sandmould.module_main import run_main
from sandmould.pattern_fe.coupling.schemes import in_step_foam
from sandmould.pattern_fe.scene import pattern_of
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.load_study import open_study

STEPS = 50_000


def step_s(scenario: Scenario) -> float:
    """Time of one step of a pattern, s; 0 unless it moves in step with the grains."""
    pattern = scenario.pattern
    if pattern is None or pattern.loop.scheme != "in_step":
        return 0.0
    foam = in_step_foam(scenario, pattern_of(scenario))
    go = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)(foam.mover.call)
    begun = time.perf_counter()
    for step in range(STEPS):
        go(foam.mover.table, step)
    return (time.perf_counter() - begun) / STEPS


def main(record_folder: str) -> None:
    """Print the shares of each run and of all together."""
    folder = Path(record_folder)
    try:
        record = json.loads((folder / "record.json").read_text())
        study = open_study(ROOT / record["study"])
        scenario = {run.run: run.scenario for run in runs_in(study, folder)}
        summary = pd.read_csv(folder / "summary.tsv", sep="\t").set_index("run")
        shares = pd.DataFrame({"wall_s": summary["wall_s"]})
        shares["outside_engine_s"] = summary["wall_s"] - summary["engine_wall_s"]
        shares["solves_s"] = summary["pattern_outside_fraction"] * summary["wall_s"]
        steps, scenarios = summary["steps"], [scenario[run] for run in summary.index]
    except (LookupError, TypeError, ValueError) as error:
        valid = f"the folder of a whole record of bent patterns ({error})"
        raise BadInputError([Problem("FOLDER", record_folder, valid)]) from error
    shares["pattern_steps_s"] = [step_s(each) for each in scenarios] * steps
    shares.loc["all"] = shares.sum()
    for part in ("outside_engine", "solves", "pattern_steps"):
        shares[f"{part}_fraction"] = shares.pop(f"{part}_s") / shares["wall_s"]
    shares["sum_fraction"] = shares.filter(like="_fraction").sum(axis=1)
    print(shares.round(3).to_string())


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.coupling FOLDER-OF-A-RECORD", (1,))
