"""Names of measures that a study asks for, against those that its scenes will have."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sandmould.bad_input import Problem
from sandmould.definition import own_measures
from sandmould.definition.study import Study
from sandmould.kinds.kind import AnyScenario, Kind
from sandmould.runs.formatting import listed
from sandmould.runs.measures import Measure, measures_of
from sandmould.statistics.config import Objective

NEAREST = 3


def measured_in(study: Study, kind: Kind[Any], scenario: AnyScenario) -> list[Measure]:
    """Measures that the runs of a scenario will have, those of the user's own last."""
    own = [Measure(name, f"Own: {formula}.") for name, formula in study.own_measures.items()]
    return [*measures_of(kind.planning.measures, scenario), *own]


def problems(study: Study, kind: Kind[Any], scenario: AnyScenario) -> Iterator[Problem]:
    """List the measures asked for that a scene of a study will not have."""
    has = [measure.name for measure in measured_in(study, kind, scenario) if measure.is_number]
    yield from own_measures.problems_in_scene(
        study.own_measures, has[: len(has) - len(study.own_measures)]
    )
    # A deck that nothing is read from is run for the files that it writes.
    nothing_asked = not has and study.objective == Objective()
    for key, name in _asked(study):
        if name not in has and not nothing_asked:
            is_stated = key != "objective.measure" or "measure" in study.objective.model_fields_set
            said = "" if is_stated else _to_state(has)
            yield Problem(key, name, _valid(name, has, _comes_with(name, kind)), sentence=said)


def problems_elsewhere(study: Study, results: Path) -> Iterator[Problem]:
    """List what keeps a study from calibrating with the results of others."""
    for i, name in enumerate(study.calibration.also):
        summary = results / name / "summary.tsv"
        if not summary.is_file():
            valid = f"a study with results: sandmould run {name} comes first"
            yield Problem(f"calibration.also.{i}", name, valid)
            continue
        with summary.open(encoding="utf-8", errors="replace") as file:
            has = file.readline().rstrip("\n").split("\t")
        for j, sand in enumerate(study.calibration.sands):
            for target in sand.targets:
                column = target.removeprefix(f"{name}__")
                if column != target and column not in has:
                    near = difflib.get_close_matches(column, has, n=NEAREST, cutoff=0.5)
                    names = ", ".join(f"{name}__{n}" for n in near)
                    hint = f": nearest are {names}" if near else ""
                    valid = f"a column of the results of {name}{hint}"
                    yield Problem(f"calibration.sands.{j}.targets", target, valid)


def _asked(study: Study) -> Iterator[tuple[str, str]]:
    """Key and name of every measure that a study names of its own runs."""
    yield "objective.measure", study.objective.measure
    for i, aim in enumerate(study.objective.beside):
        yield f"objective.beside.{i}.measure", aim.measure
    for name in study.equivalence.margins:
        yield "equivalence.margins", name
    others = tuple(f"{name}__" for name in study.calibration.also)
    for i, sand in enumerate(study.calibration.sands):
        for name in sand.targets:
            if not name.startswith(others):
                yield f"calibration.sands.{i}.targets", name


def _to_state(has: list[str]) -> str:
    """Ask for an objective where none is stated."""
    if not has:
        return "an objective needs a measure, and this study has none"
    example = f"objective: {{measure: {has[0]}}}"
    return f"state an objective, such as {example}: this study measures {listed(has, most=8)}"


def _valid(name: str, has: list[str], comes: str) -> str:
    near = difflib.get_close_matches(name, has, n=NEAREST, cutoff=0.5)
    names = f"nearest are {', '.join(near)}" if len(near) > 1 else f"nearest is {''.join(near)}"
    if not near:
        names = f"such as {', '.join(has[:NEAREST])}" if has else "it has none"
    about = f" ({name}: {comes})" if comes else ""
    return f"a measure that this scene will have{about}: {names}; sandmould measures lists all"


def _comes_with(name: str, kind: Kind[Any]) -> str:
    """Scenes that have a measure of this name, in words; nothing where no scene has."""
    for group in kind.planning.measures:
        for measure in group.measures:
            if not measure.is_number and measure.name == name:
                return "words cannot be compared"
            pattern = re.sub(r"<\w+>", "[a-z][a-z0-9_]*", measure.name)
            if pattern != "[a-z][a-z0-9_]*" and re.fullmatch(pattern, name):
                return group.when
    return ""
