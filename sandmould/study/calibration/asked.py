"""What a study is asked to calibrate, and what keeps it from doing so."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from sandmould.scenario.bad_input import Problem
from sandmould.scenario.quantity import NAME, Section, quantity
from sandmould.study.sweep import Range, Sweep

OF_MATERIAL = ("sand.", "contact.", "background_damping.")
"""Beginnings of the keys that a material states."""


class Target(Section):
    """A value measured on the real sand, or assumed of it."""

    value: float = quantity(..., "The value.", unit="of the column or key", source="user")
    sd: float = quantity(
        ..., "Its standard deviation, of the mean of what was measured.",
        unit="of the column or key", source="user", gt=0,
    )  # fmt: skip


class Sand(Section):
    """One real sand: what was measured on it, and the material that is made of that."""

    name: str = quantity(..., "Name of the material that is written.", source="user", pattern=NAME)
    targets: dict[Annotated[str, Field(pattern=NAME)], Target] = Field(
        ..., min_length=1, description="Columns of summary.tsv and what was measured of each."
    )
    assumed: dict[str, Target] = Field(
        {},
        description="Swept keys and what is taken for granted of each, such as a rolling angle of "
        "10 degrees: where one measured value leaves a ridge, it picks a place on it.",
    )


class Calibration(Section):
    """Sands whose two swept keys are found from what was measured on them."""

    sands: tuple[Sand, ...] = Field((), description="The sands; none asks for no calibration.")
    also: tuple[Annotated[str, Field(pattern=NAME)], ...] = Field(
        (),
        description="Finished studies that sweep the same two keys over another scene; their "
        "columns get the study's name and two underscores before their own.",
    )


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
        given = [p[key] for p in sweep.points] if sweep.design == "list" else values
        numeric = isinstance(given, Range) or all(
            isinstance(v, int | float) and not isinstance(v, bool) for v in given
        )
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
