"""One turn of a comparison of two trees: ``python -m benchmarks.scaling.turns PLACE RUNS``.

Called in turns from a tree and from that of an earlier commit; the lines are kept in turns.json.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from benchmarks.scaling.measure import executed, files
from benchmarks.scaling.study import Place
from sandmould.runs.provenance import commit
from sandmould.scenario.module_main import run_main


def turn(place: Path, runs: int) -> dict[str, Any]:
    """Compute a study of the stand-in from nothing to its report, jobs shared, on two cores."""
    there = Place(place)
    cost = executed(there, runs, there.study(runs), True, 2)
    return {"commit": commit(), "runs": runs, **cost, "files": files(there, runs)["files"],
            "jobs": len(list((there.results(runs) / "batches").glob("*.done")))}  # fmt: skip


def main(place: str, runs: str) -> int:
    """Print what a turn took, as a line of JSON."""
    print(json.dumps(turn(Path(place).absolute(), int(runs))))
    return 0


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.scaling.turns PLACE RUNS", (2,))
