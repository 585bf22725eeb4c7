"""What keeps a study from calibrating."""

from __future__ import annotations

from collections.abc import Iterator

from sandmould.bad_input import Problem
from sandmould.definition.sweep import Range, Sweep
from sandmould.runs.formatting import is_number
from sandmould.statistics.calibration.config import Calibration

OF_MATERIAL = ("sand.", "contact.", "background_damping.")
"""Beginnings of the keys that a material states."""


def problems(calibration: Calibration, sweep: Sweep) -> Iterator[Problem]:
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
