"""The last words on a study: what went wrong outside its runs, its verdict and its report."""

from __future__ import annotations

import errno
import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from sandmould.study.plan.plan_files import REPORT_FILE, VERDICT_FILE

_TROUBLE = re.compile(r"\b(\w*Error|\w*Exception|error)\b|^sbatch|^srun|Killed|refused|denied")
_REFUSALS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO, errno.EACCES)
_REFUSED = re.compile(
    rf"(?:(\S+): |\[Errno \d+\] )?({'|'.join(map(os.strerror, _REFUSALS))})(?:: '([^']+)')?"
)
_OF_JOB = re.compile(r"^JobError in file .*\n(.+)$(?s:.*?)^ *log: (\S+)", re.MULTILINE)
"""What one of our jobs said, and its log."""
_TRIAL_BYTES = 2**18
LISTED_LINES = 6


def trouble(folder: Path, log: Path) -> str:
    """Say why a study stopped: a file that was refused, a job of ours, else Snakemake's words."""
    text = log.read_text(encoding="utf-8", errors="replace") if log.exists() else ""
    refused = [(after or before, why) for before, why, after in _REFUSED.findall(text)]
    try:  # a full disk has no room for the log either
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            file.write(bytes(_TRIAL_BYTES))
    except OSError as error:
        refused.append((str(folder), str(error.strerror)))
    if refused:
        name, why = next((each for each in refused if each[0]), (folder, refused[0][1]))
        return (
            f"The study stopped, since {name} could not be written: {why}. What is computed stays: "
            "once that is mended, the same command goes on."
        )
    if of_jobs := dict.fromkeys(_OF_JOB.findall(text)):
        said = "\n".join(f"{Path(log).stem}: {why}. Its log: {log}" for why, log in of_jobs)
        return f"The study stopped:\n{said}"
    words = [line.strip() for line in text.splitlines() if line.strip()]
    found = list(dict.fromkeys(_headed(words)))
    told = "; ".join(found[:LISTED_LINES] or words[-LISTED_LINES:])
    stopped = f'The study stopped outside its runs. Snakemake told "{told}".'
    return f"{stopped} All that it said: {log}" if told else ""


def _headed(words: Sequence[str]) -> Iterator[str]:
    """Lines that tell of trouble; a head that ends with a colon has the line below it beside it."""
    for line, below in zip(words, [*words[1:], ""], strict=False):
        if _TROUBLE.search(line):
            goes_on = line.endswith(":") and not _TROUBLE.search(below)
            yield f"{line} {below}".strip() if goes_on else line


def last_line(folder: Path) -> str:
    """The verdict's sentence and where the report is; empty without a report."""
    report, verdict = folder / REPORT_FILE, folder / VERDICT_FILE
    if not report.exists():
        return ""
    said = verdict.read_text(encoding="utf-8").strip() if verdict.exists() else ""
    return f"{said} The report: {report}".strip()
