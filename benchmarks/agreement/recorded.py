"""Committed studies and what they compared."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandmould import ROOT
from sandmould.runs.columns import REPLICATE
from sandmould.statistics.agreement import Compared, EngineSpeed, speeds
from sandmould.study.collect import compare_study, read_summary, swept_keys
from sandmould.study.plan.load_study import open_study
from sandmould.wording.agreement import agreement_sentences


@dataclass(frozen=True)
class Recorded:
    """A committed study and what it compared."""

    name: str
    title: str
    replicates: int
    """Those of the record; the study may ask for others by now."""
    record: dict[str, Any]
    keys: tuple[str, ...]
    """Keys whose values are compared."""
    compared: tuple[Compared, ...]
    speeds: tuple[EngineSpeed, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """Whether its settings agree."""
        return agreement_sentences(self.compared)


def read_recorded(folder: Path) -> Recorded:
    """Judge a committed study again, by the margins of its file.

    Raises
    ------
    OSError
        When the folder holds no whole record.
    """
    record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
    study = open_study(ROOT / record["study"]).study
    summary = read_summary(folder, words=["version"])
    return Recorded(
        folder.name,
        study.title,
        summary[REPLICATE].nunique(),
        record,
        study.equivalence.keys,
        compare_study(summary, swept_keys(summary), study),
        speeds(summary),
    )


def read_all(records: Path, names: Sequence[str]) -> list[Recorded]:
    """Read committed studies.

    Raises
    ------
    SystemExit
        Naming the studies that have no record yet.
    """
    missing = [name for name in names if not (records / name / "record.json").is_file()]
    if missing:
        raise SystemExit(
            f"no record of {', '.join(missing)} in {records}: compute and record them "
            "(make twins does for docs/engine_twins.md)"
        )
    return [read_recorded(records / name) for name in names]
