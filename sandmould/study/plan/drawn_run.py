"""Which run of a study is drawn before anything is computed."""

from __future__ import annotations

from pathlib import Path

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.run import Run
from sandmould.runs.formatting import listed
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import OpenStudy, open_study


def drawn_run(path: Path, name: str | None = None) -> tuple[OpenStudy, Run]:
    """Open a study and choose a run of sand or of a casting; engine and measures are not asked for.

    Raises
    ------
    BadInputError
        When the study is bad, has no scene, or no run of the name.
    """
    study = open_study(path)
    if not isinstance(study.study.scenario, Scenario | Solidification):
        valid = f"a study of sand or solidification: {study.study.kind} has no scene to draw"
        raise BadInputError([Problem("STUDY", study.name, valid)])
    runs = {run.run: run for run in expand(study, measured=False)}
    if name is None:
        return study, next(iter(runs.values()))
    if name not in runs:
        raise BadInputError(
            [Problem("--run", name, f"a run of {study.name}: {listed(list(runs))}")]
        )
    return study, runs[name]
