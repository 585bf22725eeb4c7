"""Pages of the documentation that are written from the code: measures, limits, keys and files.

``python -m sandmould.reference.reference`` writes them again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from sandmould import ROOT
from sandmould.kinds.registry import KINDS, kind_named
from sandmould.limits import LIMITS
from sandmould.module_main import run_main
from sandmould.reference.contents import files_lines
from sandmould.reference.keys import keys_lines
from sandmould.runs.measures import Measure
from sandmould.study.plan.expand import scenes
from sandmould.study.plan.load_study import OpenStudy
from sandmould.study.plan.measured import measured_in

MEASURES = ROOT / "docs" / "measures.md"
LIMITS_PAGE = ROOT / "docs" / "limits.md"
KEYS = ROOT / "docs" / "keys.md"
FILES = ROOT / "docs" / "files.md"
_WRITTEN = "Written by `make schema` from the code; nothing here is edited by hand."


def measures_text(study: OpenStudy) -> str:
    """What the runs of a study can be measured by, a line a measure.

    Parameters
    ----------
    study : OpenStudy

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


def measures_page() -> str:
    """The page of all measures of all kinds of study."""
    lines = [
        "# Measures", "", _WRITTEN, "",
        "A measure is a column of `measures.tsv` (one row per record) and of `summary.tsv` (one "
        "row per run). `sandmould measures STUDY` lists those of a study.", "",
        "- `objective.measure`, `equivalence.margins` and the targets of a calibration name "
        "measures. A name that the scene will not have is refused before anything starts.",
        "- A unit of 1 is a pure number. Measures without a unit are words and cannot be "
        "compared.", "",
        "A study can state measures of its own, in any kind of study:", "",
        "```yaml", "own_measures:", "  empty_fraction: 1 - tube_fill_fraction",
        "  missing_sand_m2: 0.0012 - tube_sand_m2", "```", "",
        "- A formula has numbers, names of measures (own ones too), `+ - * / **`, brackets, `min`, "
        "`max`, `abs` and `sqrt`. Nothing else is taken, and no formula is run as a program.",
        "- The name ends in the unit, as all names do. Nobody checks that the unit is right.",
        "- A value is absent where it cannot be computed: after a division by zero, after the root "
        "of a negative number, or where a part of it is absent.",
        "- An own measure is a column of `summary.tsv` and `curves.tsv`. What holds for other "
        "measures holds for it.",
    ]  # fmt: skip
    for kind in KINDS.values():
        lines += ["", f"## Studies of kind {kind.name}"]
        for group in kind.planning.measures:
            lines += ["", f"{group.when[0].upper()}{group.when[1:]}:", ""]
            lines += _table(("measure", "unit", "meaning"), map(_cells, group.measures))
    return "\n".join(lines) + "\n"


def limits_page() -> str:
    """The page of all limits."""
    rows = [(limit.what, f"{limit.most:,}", limit.why, limit.change) for limit in LIMITS]
    lines = [
        "# Limits", "", _WRITTEN, "",
        "More than this is refused before anything starts. The refusal names the count, the limit "
        "and what to change. The limits guard against a slip, such as a zero too many. They do "
        "not promise that so much is fast: the plan tells the price.", "",
        *_table(("of what", "at most", "because", "what to change"), rows), "",
        "All stand in `sandmould/limits.py`.",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def keys_page() -> str:
    """The page of all keys."""
    lines = [
        "# Keys", "", _WRITTEN, "",
        "A study's file states only what differs from these defaults and from what it is "
        "`based_on`. `sandmould keys scenario.vibration` prints a part of this page. A section "
        "that several places can hold stands once, at the first of them. A unit of 1 is a pure "
        "number. A value may be written `{value: 0.35, unit: \"1\", source: \"shear test\"}`: the "
        "source then stands in the deck. Entries of lists are counted from 0, as in "
        "`vibration.0.frequency_hz`.",
        *keys_lines(),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def files_page() -> str:
    """The page of all files and what stands in them."""
    lines = [
        "# Files", "", _WRITTEN, "",
        "Tables are text with tabs between columns. What is absent is an empty cell or `nan` in a "
        "table, NaN in an array and `null` in JSON. The unit stands at the end of a name; 1 is a "
        "pure number, and words have none. `<...>` stands for a name.",
        *files_lines(),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


PAGES = {MEASURES: measures_page, LIMITS_PAGE: limits_page, KEYS: keys_page, FILES: files_page}


def _cells(measure: Measure) -> Sequence[str]:
    meaning = measure.meaning.replace("<", "\\<")
    return f"`{measure.name}`", measure.unit, meaning


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]


def main() -> None:
    """Write the pages."""
    for path, page in PAGES.items():
        path.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    run_main(main, "python -m sandmould.reference.reference")
