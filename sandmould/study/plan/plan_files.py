"""The plan of a study on disk, and what its runs will cost, before anything starts."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cache
from pathlib import Path
from typing import Any, get_type_hints

import yaml
from pydantic import create_model

from sandmould.definition.run import FILL, Run
from sandmould.definition.study import Study
from sandmould.definition.sweep import Point
from sandmould.digest import SHORT, digest
from sandmould.kinds.registry import kind_named, kind_of
from sandmould.runs.files import write_text
from sandmould.runs.formatting import (
    listed,
    name_of,
    runs_text,
    setting_text,
    size_text,
    value_text,
)
from sandmould.runs.progress import duration_text
from sandmould.runs.templates import Note
from sandmould.scenario.quantity import Section
from sandmould.scenario.reading import Origin, read_planned, validated
from sandmould.statistics.config import SPRINGS
from sandmould.statistics.grain_check import FACTOR
from sandmould.study.plan.fills import planned_work
from sandmould.study.plan.price import Prices, study_s
from sandmould.study.robustness.controls import COARSER

SCENARIO_FILE = "scenario.yaml"
"""A run as planned: what its jobs and its report read."""
STUDY_FILE = "study.yaml"
"""The study as planned, with all that it rests on."""
SUMMARY, CURVES = "summary.tsv", "curves.tsv"
CHECKS = ("summary_checks.tsv", "curves_checks.tsv")
"""Tables of the runs that are no part of the sweep; only studies that have such runs."""
REPORT_FILE = "report.html"
SPREADSHEET = "report.xlsx"
VERDICT_FILE = "verdict.txt"
"""The first sentence of the report, for the terminal and for programs."""
FIGURES = "figures"
"""Folder of a study that its report's main figures lie in."""
SPHERES = "spheres"
"""Folder of a study that the films of all spheres lie in, which its report loads when asked."""
LISTED_POINTS = 20
# libyaml writes a thousand scenarios in seconds where pure Python takes half a minute.
_Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


@cache
def _file_model(kind: str) -> Any:
    """What ``scenario.yaml`` of a run holds; the type of its scenario is that of its kind."""
    types = get_type_hints(Run) | {"scenario": kind_named(kind).scenario}
    values: dict[str, Any] = {
        each.name: (types[each.name], ... if each.default is MISSING else each.default)
        for each in fields(Run)
    }
    return create_model("RunFile", __base__=Section, kind=(str, ...), **values)


def _of_run(run: Any) -> dict[str, Any]:
    return {each.name: getattr(run, each.name) for each in fields(Run)}


def write_plan(runs: Sequence[Run], folder: Path) -> None:
    """Write ``runs.tsv``, and ``scenario.yaml`` anew in folders of runs whose plan has changed.

    Rows keep the place they had in an earlier round; new ones are appended. A run has no folder
    before it is computed, see ``write_run``. Folders of runs that are no longer listed stay, since
    they may hold results.

    ``runs``: all runs of the study, those of earlier rounds included, and the fills that they
    share; fills are no rows.
    """
    write_scenarios(runs, folder)
    table = folder / "runs.tsv"
    text = table.read_text(encoding="utf-8", errors="replace") if table.is_file() else ""
    earlier = text.splitlines()[1:]
    place = {line.split("\t", 1)[0]: n for n, line in enumerate(earlier)}
    rows = (run for run in runs if run.part != FILL)
    ordered = sorted(rows, key=lambda run: place.get(run.run, len(place)))
    _write(table, _table_text(ordered))


def write_scenarios(runs: Sequence[Run], folder: Path) -> None:
    """Write ``scenario.yaml`` anew in folders of runs: where their files lie may have changed."""
    for run in runs:
        if (folder / run.place / SCENARIO_FILE).exists():
            write_run(run, folder)


def write_run(run: Run, folder: Path) -> Path:
    """Write the ``scenario.yaml`` of a run that is to be computed, unless it says so already."""
    place = folder / run.place
    kind = kind_of(run.scenario).name
    file = _file_model(kind)(kind=kind, **_of_run(run))
    # Most of a plan's time would be YAML, so the first line says what the others come from.
    state = digest(file.model_dump_json())[:SHORT]
    head = f"# Written by the plan, state {state}. Change the study instead.\n"
    path = place / SCENARIO_FILE
    if not path.is_file() or not path.read_bytes().startswith(head.encode()):
        tree = file.model_dump(mode="json")
        text = yaml.dump(tree, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
        place.mkdir(parents=True, exist_ok=True)
        write_text(path, f"{head}{text}")
    return place


def write_study(study: Study, folder: Path) -> None:
    """Write the study as planned, with all that it rests on, for its report and the record."""
    _write(folder / STUDY_FILE, _study_text(study))


def changed_line(study: Study, path: Path, folder: Path) -> str:
    """Say that a study's file has changed since its tables and report; empty where it has not.

    ``path``: of the file; ``folder``: of its results.
    """
    known = folder / STUDY_FILE
    if not known.is_file() or known.read_bytes() == _study_text(study).encode():
        return ""
    return f"{path.name} was changed or moved: sandmould run makes tables and report anew"


def _study_text(study: Study) -> str:
    tree = study.model_dump(mode="json")
    text = yaml.dump(tree, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    return f"# Written by the plan; change the study's own file instead.\n{text}"


def _write(path: Path, text: str) -> None:
    """Write a file unless it says so already: Snakemake reruns what depends on newer files."""
    if not path.is_file() or path.read_bytes() != text.encode():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)


def _table_text(runs: Sequence[Run]) -> str:
    keys = list(dict.fromkeys(key for run in runs for key in run.parameters))
    # Only a study with a cross check has runs of two parts to tell apart.
    several = len({run.part for run in runs}) > 1
    rows = [["run", *keys, "replicate", "seed", *(["part"] if several else [])]]
    for run in runs:
        values = [_cell(run.parameters.get(key)) for key in keys]
        part = [run.part] if several else []
        rows.append([run.run, *values, str(run.replicate), str(run.seed), *part])
    return "".join("\t".join(row) + "\n" for row in rows)


def plan_rows(runs: Sequence[Run], prices: Prices) -> list[dict[str, Any]]:
    """What the runs of a study will take, a row a run; units stand in the names."""
    keys = list(dict.fromkeys(key for run in runs for key in run.parameters))
    work = kind_of(runs[0].scenario).planning.work_unit.replace("-", "_")
    return [
        {
            "run": run.run, **{key: run.parameters.get(key) for key in keys},
            "replicate": run.replicate, "seed": run.seed, "part": run.part,
            work: prices.work(run), "wall_time_s": prices.engine_s(run),
        }
        for run in runs
    ]  # fmt: skip


def _cell(value: Any) -> str:
    """A value as text of one line and one cell; whole numbers without a decimal point."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    text = value if isinstance(value, str) else json.dumps(value)
    text = text if text.isprintable() else text.encode("unicode_escape").decode()
    # as tables quote; lists of texts have quotes inside, which need none
    return '"' + text.replace('"', '""') + '"' if text.startswith('"') else text


def read_run(path: Path) -> Run:
    """Read a run back from its ``scenario.yaml``.

    Raises
    ------
    BadInputError
        When the file is missing or was changed into something that is no run.
    """
    file_name = str(path)
    tree = read_planned(path, file_name)
    kind = kind_named(tree.get("kind", ""), file_name).name
    file = validated(_file_model(kind), tree, Origin({"": file_name}))
    return Run(**_of_run(file))


def plan_table(runs: Sequence[Run], prices: Prices, cores: int) -> str:
    """What the runs of a study will take, as text."""
    points: dict[tuple[Any, ...], list[Run]] = {}
    for run in runs:
        # Fills of one size are one point; runs of a point may share a fill or not.
        size = planned_work(run) if run.part == FILL else ""
        alike_in = run.part, json.dumps(run.parameters), bool(run.fill), size
        points.setdefault(alike_in, []).append(run)
    notes: dict[str, list[tuple[str, Note]]] = {}
    planning = kind_of(runs[0].scenario).planning
    heads = [*planning.plan_cells(runs[0].scenario), planning.work_unit]
    rows = [["point", "runs", *heads, "wall time a run"]]
    work = 0.0
    for alike in points.values():
        scenario = alike[0].scenario
        work_a_run = prices.work(alike[0])
        work += work_a_run * len(alike)
        # a fill has nothing to tell that its runs have not, coarser grains are no setting
        for note in () if alike[0].part in (FILL, COARSER.part) else planning.notes(scenario):
            notes.setdefault(note.about, []).append((alike[0].run.rsplit("_r", 1)[0], note))
        if len(rows) <= LISTED_POINTS:
            rows.append(
                [
                    alike[0].run.rsplit("_r", 1)[0],
                    str(len(alike)),
                    *planning.plan_cells(scenario).values(),
                    f"{work_a_run:.3g}",
                    duration_text(prices.engine_s(alike[0])),
                ]
            )
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) for row in rows]
    if len(points) > LISTED_POINTS:
        lines.append(f"... and {len(points) - LISTED_POINTS} more points")
    fills = [run for run in runs if run.part == FILL]
    if fills:
        lines.append(_fills_line(runs, fills))
    whole = duration_text(study_s([prices.piece(run) for run in runs], cores))
    lines.append(
        f"{runs_text(len(runs) - len(fills))}, {work:.3g} {planning.work_unit}. Wall time on "
        f"{cores_text(cores)} with report: {whole}, {prices.basis(runs)}"
    )
    settings = [
        alike[0].scenario for alike in points.values() if alike[0].part not in (FILL, COARSER.part)
    ]
    lines += planning.settings_lines(settings)
    lines += [_note_line(told, len(settings)) for told in notes.values()]
    return "\n".join(line.rstrip() for line in lines) + "\n"


def beyond_line(left_out: Sequence[Point], limits: Mapping[str, float]) -> str:
    """Which points of a sweep lie beyond the limits of the user's table, as a line, if any do."""
    if not left_out:
        return ""
    told = listed([setting_text(point) for point in left_out], most=LISTED_POINTS)
    of_table = listed([f"{name_of(key)} {value_text(key, v)}" for key, v in limits.items()])
    return f"Left out, since your table cannot do it ({of_table}): {told}.\n"


def later_lines(later: Sequence[Run], prices: Prices, cores: int) -> str:
    """What controls of the best setting will take, a line a sort; empty where none are to come.

    ``later``: at settings in place of those that are not known yet, with the fills that come with
    them.
    """
    runs = [run for run in later if run.part != FILL]
    of_springs = sum(SPRINGS in run.part for run in runs)
    springs = f", {of_springs} of them with other springs" if of_springs else ""
    names = {name for r in runs if r.part == COARSER.part for name in (r.run, r.fill)}
    coarser = [run for run in later if run.run in names]
    controls = [run for run in later if run not in coarser]
    said = ""
    for sort, what in (
        (controls, f", once the optimum is known, its controls: about {{}} runs{springs}"),
        (
            coarser,
            f" the best setting and the next with grains {FACTOR:g} times as large: {{}} runs",
        ),
    ):
        if sort:
            work = sum(prices.work(run) for run in sort)
            whole = duration_text(study_s([prices.piece(run) for run in sort], cores))
            number_of = sum(run.part != FILL for run in sort)
            said += (
                f"Then{what.format(number_of)}, {work:.3g} "
                f"{kind_of(sort[0].scenario).planning.work_unit}. Wall time on "
                f"{cores_text(cores)}: {whole}\n"
            )
    return said


def _fills_line(runs: Sequence[Run], fills: Sequence[Run]) -> str:
    """How many runs share how many fills, and what the fills take of the disk."""
    sharing = sum(bool(run.fill) for run in runs)
    state_bytes = sum(kind_of(fill.scenario).planning.state_bytes(fill.scenario) for fill in fills)
    number = "1 fill" if len(fills) == 1 else f"{len(fills)} fills"
    return (
        f"The {sharing} runs start from {number} of the box, each computed once. Together the "
        f"fills take about {size_text(state_bytes)} of the disk."
    )


def cores_text(cores: int) -> str:
    """A number of cores."""
    return f"{cores} core{'s' if cores > 1 else ''}"


def _note_line(told: Sequence[tuple[str, Note]], points: int) -> str:
    """One line of what was found at some of a study's points, in the words of the first."""
    label, first = told[0]
    is_one = len({note.text for _, note in told}) == 1
    if points == 1 or (is_one and len(told) == points):
        return f"{first.about}: {first.text}"
    every = "both" if points == 2 else f"all {points}"
    where = f"At {every if len(told) == points else f'{len(told)} of {points}'} points"
    figures = f"first at {label}" if is_one else f"the figures are those of {label}"
    return f"{first.about}: {first.text} ({where}; {figures}.)"
