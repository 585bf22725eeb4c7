"""The page on metal flow says what its numbers say."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks.mps.page import page
from benchmarks.mps.peers import measured
from benchmarks.mps.solvers import poisson_of, rows_here
from sandmould.casting.mps.scene import open_tank
from sandmould.casting.mps.scheme import Scheme


def row(scheme: str, relaxations: int, cost: float, noise: float, **more: Any) -> dict[str, Any]:
    return {
        "scheme": scheme, "verdict": "excellent", "stopped": "", "relaxations": relaxations,
        "source": "density", "cpu_s_per_simulated_s": cost, "pressure_share": 0.4,
        "neighbours_share": 0.3, "iterations_per_relaxation": 4.0, "mean_pressure_over_ideal": 0.95,
        "pressure_noise_pa": noise, "mean_speed_m_s": 0.01, "largest_speed_m_s": 0.2,
    } | more  # fmt: skip


def test_solvers_solve_the_system_of_a_flow() -> None:
    flow = open_tank(Scheme(), columns=8, rows=10)
    flow.advance(2e-3)
    poisson = poisson_of(flow)
    rows = {row["solver"]: row for row in rows_here(poisson)}
    assert {row["unknowns"] for row in rows.values()} == {len(poisson.right)}
    # its tolerance is in the norm of its preconditioner
    assert 1e-9 < rows["SciPy cg, overrelaxed"]["residual_fraction"] < 10 * poisson.tolerance
    assert 1e-9 < rows["SciPy cg"]["residual_fraction"] <= poisson.tolerance
    assert rows["SciPy spsolve"]["residual_fraction"] < 1e-12
    assert 0 < rows["SciPy cg, overrelaxed"]["iterations"] < rows["SciPy cg"]["iterations"]


def test_a_page_is_written_with_a_peer_that_failed() -> None:
    origin = {"machine": {"processor": "a core"}, "commit": "abc", "solver": "def",
              "duration_s": 0.3}  # fmt: skip
    large = {"metal": 100_000, "particles": 170_000, "relaxations": 5, "cpu_s_per_step": 3.0,
             "pressure_share": 0.5, "iterations_per_step": 40.0,
             "peak_memory_bytes": 1_000_000_000}  # fmt: skip
    peer = measured(
        {"version": "1", "cpu_s": 8.0, "time_s": [0.1, 0.2, 0.4],
         "pressure_pa": [0.0, 1615.0, 1815.0], "mean_speed_m_s": [1.0, 0.1, 0.3]}, 0.3
    )  # fmt: skip
    assert peer["cpu_s_per_simulated_s"] == pytest.approx(20.0)
    assert peer["mean_pressure_over_ideal"] == pytest.approx(1.0)
    assert peer["pressure_noise_pa"] == pytest.approx(100.0)
    assert peer["mean_speed_m_s"] == pytest.approx(0.2)
    results = {
        "schemes": origin | {
            "rows": [row("MR10-0.5", 10, 4.0, 20.0), row("MR1", 1, 3.0, 50.0)],
            "again": [row("MR10-0.5", 10, 5.0, 20.0), row("MR10-0.5", 10, 3.0, 20.0)],
        },
        "solvers": origin | {"rows": [
            {"solver": "SciPy cg, overrelaxed", "unknowns": 1000, "iterations": 18,
             "residual_fraction": 2e-3, "cpu_s": 8e-4},
            {"solver": "SciPy spsolve", "unknowns": 1000, "iterations": 0,
             "residual_fraction": 1e-15, "cpu_s": 0.01},
        ]},
        "large": origin | {"row": large},
        "peers": origin | {"own": row("MR10-0.5", 10, 4.5, 21.0),
                           "rows": [peer | {"scheme": "PySPH iisph"},
                                    {"scheme": "PySPH sisph", "stopped": "no compiler"}]},
    }  # fmt: skip
    text = page(results)
    assert "cost 0.9, 1.2, 1.5 s of processor time in 3 runs" in text
    assert "takes 40 % of a step and finding neighbours 30 %" in text
    assert "100 000 particles of metal and 70 000 of the mould" in text
    assert "| 1 000 | SciPy cg, overrelaxed | 18 | 0.002 | 0.8 |" in text
    assert "| SciPy spsolve | - |" in text
    assert "| MR10-0.5 | this | 4.50 | 21.0 |" in text
    assert "PySPH sisph gave no result: no compiler" in text
