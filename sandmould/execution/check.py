"""The last word on a study: it fails loudly when a run failed."""

from __future__ import annotations

from pathlib import Path

from sandmould.runs.columns import DETAIL, OUTCOME, RUN, finished
from sandmould.study.collect import read_summary


def failed_runs(study_folder: Path) -> None:
    """Fail loudly when a run of the study failed.

    Raises
    ------
    SystemExit
        Naming each run that did not finish, with its outcome and what was said of it.
    """
    summary = read_summary(study_folder)
    failed = summary[~finished(summary)].to_dict("records")
    if failed:
        lines = [f"  {row[RUN]}: {row[OUTCOME]}. {row[DETAIL]}".rstrip() for row in failed]
        again = "A failed run is computed once more by: sandmould again RUN"
        said = "\n".join([f"{len(failed)} of {len(summary)} runs did not finish:", *lines, again])
        raise SystemExit(said)
