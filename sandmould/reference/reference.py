"""Pages of the documentation that are written from the code: measures, limits, keys and files."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from sandmould import ROOT
from sandmould.kinds.registry import KINDS, kind_named
from sandmould.limits import LIMITS
from sandmould.reference.contents import OF_ALL, OF_RUN, OF_STUDY
from sandmould.reference.keys import cells, keys_of, kind_of, sections
from sandmould.study.plan.expand import scenes
from sandmould.study.plan.load_study import OpenStudy
from sandmould.study.plan.measured import measured_in

DOCS = ROOT / "docs"
_TEMPLATES = Path(__file__).with_name("pages")
_WRITTEN = "Written by `make schema` from the code; nothing here is edited by hand."


def measures_text(study: OpenStudy) -> str:
    """What the runs of a study can be measured by, a line a measure.

    Raises
    ------
    BadInputError
        When a point of its sweep has a value of a wrong type.
    """
    kind = kind_named(study.study.kind)
    every = [measured_in(study.study, kind, scene) for scene in scenes(study)]
    count = Counter(measure for measures in every for measure in measures)
    rows = [("measure", "unit", "meaning")]
    for measure, points in count.items():
        some = "" if points == len(every) else f" At {points} of {len(every)} points."
        rows.append((measure.name, measure.unit, measure.meaning + some))
    name_width, unit_width = (max(len(row[i]) for row in rows) for i in (0, 1))
    lines = [f"{n.ljust(name_width)}  {u.ljust(unit_width)}  {m}" for n, u, m in rows]
    return "\n".join([*lines, "", "Those without a unit are words and cannot be compared."])


def page(name: str, **values: Any) -> str:
    """Fill a template of ``pages``."""
    import jinja2  # ``measures_text`` needs none

    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    return templates.get_template(f"{name}.md.j2").render(written=_WRITTEN, **values)


def pages() -> dict[Path, str]:
    """The text of each page."""
    places = (
        ("All studies", "results/", OF_ALL),
        ("A study", "results/<study>/", OF_STUDY),
        ("A run", "results/<study>/runs/<run>/", OF_RUN),
    )
    values: dict[str, dict[str, Any]] = {
        "measures": {"kinds": KINDS.values()},
        "limits": {"limits": LIMITS},
        "keys": {"sections": sections(), "keys_of": keys_of, "kind_of": kind_of, "cells": cells},
        "files": {"places": places, "tables": [f for f in (*OF_STUDY, *OF_RUN) if f.columns]},
    }
    return {DOCS / f"{name}.md": page(name, **about) for name, about in values.items()}
