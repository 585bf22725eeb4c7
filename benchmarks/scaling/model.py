"""How long a cluster takes for a sweep, computed from what was measured on one machine.

Nothing here is measured on a cluster. What is taken for granted is in :class:`Assumed`.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sandmould.study.plan.batches import START_S


@dataclass(frozen=True)
class Assumed:
    """The cluster, and what could not be measured here."""

    nodes: int = 100
    cores: int = 32
    jobs: int = 100
    """``jobs`` of profiles/slurm: those that wait or run at once."""
    submit_s: float = 0.2
    """One ``sbatch`` by Snakemake, which submits one after the other."""
    notice_s: float = 20.0
    """From the end of a job until Snakemake knows: it asks every ten seconds and more."""


@dataclass(frozen=True)
class WorkflowCosts:
    """Seconds of one core, from scaling.json."""

    plan_s: float
    """A run, to be validated, planned and written."""
    graph_s: float
    """A job of Snakemake's graph."""
    snakemake_s: float
    """Its start."""
    job_start_s: float
    """A started job, before its first import, in a study of no size."""
    job_start_s_per_run: float
    """What each run of the study adds to that: every job plans the whole study again."""
    imports_s: float
    """Of a shared job."""
    run_s: float
    """A run beside its engine's loop, in a job that is there already."""
    tables_s: float
    """A run, in collection and report."""

    @classmethod
    def of(cls, results: Mapping[str, Any]) -> WorkflowCosts:
        """Slopes between the smallest and the largest study that was measured."""
        small, large = (min(results["rows"], key=int), max(results["rows"], key=int))
        smallest, largest = results["rows"][small], results["rows"][large]
        runs = int(large) - int(small)

        def slope(*names: str) -> float:
            return sum(_cpu_s(largest[n]) - _cpu_s(smallest[n]) for n in names) / runs

        plan_s = slope("validate_s", "batches_s", "write_s")
        # three jobs a run
        graph_s = (slope("graph_alone") - slope("validate_s", "write_again_s")) / 3
        start = slope("job_start")
        parts = results["parts"]
        return cls(
            plan_s, graph_s, _cpu_s(smallest["graph_shared"]), _cpu_s(smallest["job_start"]), start,
            parts["start of Python"] + parts["imports of a shared job"],
            parts["process of a run"] + parts["rendering"] + parts["measuring"],
            slope("collect", "report"),
        )  # fmt: skip


def _cpu_s(value: float | Mapping[str, float]) -> float:
    return value["cpu_s"] if isinstance(value, Mapping) else value


@dataclass(frozen=True)
class Drain:
    """A sweep on the cluster."""

    jobs: int
    wall_s: float
    efficiency: float
    """Engine loops over all cores for all that time."""
    lost: Mapping[str, float]
    """Shares of the cores' time that went elsewhere."""

    @property
    def most_lost(self) -> str:
        """Where most of the rest went."""
        return max(self.lost, key=lambda name: self.lost[name])


def drain(
    runs: int,
    engine_s: float,
    batch_wall_s: float,
    job_cores: int,
    costs: WorkflowCosts,
    on: Assumed,
) -> Drain:
    """Compute a sweep of equal runs of one core each.

    Parameters
    ----------
    runs : int
    engine_s : float, s
        The engine's loop of one run.
    batch_wall_s : float, s
        Of profiles/slurm; 0 gives every run a job.
    job_cores : int
        ``batch_cores`` of the same.
    costs : WorkflowCosts
    on : Assumed
    """
    share = math.ceil(batch_wall_s * job_cores / (START_S + engine_s)) if batch_wall_s else 1
    share = min(share, runs)
    job_cores = min(job_cores, share)
    jobs, each_run_s = math.ceil(runs / share), engine_s + costs.run_s
    # One Snakemake in the allocation and one in its step; the second begins when the first has.
    start_s = 2 * (costs.job_start_s + costs.job_start_s_per_run * runs) + costs.imports_s
    each_s = start_s + math.ceil(share / job_cores) * each_run_s
    before_s = costs.snakemake_s + runs * costs.plan_s + jobs * costs.graph_s
    after_s = runs * costs.tables_s
    slots = [0.0] * min(on.jobs, on.nodes * on.cores // job_cores, jobs)
    submitted, ended = 0.0, 0.0
    for _ in range(jobs):
        submitted = max(submitted + on.submit_s, heapq.heappop(slots))
        ended = max(ended, submitted + each_s + on.notice_s)
        heapq.heappush(slots, submitted + each_s + on.notice_s)
    wall_s = before_s + ended + after_s
    whole = wall_s * on.nodes * on.cores
    lost = {
        "plan, graph, tables and report, by one process": (before_s + after_s) / wall_s,
        "starts of jobs": jobs * start_s * job_cores / whole,
        "starts and measures of runs": runs * costs.run_s / whole,
    }
    efficiency = runs * engine_s / whole
    lost["cores without a job"] = 1 - efficiency - sum(lost.values())
    return Drain(jobs, wall_s, efficiency, lost)
