"""The last word on a study: it fails loudly when a run failed."""

from __future__ import annotations

import csv
from pathlib import Path

from sandmould.runs.outcome import Outcome


def failed_runs(summary: Path) -> None:
    """Fail loudly when a run of the study failed.

    Parameters
    ----------
    summary : Path
        ``summary.tsv`` of the study.

    Raises
    ------
    SystemExit
        Naming each run that did not finish, with its outcome and what was said of it.
    """
    with summary.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    failed = [row for row in rows if row["outcome"] != Outcome.FINISHED.label]
    if failed:
        lines = [f"  {row['run']}: {row['outcome']}. {row['detail']}".rstrip() for row in failed]
        again = "A failed run is computed once more by: sandmould again RUN"
        said = "\n".join([f"{len(failed)} of {len(rows)} runs did not finish:", *lines, again])
        raise SystemExit(said)
