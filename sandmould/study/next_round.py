"""What comes after a round: decided from the tables of a study, and written down."""

from __future__ import annotations

from pathlib import Path

from sandmould.definition.study import Study
from sandmould.statistics.agreement import sweep_part
from sandmould.study.collect import read_summary, swept_keys
from sandmould.study.rounds.decide import decision_text, next_runs
from sandmould.study.rounds.round_log import RoundLog, read_rounds, write_rounds


def decide_next(study: Study, folder: Path) -> tuple[RoundLog, str]:
    """Add what comes next to the rounds of a study."""
    summary = sweep_part(read_summary(folder))
    log = next_runs(read_rounds(folder, study), study, summary, list(swept_keys(summary)))
    write_rounds(log, folder)
    return log, decision_text(log, study)
