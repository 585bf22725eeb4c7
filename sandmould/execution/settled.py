"""Whether a study is as Snakemake left it when it was whole: then nothing is left to do.

To start Snakemake takes longer than all else of a command that has nothing to compute. So what it
looks at is noted when it has ended well, and it is asked again once any of that has changed.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from sandmould import SHIPPED
from sandmould.definition.run import LAST_MEASURED
from sandmould.digest import digest
from sandmould.plain_file import UNREADABLE, read_plain
from sandmould.runs.claim import CLAIM_FILE
from sandmould.runs.files import write_text
from sandmould.runs.manifest import MANIFEST_FILE, OUTCOME_FILE
from sandmould.runs.products import SPENT_FILE
from sandmould.study.plan.announcement import write_files
from sandmould.study.plan.build_plan import Plan
from sandmould.study.plan.plan_files import SUMMARY

_FILE = "settled.txt"
_NOT_LOOKED_AT = ("logs", "lock", CLAIM_FILE, SPENT_FILE, _FILE)
_OF_RUN = ("deck.in", OUTCOME_FILE, MANIFEST_FILE, "series.tsv", LAST_MEASURED)


def is_settled(plan: Plan, results: Path) -> bool:
    """Whether no run lacks anything, and all files are those of the last start that ended well.

    The plan is written to disk where that may be so.
    """
    try:
        noted = read_plain(results / plan.study.name / _FILE)
    except UNREADABLE:
        return False
    if plan.lacks(results):
        return False
    write_files(plan, results)
    return noted == _state(plan, results)


def note_settled(plan: Plan, results: Path) -> None:
    """Note that nothing is left to do."""
    with contextlib.suppress(OSError):  # without it Snakemake is asked once more
        write_text(results / plan.study.name / _FILE, _state(plan, results))


def _state(plan: Plan, results: Path) -> str:
    """Hash of names, sizes and times of all that Snakemake looks at."""
    states = []
    for path in _looked_at(plan, results):
        if path.exists():
            stat = path.stat()
            states.append(f"{path} {stat.st_size} {stat.st_mtime_ns}\n")
    return digest(*states)


def _looked_at(plan: Plan, results: Path) -> Iterator[Path]:
    folder = results / plan.study.name
    yield from (path for path in sorted(folder.iterdir()) if path.name not in _NOT_LOOKED_AT)
    yield from sorted((folder / "batches").glob("*"))
    yield from (folder / run.place / name for run in plan.runs for name in _OF_RUN)
    yield from (results / name / SUMMARY for name in plan.study.study.calibration.also)
    for rules in ("Snakefile", "workflow/rules/*", "templates/report/*"):
        yield from sorted(SHIPPED.glob(rules))
