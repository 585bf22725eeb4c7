"""Metal flow by particles: noise against cost of the schemes, the solver's share, size, peers.

``make flow`` runs ``python -m benchmarks.mps``, which writes docs/metal_flow.md; with ``--quick``
runs last 0.3 s. The parts ``solvers`` and ``peers`` need an environment of their
own, ``.venv-peers-flow``, which ``make flow`` makes.
"""

from __future__ import annotations

from typing import Any

from benchmarks.frame import Benchmark, BenchmarkRun
from benchmarks.mps.page import RECOMMENDED, page
from benchmarks.mps.peers import peer_rows
from benchmarks.mps.runs import SCHEMES, large_row, scheme_rows
from benchmarks.mps.solvers import solver_rows
from sandmould.casting.mps import source_hash

AGAIN = 2
"""Runs of the setting to take besides its row, for the spread of its cost."""
LONG_S, SHORT_S = 2.0, 0.3
"""The paper's duration, and one that shows that everything works: what is calm at first may not
stay so."""
PEERS_S = 0.3
"""iisph takes minutes of one core for it, and its metal leaves the tank before 0.5 s."""


def origin(run: BenchmarkRun, duration_s: float) -> dict[str, Any]:
    """Where and with what a part is computed."""
    return {
        "machine": run.origin["machine"], "commit": run.origin["commit"], "solver": source_hash(),
        "duration_s": duration_s,
    }  # fmt: skip


def schemes(run: BenchmarkRun) -> dict[str, Any]:
    """Run all schemes, the recommended one several times."""
    start = origin(run, run.extent)
    again = scheme_rows([RECOMMENDED] * AGAIN, run.extent)
    return start | {"rows": scheme_rows(SCHEMES, run.extent), "again": again}


def peers(run: BenchmarkRun) -> dict[str, Any]:
    """Run PySPH's schemes and the recommended one for as long."""
    duration_s = min(run.extent, PEERS_S)
    start = origin(run, duration_s)
    own = scheme_rows([RECOMMENDED], duration_s)[0]
    return start | {"own": own, "rows": peer_rows(duration_s)}


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={
        "schemes": schemes,
        "solvers": lambda run: origin(run, run.extent) | {"rows": solver_rows()},
        "large": lambda run: origin(run, run.extent) | {"row": large_row()},
        "peers": peers,
    },
    pages={"metal_flow.md": page},
    extent=LONG_S,
    quick=SHORT_S,
)

if __name__ == "__main__":
    BENCHMARK.command()
