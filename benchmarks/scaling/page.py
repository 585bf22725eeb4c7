"""The page docs/developers/workflow_cost.md, written from what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.frame import render

WHEN_FAILING = {
    "sandmould": "the outcome says why; the others end; the report is written",
    "Snakemake with Paramspace": "with `--keep-going` the others end; no table",
    "signac with signac-flow": "the first that fails ends all",
    "yade-batch": "the others end; a log a run; no table by itself",
}
TO_GO_ON = {
    "sandmould": "the same command",
    "Snakemake with Paramspace": "`--unlock`, then `--rerun-incomplete`",
    "signac with signac-flow": "the same command",
    "yade-batch": "it runs all again; lines can be chosen by hand",
}
Rows = dict[int, dict[str, Any]]


def page(results: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    results : dict
        What ``benchmarks.scaling`` measured.
    """
    rows: Rows = {int(runs): results["rows"][runs] for runs in sorted(results["rows"], key=int)}
    parts = _run_parts(results["parts"])
    return render(Path(__file__).with_name("page.md.j2"), {
        **results,
        "rows": rows,
        "largest": rows[max(rows)],
        "files": rows[max(runs for runs, row in rows.items() if "files" in row)]["files"],
        "run_parts": parts,
        "parts_s": sum(parts.values()),
        "overhead_s": {name: _overhead_s(rows, name) for name in ("run_alone", "run_shared")},
        "graph_job": {of: _of_a_job(rows, of) for of in ("cpu_s", "peak_memory_bytes")},
        "when_failing": WHEN_FAILING,
        "to_go_on": TO_GO_ON,
    })  # fmt: skip


def _run_parts(parts: dict[str, float]) -> dict[str, float]:
    """What a run with three jobs takes, s of a core."""
    python_s, imports_s = parts["start of Python"], parts["imports of a run"]
    return {
        "starts of Python: three scripts and the run's own process": 4 * python_s,
        "Snakemake's preamble of three scripts": 3 * parts["preamble of a script"],
        "imports of the script that renders": imports_s,
        "imports of the run's own process": imports_s,
        "imports of the script that measures": parts["imports of measuring"],
        "the run's process beside imports: kernels, the loop, records, provenance":
            parts["process of a run"] - python_s - imports_s,
        "rendering": parts["rendering"],
        "measuring": parts["measuring"],
    }  # fmt: skip


def _overhead_s(rows: Rows, name: str) -> float:
    """Seconds of a core that a run of the stand-in takes, without the start of Snakemake."""
    runs = max(runs for runs, row in rows.items() if name in row)
    return float((rows[runs][name]["cpu_s"] - rows[runs]["nothing_to_do"]["cpu_s"]) / runs)


def _of_a_job(rows: Rows, of: str) -> float:
    """What each job adds to the graph, between the smallest and the largest study."""
    fewest, most = min(rows), max(rows)
    added = rows[most]["graph_alone"][of] - rows[fewest]["graph_alone"][of]
    return float(added / (3 * (most - fewest)))
