"""The calibration of a study from its folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from sandmould.definition.study import Study
from sandmould.runs.columns import RUN
from sandmould.statistics.agreement import sweep_part
from sandmould.statistics.calibration.sands import Calibrated, calibrate, write_materials
from sandmould.study.collect import read_study, read_summary, swept_keys
from sandmould.study.plan.plan_files import read_run


def read_calibrated(
    study_folder: Path, study: Study, summary: pd.DataFrame, keys: Sequence[str]
) -> Calibrated | None:
    """Calibrate what a study asks for; None where it asks for nothing.

    Raises
    ------
    OSError
        When a study that ``calibration.also`` names has no results.
    """
    if not study.calibration.sands:
        return None
    others = {name: read_summary(study_folder.parent / name) for name in study.calibration.also}
    return calibrate(study.calibration, summary, (keys[0], keys[1]), others)


def write_calibration(study_folder: Path, materials: Path) -> None:
    """Write the material files of a study's sands.

    Raises
    ------
    SystemExit
        At the end, with a sentence for each sand that was not found.
    """
    study = read_study(study_folder)
    summary = sweep_part(read_summary(study_folder))
    result = read_calibrated(study_folder, study, summary, swept_keys(summary))
    if result is None:
        return
    run = str(summary[RUN].iloc[0])
    scenario = read_run(study_folder / "runs" / run / "scenario.yaml").scenario
    write_materials(result, scenario, study_folder.name, materials)
    problems = [f"{found.sand.name}: {found.problem}" for found in result.sands if found.problem]
    if problems:
        raise SystemExit("\n".join(problems))
