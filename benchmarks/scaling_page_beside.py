"""The parts of docs/scaling.md on the modelled cluster and on other tools."""

from __future__ import annotations

import math
from typing import Any

from benchmarks.scaling_model import Assumed, Measured, drain
from benchmarks.tables import number, table

SWEEPS = ((1_000, 60), (10_000, 10), (10_000, 60), (10_000, 600))
SETTINGS = (
    ("a job a run", 0.0, 1),
    ("the profile as it comes", 300.0, 1),
    ("jobs of whole nodes", 300.0, 32),
    ("jobs of whole nodes, half an hour", 1800.0, 32),
)
FAMILIAR = {
    "sandmould": (
        "the run's outcome says why; the others end; the report is written and the last rule fails",
        "the same command",
    ),
    "Snakemake with Paramspace": (
        "with `--keep-going` the others end; no table; the reason is in what the job printed",
        "`--unlock`, then `--rerun-incomplete`",
    ),
    "signac with signac-flow": (
        "the first that fails ends all; the runs' folders tell what is done",
        "the same command",
    ),
    "yade-batch": (
        "the others end; a line with the exit status and a log a run; no table by itself",
        "it runs all again; lines can be chosen by hand",
    ),
}
GENERAL = "Snakemake with Paramspace", "signac with signac-flow"
"""Tools that run any job."""


def _time(value_s: float) -> str:
    if value_s < 5400:
        return f"{value_s / 60:.0f} min"
    return f"{value_s / 3600:.1f} h"


def cluster(found: dict[str, Any]) -> dict[str, str]:
    """Write the modelled cluster."""
    costs, on = Measured.of(found), Assumed()
    lines = []
    for runs, run_s in SWEEPS:
        for name, batch_s, cores in SETTINGS:
            one = drain(runs, run_s, batch_s, cores, costs, on)
            ideal_s = runs * run_s / (on.nodes * on.cores)
            lines.append([
                number(runs), f"{run_s} s", name, number(one.jobs), _time(one.wall_s),
                f"{max(ideal_s, run_s) / 60:.1f} min", f"{one.efficiency:.0%}",
                f"{one.most_lost} ({one.lost[one.most_lost]:.0%})",
            ])  # fmt: skip
    head = ["runs", "engine loop", "jobs are", "jobs", "wall time", "least possible",
            "of all cores in loops", "most of the rest goes to"]  # fmt: skip
    given = (
        f"Taken for granted: {on.nodes} nodes of {on.cores} such cores that are free at once; "
        f"`jobs: {on.jobs}`; {on.submit_s:g} s for a submission, {on.notice_s:g} s until an ended "
        "job is noticed; runs of one core and equal length; no queue of others, no slow disk. A "
        f"measured Slurm of one node, busy, took 4 to 5 s a job; here a job starts in "
        f"{2 * costs.job_start_s + costs.imports_s:.1f} s of a core and "
        f"{2e3 * costs.job_start_s_per_run:.1f} ms more for each run of the study.\n"
    )
    many, most = max(found["rows"], key=int), found["rows"][max(found["rows"], key=int)]
    whole = drain(10_000, 10, 300.0, on.cores, costs, on)
    executed = max((n for n, row in found["rows"].items() if "files" in row), key=int)
    files = found["rows"][executed]["files"]["files"]
    rate = 10_000 / whole.wall_s
    return {
        "given": given,
        "cluster": table(head, lines),
        "rate": f"{rate:.0f}",
        "files_of_a_run": f"{files:.0f}",
        "files_per_s": number(round(rate * files)),
        "memory": f"{most['graph_alone']['peak_memory_bytes'] / 1e9:.1f} GB at "
        f"{number(int(many))} runs",
    }


def beside(found: dict[str, Any]) -> dict[str, str]:
    """Write the comparison with other tools."""
    peers = found["peers"]
    runs, job = peers["runs"], peers["job_cpu_s"]
    lines = []
    for name, row in peers["tools"].items():
        failing, killed, whole = row["failing"], row["killed"], row["whole"]
        fails, resumes = FAMILIAR[name]
        missing = runs - killed["then_done"]
        lines.append([
            name, str(row["lines"]), f"{whole['cpu_s']:.2f}", f"{whole['wall_s']:.2f}",
            f"{failing['others_done']} of {runs} done, exit status {failing['status']}: {fails}",
            f"{failing['redone']} redone, {failing['then_done']} done",
            f"{killed['redone']} of {killed['done_at_kill']} finished runs redone, "
            f"{missing} missing",
            resumes,
        ])  # fmt: skip
    head = ["", "lines", "s of a core a run", "wall s a run",
            f"when {100 * 5 / runs:.0f} % of the runs fail",
            "after mending", "after kill -9 of all its processes", "to go on"]  # fmt: skip
    alone = f"The job alone takes {job['plain']:.2f} s of a core"
    if "yade" in job:
        alone += f", {job['yade']:.2f} s with the start of Yade"
    told = "" if "yade-batch" in peers["tools"] else (
        "Yade was not installed: from its documentation, not measured, a failed simulation leaves "
        "the others alone, and a batch that was killed is run again whole or by chosen lines.\n"
    )  # fmt: skip
    ran = f"{alone}. {number(runs)} runs on {peers['cores']} cores.\n{told}"
    others = [row["whole"]["cpu_s"] for name, row in peers["tools"].items() if name in GENERAL]
    return {
        "beside": table(head, lines), "job": ran,
        "others_s": f"{max(others, default=math.nan):.2f}",
    }  # fmt: skip
