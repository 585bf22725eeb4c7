"""The Poisson equation of the same two moments as we solve it, and by SciPy and PyAMG alone."""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, eye_array, save_npz
from scipy.sparse.linalg import cg, spsolve

from benchmarks.mps.peers import PYTHON
from benchmarks.mps.runs import LARGE_M
from sandmould.casting.mps.flow import Flow
from sandmould.casting.mps.pressure import System, assemble, solve
from sandmould.casting.mps.scene import open_tank
from sandmould.casting.mps.scheme import Scheme
from sandmould.casting.mps.shoulder import open_shoulder

Array = NDArray[np.float64]
PROGRAM = Path(__file__).parents[1] / "peers" / "run_pyamg.py"
MOST_DIRECT = 20_000
"""Unknowns up to which the direct solver is tried: it fills its factors in space."""
TIMES = 5


class Poisson(NamedTuple):
    """One system; its diagonal is 1, so that plain conjugate gradients are Jacobi's."""

    own: System
    matrix: csr_array
    right: Array
    tolerance: float


def poisson_of(flow: Flow) -> Poisson:
    """The system of the first relaxation, had the particles come to where they are."""
    near, scheme = flow._neighbours(), flow.scheme
    compression = near.density / flow.kernel.lattice_density - 1.0
    surface = compression < scheme.surface - 1.0
    rows = assemble(flow.kernel, near, flow.particles.kind, surface)
    own, m = rows.system, len(rows.number)
    beside = csr_array((own.value, own.column, own.start), shape=(m, m))
    return Poisson(
        own, csr_array(eye_array(m) + beside), rows.scale * compression[rows.number],
        scheme.tolerance,
    )  # fmt: skip


def solver_rows() -> list[dict[str, Any]]:
    """Solve for a tank that has stood for 0.1 s, and for a large casting after two steps."""
    tank = open_tank(Scheme())
    tank.advance(0.1)
    casting = open_shoulder(LARGE_M, Scheme(), full=True)
    for _ in range(2):
        casting.step()
    rows = []
    for flow in (tank, casting):
        poisson = poisson_of(flow)
        rows += [*rows_here(poisson), _pyamg(poisson)]
    print(rows, flush=True)
    return rows


def rows_here(poisson: Poisson) -> list[dict[str, Any]]:
    """One system from zero by all solvers of this environment."""
    matrix, right, tolerance = poisson.matrix, poisson.right, poisson.tolerance
    zero = np.zeros_like(right)

    def by_scipy() -> tuple[Array, int]:
        seen: list[None] = []
        pressure, _ = cg(matrix, right, rtol=tolerance, callback=lambda _: seen.append(None))
        return pressure, len(seen)

    ways: dict[str, Callable[[], tuple[Array, int]]] = {
        "SciPy cg, overrelaxed": lambda: solve(poisson.own, right, zero, tolerance)[:2],
        "SciPy cg": by_scipy,
    }
    if len(right) <= MOST_DIRECT:
        ways["SciPy spsolve"] = lambda: (spsolve(matrix.tocsc(), right), 0)
    return [_timed(name, way, poisson) for name, way in ways.items()]


def _timed(name: str, way: Callable[[], tuple[Array, int]], poisson: Poisson) -> dict[str, Any]:
    way()  # compiles
    spent_s = []
    for _ in range(TIMES):
        begin = time.process_time()
        pressure, iterations = way()
        spent_s.append(time.process_time() - begin)
    left = np.linalg.norm(poisson.right - poisson.matrix @ pressure) / np.linalg.norm(poisson.right)
    return {
        "solver": name, "unknowns": len(poisson.right), "iterations": iterations,
        "residual_fraction": float(left), "cpu_s": float(np.median(spent_s)),
    }  # fmt: skip


def _pyamg(poisson: Poisson) -> dict[str, Any]:
    """Smoothed aggregation before conjugate gradients, its setup counted: each system is new."""
    with tempfile.TemporaryDirectory() as name:
        save_npz(Path(name) / "matrix.npz", poisson.matrix)
        np.save(Path(name) / "right.npy", poisson.right)
        command = [str(PYTHON), str(PROGRAM), name, str(poisson.tolerance), str(TIMES)]
        ran = subprocess.run(command, capture_output=True, text=True, check=True)
    answer: dict[str, Any] = json.loads(ran.stdout)
    return {"solver": f"PyAMG {answer.pop('version')}", "unknowns": len(poisson.right)} | answer
