"""The plan of a study on disk, and what its runs will cost, before anything starts."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from sandmould.runs.files import write_text
from sandmould.runs.progress import duration_text
from sandmould.scenario.flow import MetalFlow
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.quantity import Section
from sandmould.scenario.reading import Origin, read_planned, validated
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solidification import Solidification
from sandmould.study.kinds.kind import SpeedClass, kind_of
from sandmould.study.run import Part, Run
from sandmould.study.study import Study

STUDY_FILE = "study.yaml"
"""The study as planned, with all that it rests on."""
FIGURES = "figures"
"""Folder of a study that its report's main figures lie in."""
SHOWN_POINTS = 20
# libyaml writes a thousand scenarios in seconds where pure Python takes half a minute.
_Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


class _RunFile(Section):
    """What ``scenario.yaml`` holds."""

    study: str
    run: str
    parameters: dict[str, Any]
    replicate: int
    scenario: Scenario
    sources: dict[str, str]
    part: Part = "sweep"


class _DeckRunFile(_RunFile):
    """The same of a deck of the user's own."""

    scenario: OwnDeck  # type: ignore[assignment]


class _SolidificationRunFile(_RunFile):
    """The same of a casting in its mould."""

    scenario: Solidification  # type: ignore[assignment]


class _FlowRunFile(_RunFile):
    """The same of metal that flows."""

    scenario: MetalFlow  # type: ignore[assignment]


_FILE_OF: dict[type, type[_RunFile]] = {
    OwnDeck: _DeckRunFile, Solidification: _SolidificationRunFile, MetalFlow: _FlowRunFile
}  # fmt: skip
_SIGN = {"template": _DeckRunFile, "shapes": _SolidificationRunFile, "case": _FlowRunFile}
"""Keys that only a scenario of one kind has."""


def write_plan(runs: Sequence[Run], folder: Path) -> None:
    """Write ``runs.tsv`` and ``runs/<run>/scenario.yaml``, files that would not change left alone.

    Rows keep the place they had in an earlier round; new ones are appended. Folders of runs that
    are no longer listed stay, since they may hold results.

    Parameters
    ----------
    runs : sequence of Run
        All runs of the study, those of earlier rounds included.
    folder : Path
        ``results/<study>``.
    """
    for run in runs:
        _write(folder / "runs" / run.run / "scenario.yaml", _scenario_text(run))
    table = folder / "runs.tsv"
    earlier = table.read_text(encoding="utf-8").splitlines()[1:] if table.is_file() else []
    place = {line.split("\t", 1)[0]: n for n, line in enumerate(earlier)}
    ordered = sorted(runs, key=lambda run: place.get(run.run, len(place)))
    _write(table, _table_text(ordered))


def write_study(study: Study, folder: Path) -> None:
    """Write the study as planned, with all that it rests on, for its report and the record."""
    tree = study.model_dump(mode="json")
    text = yaml.dump(tree, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    _write(
        folder / STUDY_FILE, f"# Written by the plan; change the study's own file instead.\n{text}"
    )


def _write(path: Path, text: str) -> None:
    """Write a file unless it says so already: Snakemake reruns what depends on newer files."""
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)


def _scenario_text(run: Run) -> str:
    model = _FILE_OF.get(type(run.scenario), _RunFile)
    file = model(**{name: getattr(run, name) for name in _RunFile.model_fields})
    tree = file.model_dump(mode="json")
    text = yaml.dump(tree, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    return f"# Written by the plan of the study; change the study instead.\n{text}"


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


def _cell(value: Any) -> str:
    """A value as text of one line; whole numbers without a decimal point."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return value if isinstance(value, str) else json.dumps(value)


def read_run(path: Path) -> Run:
    """Read a run back from its ``scenario.yaml``.

    Raises
    ------
    BadInputError
        When the file is missing or was changed into something that is no run.
    """
    shown = str(path)
    tree = read_planned(path, shown)
    keys = tree.get("scenario") or ()
    model = next((model for key, model in _SIGN.items() if key in keys), _RunFile)
    file = validated(model, tree, Origin({"": shown}))
    return Run(**{name: getattr(file, name) for name in _RunFile.model_fields})


def plan_table(
    runs: Sequence[Run], rate_per_s: Mapping[SpeedClass, float | None], cores: int
) -> str:
    """What the runs of a study will take, as text.

    Parameters
    ----------
    runs : sequence of Run
    rate_per_s : mapping of SpeedClass to float or None
        Work a second of one core, from the calibration; None or missing before it.
    cores : int
        Cores that share the runs.
    """
    points: dict[str, list[Run]] = {}
    for run in runs:
        points.setdefault(f"{run.part} {json.dumps(run.parameters)}", []).append(run)
    kind = kind_of(runs[0].scenario)
    heads = [*kind.plan_cells(runs[0].scenario), kind.WORK]
    rows = [["point", "runs", *heads, "wall time a run"]]
    work = core_s = longest_s = 0.0
    for alike in points.values():
        scenario = alike[0].scenario
        one, threads = kind.planned_work(scenario), kind.threads(scenario)
        rate = rate_per_s.get(kind.speed_class(scenario))
        one_s = one / rate if rate else math.nan
        work += one * len(alike)
        core_s += one_s * len(alike)
        longest_s = max(longest_s, one_s / threads)
        if len(rows) <= SHOWN_POINTS:
            rows.append(
                [
                    alike[0].run.rsplit("_r", 1)[0],
                    str(len(alike)),
                    *kind.plan_cells(scenario).values(),
                    f"{one:.3g}",
                    _wall_text(one_s / threads),
                ]
            )
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) for row in rows]
    if len(points) > SHOWN_POINTS:
        lines.append(f"... and {len(points) - SHOWN_POINTS} more points")
    # No schedule is shorter than its longest run.
    whole = _wall_text(max(core_s / cores, longest_s))
    lines.append(f"{len(runs)} runs, {work:.3g} {kind.WORK}, wall time on {cores} cores: {whole}")
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _wall_text(seconds: float) -> str:
    return "unknown until calibrated" if math.isnan(seconds) else duration_text(seconds)
