"""The last words on a study: what went wrong outside its runs, its verdict and its report."""

from __future__ import annotations

import re
from pathlib import Path

from sandmould.study.plan.plan_files import REPORT_FILE, VERDICT_FILE

_TROUBLE = re.compile(r"\b(\w*Error|\w*Exception|error)\b|^sbatch|^srun|Killed|refused|denied")
LISTED_LINES = 6


def trouble(log: Path) -> list[str]:
    """Lines of Snakemake's log that say what went wrong, each once.

    Parameters
    ----------
    log : Path
    """
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines() if log.exists() else []
    words = [line.strip() for line in lines if line.strip()]
    found = list(dict.fromkeys(line for line in words if _TROUBLE.search(line)))
    return found[:LISTED_LINES] or words[-LISTED_LINES:]


def last_line(folder: Path) -> str:
    """The verdict's sentence and where the report is; empty without a report.

    Parameters
    ----------
    folder : Path
        ``results/<study>``.
    """
    report, verdict = folder / REPORT_FILE, folder / VERDICT_FILE
    if not report.exists():
        return ""
    said = verdict.read_text(encoding="utf-8").strip() if verdict.exists() else ""
    return f"{said} The report: {report}".strip()
