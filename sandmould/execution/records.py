"""Committed results and whether they still stand for what the code would compute.

``python -m sandmould.execution.records record STUDY.yaml [FIGURE ...]`` copies a finished study's
tables, and the figures that its pages show, with what was run. ``check`` lists the records that
are stale and computes the smallest one of each kind again. ``renew`` makes all that are stale
again.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sandmould import ROOT
from sandmould.definition.run import Run
from sandmould.digest import digest
from sandmould.kinds.registry import kind_of
from sandmould.module_main import run_main
from sandmould.runs.columns import (
    ENGINE,
    OUTCOME,
    RUN,
    VERSION,
    VIBRATION_TIME_S,
    during_vibration,
    finished,
)
from sandmould.runs.formatting import listed
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import read_manifest
from sandmould.runs.outcome import Outcome
from sandmould.study.collect import read_collected, read_summary
from sandmould.study.plan.build_plan import planned_runs
from sandmould.study.plan.load_study import OpenStudy, open_study
from sandmould.study.plan.plan_files import CHECKS, FIGURES, SUMMARY
from sandmould.study.rounds.round_log import ROUNDS_FILE, read_rounds

RECORDS = ROOT / "docs" / "results"
OVER_TIME = "over_time.tsv"
TIMES = 8
"""Moments of the vibration, equally far apart, at which a record keeps what the study judges."""
DEFAULTS = 4
"""Which set of defaults records are computed with; a record without the number has the first. The
second: rest is decided by checks of its own, sand rests after vibration before it is measured, and
castings have the drawing's volume and area. The third: dashpots make up for the half step by
which they see the velocity late, in 3D the reference engine takes the slip of two grains in the
plane of the normal of half a step ago, discs are as thick as a grain is wide, and springs grow with
the grains. The fourth: the filled bed gives the step of what follows."""
OLD_DEFAULTS = "old defaults"
OLDER_SOLVER = "older solver"
"""Of a record: its scenarios are those of today, what computes them has changed since. It counts
as long as the cheapest study of its kind, computed again, agrees with its own record."""
USAGE = "python -m sandmould.execution.records check | renew | record STUDY.yaml [FIGURE ...]"
MOST_S = 3 * 3600.0
"""Processor time above which a record is not made again unasked (argued)."""
SAME = {
    "tube_fill_fraction": 0.05,
    "solid_fraction": 0.02,
    "solidification_time_s": 0.01,
    "h70_mean_pa": 50.0,
}
"""Largest difference of a study's mean when it is computed again on another machine: grains and
particles part after a few collisions, so only means are compared, with margins of a few times
their spread; heat is the same to round-off."""


def study_hash(runs: list[Run]) -> str:
    """Hash of all scenarios of a study and of what their decks command."""
    return digest(*sorted(scenario_hash(r.scenario) + _computed_hash(r) for r in runs))


def scenarios_hash(runs: list[Run]) -> str:
    """Hash of all scenarios of a study, whatever computes them."""
    return digest(*sorted(scenario_hash(r.scenario) for r in runs))


def _computed_hash(run: Run) -> str:
    return kind_of(run.scenario).planning.computed_hash(run.scenario)


def runs_in(study: OpenStudy, folder: Path) -> list[Run]:
    """All runs of a study, with those of the rounds that a folder keeps."""
    return planned_runs(study, read_rounds(folder, study.study), folder)


def record(path: Path, results: Path, figures: Sequence[str] = ()) -> Path:
    """Keep a study: its tables and figures, what was run, on what, and the hash of the study.

    Runs that failed are named in the record.

    ``figures``: names of figures that a page shall show. Those that the record has are kept, too,
    as they are drawn now.

    Raises
    ------
    SystemExit
        While runs have no outcome.
    OSError
        Where the study has no such figure.
    """
    study = open_study(path)
    folder = results / study.name
    runs = runs_in(study, folder)
    missing = [r for r in runs if not (folder / "runs" / r.run / "outcome.json").exists()]
    if missing or not (folder / "report.html").exists():
        raise SystemExit(f"{folder} is not whole, {len(missing)} runs are missing: run the study.")
    summary = read_summary(folder)
    failed = summary[summary[OUTCOME] != Outcome.FINISHED.label]
    compares = bool(study.study.equivalence.keys) or study.study.cross_check is not None
    names = [SUMMARY, *(["agreement.tsv"] if compares else [])]
    names += [name for name in (ROUNDS_FILE, CHECKS[0]) if (folder / name).exists()]
    provenance = read_manifest(folder / "runs" / runs[0].run)["origin"]
    record: dict[str, Any] = {
        "study": str(path),
        "study_sha256": study_hash(runs),
        "scenarios_sha256": scenarios_hash(runs),
        "command": f"snakemake --configfile {path}",
        "defaults": DEFAULTS,
        "commit": provenance["commit"],
        "versions": provenance["versions"],
        "engines": _engines(summary),
        "machine": provenance["machine"],
        "margins": study.study.equivalence.margins,
        "failed": dict(zip(failed[RUN], failed[OUTCOME], strict=True)),
        "wall_s_of_all_runs": round(float(summary.wall_s.sum()), 1),
        **_work(kind_of(runs[0].scenario).planning.work_unit.replace("-", "_"), summary),
    }
    target = RECORDS / study.name
    target.mkdir(parents=True, exist_ok=True)
    _keep_figures(folder / FIGURES, target / FIGURES, figures)
    for name in names:
        shutil.copy(folder / name, target / name)
    measure = study.study.objective.measure
    courses = over_time(read_collected(folder).curves, measure)
    if not courses.empty:
        courses.to_csv(target / OVER_TIME, sep="\t", index=False, float_format="%.5g")
    (target / "record.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return target


def _keep_figures(drawn: Path, kept: Path, asked: Sequence[str]) -> None:
    """Copy figures anew: those asked for, and those kept so far that are still drawn."""
    again = [path.name for path in kept.glob("*") if (drawn / path.name).exists()]
    files = {name: (drawn / name).read_bytes() for name in (*again, *asked)}
    shutil.rmtree(kept, ignore_errors=True)
    for name, content in files.items():
        kept.mkdir(exist_ok=True)
        (kept / name).write_bytes(content)


def over_time(curves: pd.DataFrame, measure: str) -> pd.DataFrame:
    """What a study judges at ``TIMES`` moments of the vibration of each run.

    ``curves``: one row a snapshot.

    Gives ``RUN``, ``VIBRATION_TIME_S`` and the measure at the snapshots next to those moments; no
    row where nothing vibrates.
    """
    kept = []
    if VIBRATION_TIME_S in curves and measure in curves:
        for _, course in during_vibration(curves).groupby(RUN, sort=False):
            times_s = course[VIBRATION_TIME_S].to_numpy()
            moments_s = times_s.max() * np.arange(1, TIMES + 1) / TIMES
            nearest = np.abs(times_s - moments_s[:, None]).argmin(axis=1)
            kept.append(course.iloc[np.unique(nearest)])
    columns = [RUN, VIBRATION_TIME_S, measure]
    return pd.concat(kept)[columns] if kept else pd.DataFrame(columns=columns)


def _engines(summary: pd.DataFrame) -> dict[str, str]:
    """Version of each engine that finished runs."""
    complete = summary[finished(summary)]
    return {
        str(engine): listed([str(v) for v in dict.fromkeys(runs[VERSION])])
        for engine, runs in complete.groupby(ENGINE)
    }


def _work(column: str, summary: pd.DataFrame) -> dict[str, float]:
    """What was computed in all; nothing where runs do not count it."""
    return {column: float(summary[column].sum())} if column in summary else {}


def stale_records() -> list[tuple[str, str]]:
    """Name every record with what is wrong with it, or an empty text where it stands.

    A record from before the defaults changed says ``OLD_DEFAULTS``: it was right when it was made.
    One whose scenarios are those of today says ``OLDER_SOLVER`` where another code computes them.
    """
    folders = [path.parent for path in sorted(RECORDS.glob("*/record.json"))]
    return [(folder.name, why_stale(folder)) for folder in folders]


def why_stale(folder: Path) -> str:
    """Say what is wrong with one record; see ``stale_records``."""
    record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
    study = ROOT / record["study"]
    if not study.exists():
        return f"its study {record['study']} is gone"
    return _what_changed(open_study(study), record, folder)


def _what_changed(study: OpenStudy, record: dict[str, Any], folder: Path) -> str:
    """Say what parts a study from its record; margins count where the record has them."""
    runs = runs_in(study, folder)
    if study_hash(runs) != record["study_sha256"]:
        if record.get("defaults", 1) < DEFAULTS:
            return OLD_DEFAULTS
        if scenarios_hash(runs) != record.get("scenarios_sha256"):
            return "the study has changed since"
        return OLDER_SOLVER
    margins = study.study.equivalence.margins
    return (
        "its margins were set after the runs" if record.get("margins", margins) != margins else ""
    )


def recompute_smallest(results: Path) -> list[str]:
    """Run the cheapest recorded study of each kind again and compare its means with the record.

    Records of old defaults and studies with an engine that this machine lacks are passed over.

    Gives one sentence a difference beyond its margin.
    """
    old = {name for name, why in stale_records() if why == OLD_DEFAULTS}
    kept = [path for path in RECORDS.glob("*/record.json") if path.parent.name not in old]
    studies = {path.parent.name: json.loads(path.read_text())["study"] for path in kept}
    cheapest: dict[str, tuple[float, str]] = {}
    for name, study in studies.items():
        runs = runs_in(open_study(ROOT / study), RECORDS / name)
        kind = kind_of(runs[0].scenario)
        if not any(kind.planning.engine_problem(run.scenario) for run in runs):
            cost = sum(kind.planning.predicted_s(run.scenario) for run in runs)
            cheapest[kind.name] = min(cheapest.get(kind.name, (math.inf, "")), (cost, name))
    return [
        sentence
        for _, name in cheapest.values()
        for sentence in _recompute(name, studies[name], results)
    ]


def _recompute(name: str, study: str, results: Path) -> list[str]:
    """Run one study again; see ``recompute_smallest``."""
    print(f"computing {name} again", flush=True)
    shutil.rmtree(results / name, ignore_errors=True)
    if (RECORDS / name / ROUNDS_FILE).exists():
        (results / name).mkdir(parents=True)
        shutil.copy(RECORDS / name / ROUNDS_FILE, results / name / ROUNDS_FILE)
    _compute(study)
    if not (results / name / SUMMARY).exists():
        return [f"{name} could not be computed again"]
    old, new = read_summary(RECORDS / name), read_summary(results / name)
    return [
        f"{name}: mean {column} is {new[column].mean():.4f}, recorded {old[column].mean():.4f}"
        for column, margin in SAME.items()
        if column in old and abs(new[column].mean() - old[column].mean()) > margin
    ]


def _compute(study: str) -> None:
    """Run a study; runs that fail belong to what some studies show."""
    command = [sys.executable, "-m", "sandmould.cli", "run", study]
    subprocess.run(command, cwd=ROOT, check=False)


def renew(results: Path) -> int:
    """Compute all records that are not of today's code again, the cheapest first, and keep them.

    What was computed before stays: called again, it goes on. A study that needs an engine which
    this machine lacks, or longer than ``MOST_S``, is named and left.

    Gives the number of studies without a new record.
    """
    waiting: list[tuple[float, str, str]] = []
    for name, why in stale_records():
        kept = json.loads((RECORDS / name / "record.json").read_text(encoding="utf-8"))
        study = kept["study"]
        if not why or not (ROOT / study).exists():
            continue
        runs = runs_in(open_study(ROOT / study), results / name)
        planning = kind_of(runs[0].scenario).planning
        lacks = [planning.engine_problem(run.scenario) for run in runs]
        cost_s = sum(planning.predicted_s(run.scenario) for run in runs)
        # the plan's sum counts a fill that runs share once for each
        cost_s = min(cost_s, kept.get("wall_s_of_all_runs", math.inf))
        if any(lacks):
            print(f"{name} is left: {next(filter(None, lacks))}")
        elif cost_s > MOST_S:
            print(f"{name} is left: it takes about {cost_s / 3600:.1f} h")
        else:
            waiting.append((cost_s, name, study))
    failed = 0
    for number, (cost_s, name, study) in enumerate(sorted(waiting), 1):
        print(f"[{number}/{len(waiting)}] {name}, about {cost_s / 60:.0f} min", flush=True)
        try:
            _compute(study)
            record(Path(study), results)
        except SystemExit as fault:
            print(f"{name} has no new record: {fault}", flush=True)
            failed += 1
    return failed


def main(arguments: list[str]) -> int:
    """Check all records, make them again, or keep one study."""
    if arguments == ["renew"]:
        return min(renew(Path("results")), 1)
    if arguments[:1] == ["record"] and len(arguments) > 1:
        print(record(Path(arguments[1]), Path("results"), arguments[2:]))
        return 0
    if arguments != ["check"]:
        print(f"usage: {USAGE}", file=sys.stderr)
        return 2
    return _check()


def _check() -> int:
    """Say how each record stands, and compute the cheapest of each kind again."""
    stale = stale_records()
    for name, why in stale:
        print(f"{name}: {_standing(why)}")
    differences = recompute_smallest(Path("results"))
    for sentence in differences:
        print(sentence)
    older = [name for name, why in stale if why == OLDER_SOLVER]
    if older:
        agrees = "do not count: see above" if differences else "count: its results are the same"
        print(f"Records of an older solver {agrees}: {listed(older, most=20)}.")
    return 1 if differences or any(why not in _HONEST for _, why in stale) else 0


_HONEST = ("", OLD_DEFAULTS, OLDER_SOLVER)


def _standing(why: str) -> str:
    if not why:
        return "stands"
    return why if why in _HONEST else f"stale, {why}"


if __name__ == "__main__":
    run_main(
        lambda *given: main([*given]),
        USAGE,
        range(1, 100),
    )
