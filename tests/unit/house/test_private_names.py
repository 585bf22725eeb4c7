"""Names of other libraries that are not meant for others: pyproject bounds these above."""

from __future__ import annotations

import inspect

from snakemake.scheduling.job_scheduler import JobScheduler

from sandmould import ROOT


def test_snakemake_asks_the_limit_that_the_snakefile_takes_away() -> None:
    """Without it half a core is busy after 150 runs."""
    assert "workflow.scheduler.job_rate_limiter = None" in (ROOT / "Snakefile").read_text()
    asked = inspect.getsource(JobScheduler)
    assert "if self.job_rate_limiter is None:" in asked
    assert "if self.job_rate_limiter is not None:" in asked
