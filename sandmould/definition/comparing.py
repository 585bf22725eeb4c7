"""What keeps a study from comparing what it asks to compare, and from calibrating."""

from __future__ import annotations

from collections.abc import Iterator

from sandmould.bad_input import Problem
from sandmould.definition.study import CrossCheck, Study
from sandmould.definition.sweep import Range, Sweep, points
from sandmould.runs.formatting import is_number
from sandmould.statistics.config import FULL, Aim, Calibration, Equivalence, Objective

ENGINE = "engine.name"
OF_MATERIAL = ("sand.", "contact.", "background_damping.")
"""Beginnings of the keys that a material states."""


def problems(study: Study) -> list[Problem]:
    """List what is wrong with the comparisons of a study whose sweep has no problems."""
    misfits = [*_objective(study.objective), *_equivalence(study.equivalence, study.sweep)]
    if study.cross_check is not None:
        misfits += _cross_check(study.cross_check, study)
    compares = bool(study.equivalence.keys) or study.cross_check is not None
    if compares and not study.equivalence.margins:
        valid = "at least one measure with its margin, such as solid_fraction: 0.005"
        misfits.append(Problem("equivalence.margins", {}, valid))
    if study.objective.reported_best and len(study.sweep.swept) != 1:
        values = [best.value for best in study.objective.reported_best]
        valid = "absent unless one key is swept"
        misfits.append(Problem("objective.reported_best", values, valid))
    return misfits


def _objective(objective: Objective) -> Iterator[Problem]:
    """Every aim has a measure of its own, and those beside the first have a better side."""
    yield from _target(objective, "objective")
    told = [objective.measure]
    for i, aim in enumerate(objective.beside):
        key = f"objective.beside.{i}"
        if aim.measure in told:
            yield Problem(f"{key}.measure", aim.measure, "each measure once")
        if "neither" in (aim.better, objective.better):
            yield Problem(f"{key}.better", aim.better, "larger or smaller, for each measure")
        yield from _target(aim, key)
        told.append(aim.measure)


def _target(aim: Aim, key: str) -> Iterator[Problem]:
    """A target needs a better side, and lies on the scale of its measure."""
    target = aim.target
    if target is None:
        return
    valid = ""
    if aim.better == "neither":
        valid = f"absent, or null over an inherited one, where {key}.better is neither"
    elif target == FULL and not (aim.is_fill and aim.better == "larger"):
        valid = f"a value of {aim.measure}: {FULL} is for the fill of a tube or cavity"
    elif (
        isinstance(target, float) and aim.measure.endswith("_fraction") and not 0.0 < target <= 1.0
    ):
        valid = "above 0 and at most 1"
    if valid:
        yield Problem(f"{key}.target", target, valid)


def _equivalence(equivalence: Equivalence, sweep: Sweep) -> Iterator[Problem]:
    for name, keys in {"keys": equivalence.keys, "over": equivalence.over}.items():
        for i, key in enumerate(keys):
            if key not in sweep.swept:
                valid = f"a swept key: {', '.join(sweep.swept) or 'none is'}"
                yield Problem(f"equivalence.{name}.{i}", key, valid)
            elif key in keys[:i]:
                yield Problem(f"equivalence.{name}.{i}", key, "each key once")


def _cross_check(check: CrossCheck, study: Study) -> Iterator[Problem]:
    own = study.scenario.engine.name
    if ENGINE in study.sweep.swept:
        valid = f"absent where {ENGINE} is swept: equivalence.keys compares the engines"
        yield Problem("cross_check", check.model_dump(), valid)
        return
    if check.engine == own:
        valid = f"another engine than the study's own, {own}, or cross_check: null"
        yield Problem("cross_check.engine", check.engine, valid)
    if check.replicates is not None and check.replicates > study.replicates:
        valid = f"at most {study.replicates}, the study's own: runs are compared in pairs"
        yield Problem("cross_check.replicates", check.replicates, valid)
    if check.vibration_s is not None:
        yield from _vibration(check.vibration_s, study)
    swept = points(study.sweep, study.scenario)
    if check.at not in swept:
        yield Problem("cross_check.at", check.at, f"a point of the sweep, such as {swept[0]}")


def _vibration(vibration_s: float, study: Study) -> Iterator[Problem]:
    stages = study.scenario.vibrations
    if not stages:
        yield Problem("cross_check.vibration_s", vibration_s, "null without a stage of vibration")
    elif vibration_s > stages[-1].duration_s:
        valid = f"at most {stages[-1].duration_s:g} s, that of the last vibration"
        yield Problem("cross_check.vibration_s", vibration_s, valid)


def calibration_problems(calibration: Calibration, sweep: Sweep) -> Iterator[Problem]:
    """List what is wrong with a calibration whose sweep has no problems."""
    if not calibration.sands:
        return
    keys = sweep.swept
    if len(keys) != 2:
        yield Problem("sweep.keys", keys, "exactly two swept keys in a study that calibrates")
        return
    for key in keys:
        values = sweep.keys.get(key, ())
        stated = [p[key] for p in sweep.points] if sweep.design == "list" else values
        numeric = isinstance(stated, Range) or all(map(is_number, stated))
        if not (key.startswith(OF_MATERIAL) and numeric):
            valid = f"a number of the material: a key that begins with {' or '.join(OF_MATERIAL)}"
            yield Problem("sweep.keys", key, valid)
    names = [sand.name for sand in calibration.sands]
    for i, name in enumerate(names):
        if name in names[:i]:
            yield Problem(f"calibration.sands.{i}.name", name, "a name no other sand has")
    for i, sand in enumerate(calibration.sands):
        for key in sand.assumed:
            if key not in keys:
                valid = f"a swept key, {' or '.join(keys)}"
                yield Problem(f"calibration.sands.{i}.assumed", key, valid)
