"""Short names of runs, from the values of their swept keys."""

from __future__ import annotations

import re

from sandmould.definition.comparing import ENGINE
from sandmould.definition.sweep import Point
from sandmould.runs.formatting import mark
from sandmould.scenario.quantity import Section, fields_at


class Labels:
    """Labels of a study's points, each its own."""

    def __init__(self, scenario: type[Section], has_units: bool) -> None:
        """Begin with none."""
        self._scenario, self._has_units = scenario, has_units
        self._point: dict[str, Point] = {}

    def of(self, point: Point) -> str:
        """Label of a point; a mark of its values ends one that another point has already."""
        label = run_label(point, self._scenario, self._has_units)
        if self._point.setdefault(label, point) == point:
            return label
        return f"{label}_{mark(point)}"


def run_label(parameters: Point, scenario: type[Section], has_units: bool) -> str:
    """Names and values of at most three swept keys, in letters that any file system takes.

    ``has_units``: whether the unit stands in the label.
    """
    keys = sorted(parameters)
    last = [key.rsplit(".", 1)[-1] for key in keys]
    words = []
    for key, name in list(zip(keys, last, strict=True))[:3]:
        parent = key.split(".")[-2] + "_" if last.count(name) > 1 and "." in key else ""
        if key == ENGINE:
            parent, name = "", "engine"
        value = parameters[key]
        unit = "" if has_units else _unit_suffix(scenario, key)
        words.append(letters(parent + name.removesuffix(unit))[:16])
        if isinstance(value, list) and all(isinstance(v, int | float) for v in value):
            words += [_digits(v) for v in value]
        elif isinstance(value, int | float):
            words.append(_digits(value))
        elif isinstance(value, str):
            words.append(letters(value)[:12])
        elif value is not None:
            words.append(mark(value))
    return "_".join(words) or "base"


def _digits(value: float) -> str:
    return f"{value:.4g}".replace("-", "m").replace(".", "p").replace("+", "")


def letters(text: str) -> str:
    """A text in small letters, digits and single underscores."""
    return re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")


def _unit_suffix(scenario: type[Section], key: str) -> str:
    """Unit of a key as its name ends with it, such as ``_kg_m3``."""
    for field in fields_at(scenario, key):
        extra = field.json_schema_extra
        if isinstance(extra, dict):
            unit = str(extra["unit"]).lower()
            return "_" + unit.replace("1/", "per_").replace("/", "_")
    return ""
