"""How a study's jobs are submitted: their queue, their wall time, and the jobs they wait for."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping, Sequence
from typing import Any

from sandmould.execution.cluster.queue import Job, cancel, jobs_of
from sandmould.execution.cluster.settings import (
    RESOURCES,
    WORD,
    Cluster,
    Demand,
    JobLimits,
    check_jobs,
    goes_to_slurm,
    limits,
    read_cluster,
)
from sandmould.runs.progress import duration_text
from sandmould.study.plan.batches import Batch, alone
from sandmould.study.plan.build_plan import Plan

_FRESH_S = 5.0
"""So long an answer of the queue is good."""


class Submission:
    """Jobs of one start of a study, on a cluster or on this machine."""

    def __init__(self, plan: Plan, cluster: Cluster | None) -> None:
        """Ask the cluster nothing yet.

        ``cluster``: None where jobs are of this machine.
        """
        self._plan = plan
        self._cluster = cluster or Cluster()
        self._limits = JobLimits()
        self._earlier: list[Job] = []
        self._asked_s = -math.inf
        self.said: list[str] = []
        """What a person should know before it begins."""

    def cores(self, stated: int) -> int:
        """Cores that a job of several runs should have: as stated, where all nodes have them.

        Raises
        ------
        BadInputError
            Where Slurm does not answer, or a partition is none of its.
        """
        self._limits = limits(self._cluster)
        return int(min(stated, self._limits.cores))

    def ask(self, batches: Sequence[Batch]) -> None:
        """Ask Slurm whether it takes the jobs and what an earlier start has left in its queue.

        Raises
        ------
        BadInputError
            Where it would take no job.
        """
        every = (*self._plan.fills, *self._plan.runs)
        names = [run.run for run in every]
        single = set(alone(every, batches))
        jobs = [*batches, *(Batch(run.run, (run,)) for run in every if run.run in single)]
        planned = max((self._planned_min(job) for job in jobs), default=0)
        demands = [self._demand(job) for job in jobs]
        check_jobs(self._cluster, self.runtime_min(planned), demands)
        longest_min, why, _ = self._limits
        if planned > longest_min:
            number = math.ceil(planned / longest_min)
            self.said.append(
                f"A job asks at most {duration_text(60 * longest_min)}, {why}. The longest "
                f"job is planned with {duration_text(60 * planned)}. It may take {number} jobs; "
                "each goes on from the last checkpoint."
            )
        jobs_there = jobs_of(names)
        cancel([job for job in jobs_there if job.waits_for_ever])
        self._earlier = [job for job in jobs_there if job.lives and not job.waits_for_ever]
        if self._earlier:
            numbers = ", ".join(job.number for job in self._earlier)
            self.said.append(
                f"Jobs of an earlier start go on: {numbers}. New jobs for their runs begin after "
                "them."
            )

    def _planned_min(self, job: Batch) -> int:
        names = [run.run for run in job.runs]
        return self._plan.runtime_min(*names, side_by_side=job.side_by_side)

    def _demand(self, job: Batch) -> Demand:
        ranks = self._plan.ranks(job.name)
        cores = self._plan.threads(job.name) * job.side_by_side
        memory_mb = max(self._plan.memory_mb(run.run) for run in job.runs) * job.side_by_side
        return Demand(ranks, cores // ranks, memory_mb)

    def runtime_min(self, planned_min: int) -> int:
        """Wall time to ask for: as planned, unless that is more than is allowed.

        It is the same each time that a job is tried, since a run goes on from its checkpoint.
        """
        longest_min = self._limits.longest_min
        return planned_min if planned_min <= longest_min else max(1, int(longest_min))

    def resources(self) -> Mapping[str, object]:
        """Resources of every job; those that are functions take a job's wildcards."""
        stated: dict[str, object] = dict(self._cluster.resources())
        if self._cluster.options or self._earlier:
            stated["slurm_extra"] = lambda wildcards: self.options(str(wildcards[0]))
        return stated

    def options(self, run: str) -> str:
        """Other options of ``sbatch`` for the job of a run, or of several by the first's name."""
        if self._earlier and time.monotonic() - self._asked_s > _FRESH_S:
            jobs = jobs_of({job.run for job in self._earlier})
            there = {job.number for job in jobs if job.lives}
            self._earlier = [job for job in self._earlier if job.number in there]
            self._asked_s = time.monotonic()
        before = ":".join(job.number for job in self._earlier if job.run == run)
        wait = [f"--dependency=afterany:{before}"] if before else []
        return " ".join([*(self._cluster.options or "").split(), *wait])


def open_submission(plan: Plan, arguments: Sequence[str], stated: Mapping[str, Any]) -> Submission:
    """How the jobs of a start go to where its options say.

    ``arguments``: Snakemake's command line; ``stated``: its default resources, which hold where
    ``cluster.yaml`` says nothing.

    Raises
    ------
    BadInputError
        Where ``cluster.yaml`` is wrong.
    """
    if not goes_to_slurm(arguments):
        return Submission(plan, None)
    cluster = read_cluster()
    given = {
        name: word
        for name, resource in RESOURCES.items()
        if getattr(cluster, name) is None and (word := _word(stated.get(resource)))
    }
    return Submission(plan, cluster.model_copy(update=given))


def _word(resource: Any) -> str:
    """A default resource as it was stated; empty for an expression, which Snakemake works out."""
    text = str(getattr(resource, "raw", None) or "").strip("'\"")
    return text if re.match(WORD, text) else ""
