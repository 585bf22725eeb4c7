"""Values of a material that are not what they stand for, by their sources."""

from __future__ import annotations

from sandmould.definition.run import Run
from sandmould.kinds.registry import kind_of
from sandmould.runs.formatting import listed

_MARK = "stand-in"
"""How the source of such a value begins."""
_TOLD = 8


def stand_ins(run: Run) -> tuple[str, ...]:
    """Keys of a run whose values stand in for others, in the order of its scenario."""
    material = kind_of(run.scenario).material
    sections = set(material.model_fields) if material else set()
    return tuple(
        key
        for key, source in run.sources.items()
        if key.partition(".")[0] in sections and source.startswith(_MARK)
    )


def stand_in_line(run: Run) -> str:
    """Which values of its own a user should put in their place; empty where there are none."""
    if not (keys := stand_ins(run)):
        return ""
    told = listed(list(keys), most=_TOLD)
    return f"Placeholder values, to be replaced by those of your own material: {told}.\n"
