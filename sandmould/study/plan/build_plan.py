"""From a study's file to the plan that Snakemake's graph is built of."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from sandmould import SHIPPED
from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.certificate import provisional_hz
from sandmould.definition.comparing import ENGINE
from sandmould.definition.run import RUN_NAME, Run
from sandmould.definition.sweep import Point, points
from sandmould.kinds.kind import AnyScenario, Kind, Planning, SpeedClass
from sandmould.kinds.registry import kind_named, kind_of
from sandmould.plain_file import UNREADABLE
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import MANIFEST_FILE, OUTCOME_FILE, read_manifest
from sandmould.study.plan.batches import Batch, plan_batches
from sandmould.study.plan.expand import expand, swept_key
from sandmould.study.plan.fills import planned_work, share_fills
from sandmould.study.plan.grain_check import affordable_runs
from sandmould.study.plan.lacking import Lack, Need, lack_of, lacks
from sandmould.study.plan.load_study import (
    OpenStudy,
    StudyFile,
    at_later_key,
    open_study,
    study_files,
    study_of,
)
from sandmould.study.plan.measured import problems_elsewhere
from sandmould.study.plan.ownership import check_owner
from sandmould.study.plan.plan_files import (
    SCENARIO_FILE,
    changed_line,
    read_run,
    write_scenarios,
)
from sandmould.study.plan.trust import check_letters, check_places, check_trust
from sandmould.study.rounds.round_log import RoundLog, read_rounds

RESULTS = Path("results")
DEFAULT_STUDY = SHIPPED / "config" / "studies" / "tube_demo.yaml"


@dataclass(frozen=True)
class Plan:
    """A study and its runs."""

    study: OpenStudy
    runs: tuple[Run, ...]
    fills: tuple[Run, ...] = ()
    """Those that runs share."""
    later: tuple[Run, ...] = ()
    """Runs that round the optimum, and their fills, at frequencies that are not known yet."""

    @property
    def kind(self) -> Kind[Any]:
        """What is simulated."""
        return kind_named(self.study.study.kind)

    @cached_property
    def classes(self) -> dict[SpeedClass, list[AnyScenario]]:
        """Scenarios of each class that is computed at one speed: the dearest, the first, the last.

        What a deck of the user's own takes may depend on the point more than the plan knows.
        """
        found: dict[SpeedClass, list[Run]] = {}
        for run in self.runs:
            found.setdefault(self.kind.planning.speed_class(run.scenario), []).append(run)
        return {
            each: [run.scenario for run in (max(runs, key=planned_work), runs[0], runs[-1])]
            for each, runs in found.items()
        }

    def first_of_each_class(self, lacking: Container[str]) -> list[Run]:
        """Of the runs that lack something, the first of each class."""
        speed_class = self.kind.planning.speed_class
        left = [run for run in self.runs if run.run in lacking]
        return list({speed_class(run.scenario): run for run in reversed(left)}.values())

    @property
    def beyond_table(self) -> list[Point]:
        """Points of the sweep that are left out, since the user's table cannot do them."""
        sweep = self.study.study.sweep
        kept = [run.parameters for run in self.runs if run.part == "sweep"]
        if len({str(p) for p in kept}) >= sweep.number_of_points:
            return []
        return [p for p in points(sweep, self.study.study.scenario) if p not in kept]

    @cached_property
    def _by_name(self) -> dict[str, Run]:
        return {run.run: run for run in (*self.runs, *self.fills)}

    def batches(
        self,
        wall_s: float,
        least: int = 1,
        cores: int = 1,
        free_cores: int = 0,
        lacking: Container[str] = (),
    ) -> list[Batch]:
        """Runs that share a job of so many cores until it lasts so long; none for 0.

        Batches of fewer than ``least`` runs are left out: those runs have jobs of their own. Runs
        that lack something are ``lacking``; they are shared out by themselves, and evenly among
        ``free_cores`` where there are any.
        """
        if wall_s <= 0:
            return []
        left = [run for run in self.runs if run.run in lacking]
        whole = [run for run in self.runs if run.run not in lacking]
        batches = plan_batches(whole, wall_s, cores)
        for runs in (self.fills, left):
            batches += plan_batches(runs, wall_s, cores, free_cores, least)
        return [batch for batch in batches if len(batch.runs) >= least]

    def threads(self, name: str) -> int:
        """Cores that a run keeps busy, as MPI ranks or as threads."""
        return self.kind.planning.threads(self._by_name[name].scenario)

    def ranks(self, name: str) -> int:
        """MPI ranks of a run."""
        return self.kind.planning.ranks(self._by_name[name].scenario)

    def memory_mb(self, name: str) -> int:
        """Memory to ask for."""
        return self.kind.planning.memory_mb(self._by_name[name].scenario)

    def runtime_min(self, *names: str, side_by_side: int = 1) -> int:
        """Wall time to ask for some runs, so many at a time."""
        each_s = [self.kind.planning.allowed_s(self._by_name[name].scenario) for name in names]
        # the last run may begin when all others have ended
        seconds = sum(each_s) / side_by_side + (max(each_s) if side_by_side > 1 else 0.0)
        return 10 + math.ceil(seconds / 60)

    def lacks(self, results: Path) -> dict[str, Lack]:
        """What a start would compute or measure: what each run lacks, whole ones left out.

        With the fills that runs go on from that are computed.
        """
        folder = results / self.study.name
        found = lacks(self.runs, folder)
        awaited = {run.fill for run in self.runs if _computes(found.get(run.run))}
        return found | lacks((fill for fill in self.fills if fill.run in awaited), folder)

    def labels(self, name: str) -> dict[str, str]:
        """Labels of a run in Snakemake's own report."""
        run = self._by_name[name]
        labels = {key: str(value) for key, value in run.parameters.items()}
        return labels | {"replicate": str(run.replicate)}


def _computes(lack: Lack | None) -> bool:
    return lack is not None and lack.need is Need.COMPUTE


_LOOKS = (
    *("--dry-run", "--dryrun", "--lint", "--report", "--dag", "--rulegraph", "--filegraph"),
    *("--d3dag", "--summary", "--detailed-summary", "--list-rules", "--list-target-rules"),
    *("--list-changes", "--list-untracked", "--archive", "--cleanup-metadata", "--unlock"),
)


def starts_jobs(arguments: Sequence[str]) -> bool:
    """Whether Snakemake called with these arguments computes, or only looks."""
    short = [a for a in arguments if re.fullmatch("-[a-zA-Z]+", a)]
    looks = any(a.split("=")[0] in _LOOKS for a in arguments)
    return not looks and not any(set(a) & set("nSDl") for a in short)


def study_path(configfiles: Sequence[Path], overrides: Mapping[str, Any]) -> Path:
    """Choose the study's file: the one given with ``--configfile``, else the demo.

    Raises
    ------
    BadInputError
        When several files are given, or single values with ``--config``: Snakemake would merge
        them unseen, and no record would name them.
    """
    if len(configfiles) > 1:
        names = [Path(p).name for p in configfiles]
        raise BadInputError([Problem("--configfile", names, "one study at a time")])
    if overrides:
        valid = "no value: write a study based_on this one and give it with --configfile"
        raise BadInputError([Problem("--config", dict(overrides), valid)])
    return Path(configfiles[0]) if configfiles else DEFAULT_STUDY


def open_plan(path: Path, results: Path = RESULTS, text: str | None = None) -> Plan:
    """Open, validate and expand a study.

    ``text``: what the study's file will hold, where it is not written yet.

    Raises
    ------
    BadInputError
        With one sentence a problem; a missing engine is one of them, and results that belong to
        another study file of the same name.
    """
    files = study_files(path, text)
    try:
        study = study_of(files)
        check_owner(path, results / study.name)
        runs, trial = _sound_runs(study, results)
    except BadInputError as error:
        raise BadInputError([at_later_key(p, files, _misfits) for p in error.problems]) from None
    planning = kind_named(study.study.kind).planning
    shared, fills = share_fills(runs, planning)
    return Plan(study, tuple(shared), tuple(fills), tuple(_later(runs, trial, fills, planning)))


def changed_since(path: Path, folder: Path) -> str:
    """Say that a study has changed since its report; empty where it has not, or is gone.

    A study that was moved has moved with its files: its runs then name those that lie here.
    """
    with contextlib.suppress(BadInputError):
        if said := changed_line(open_study(path).study, path, folder):
            write_scenarios(open_plan(path).runs, folder)
            return said
    return ""


def planned_runs(study: OpenStudy, log: RoundLog, folder: Path) -> list[Run]:
    """Runs of a study with those of its rounds and of what they have decided.

    ``folder``: of its results, where runs may lie under names that they had before.
    """
    runs = expand(study, log.runs, log.certified_hz)
    if log.coarsened:
        runs += affordable_runs(study, log.coarsened, runs)
    return _under_kept_names(runs, folder)


def _misfits(files: Sequence[StudyFile]) -> set[str]:
    """Keys of what is wrong with a study of some files, without results."""
    try:
        _sound_runs(study_of(files), Path())
    except BadInputError as error:
        return {problem.key for problem in error.problems}
    return set()


def _sound_runs(study: OpenStudy, results: Path) -> tuple[list[Run], list[Run]]:
    """Runs of a study and of a trial of its controls, all of which their engines can compute."""
    folder = results / study.name
    log = read_rounds(folder, study.study)
    runs = planned_runs(study, log, folder)
    problems: dict[str, Problem] = {}
    # Controls come hours later, at frequencies that are not known yet: they are tried at others.
    certificate = study.study.certificate
    trial_hz = provisional_hz(certificate, study.study.sweep, study.study.scenario)
    trial_hz = () if log.certified_hz else trial_hz
    trial = expand(study, (), trial_hz) if trial_hz else []
    if study.study.grain_price_share and log.coarsened is None:
        first = points(study.study.sweep, study.study.scenario)
        trial += affordable_runs(study, first, runs)
    planning = kind_named(study.study.kind).planning
    for run in (*runs, *trial):
        problem = planning.engine_problem(run.scenario)
        if problem is not None:
            problem = _at_stated_key(study, run, problem)
            problems[str(problem)] = problem
    for problem in (*problems_elsewhere(study.study, results), *_unmeasurable(runs, folder)):
        found = replace(problem, file=study.origin.file_of(problem.key))
        problems[str(found)] = found
    if problems:
        raise BadInputError(list(problems.values()))
    return runs, trial


def _unmeasurable(runs: Sequence[Run], folder: Path) -> list[Problem]:
    """Measures asked for that the first run which has ended cannot give: the others are alike."""
    ended = next((run for run in runs if (folder / run.place / OUTCOME_FILE).exists()), None)
    if ended is None or lack_of(ended, folder / ended.place).need is not Need.MEASURE:
        return []
    place = folder / ended.place
    names = list[str]()
    with contextlib.suppress(*UNREADABLE):  # damaged files: status --deep tells them
        names = kind_of(ended.scenario).planning.unmeasurable(ended.scenario, place)
    valid = f"a column that {place / 'series.tsv'} has as log_<column>, or that a dump there has"
    return [
        Problem(f"scenario.measures.{name}", ended.scenario.measures[name], valid) for name in names
    ]


def checked_plan(path: Path, text: str | None = None) -> Plan:
    """Open, validate and expand a study whose runs are to start.

    Raises
    ------
    BadInputError
        With one sentence a problem; a place or a program that is not to be trusted is one.
    """
    plan = open_plan(path, text=text)
    check_places(plan.study)
    check_letters(plan.runs)
    check_trust(plan.study, plan.runs)
    _CHECKED[path.resolve()] = plan
    return plan


_CHECKED: dict[Path, Plan] = {}
"""For a Snakemake that is forked from the command that has planned."""


def plan_at_hand(path: Path) -> Plan:
    """The plan that was checked last in this process, or a new one."""
    return _CHECKED.get(path.resolve()) or checked_plan(path)


def _later(
    runs: Sequence[Run], trial: Sequence[Run], fills: Sequence[Run], planning: Planning[Any]
) -> list[Run]:
    """Runs of a trial of the controls, and the fills that come with them."""
    planned = {run.run for run in runs}
    added = [run for run in trial if run.run not in planned]
    if not added:
        return []
    shared, all_fills = share_fills([*runs, *added], planning)
    known = {fill.run for fill in fills}
    return [*(f for f in all_fills if f.run not in known), *shared[len(runs) :]]


def _at_stated_key(study: OpenStudy, run: Run, problem: Problem) -> Problem:
    """What an engine refuses, at the key that gave the value."""
    if problem.key in run.parameters:
        key = swept_key(study, run.parameters, problem.key)
    elif problem.key == ENGINE and run.part == "cross_check":
        key = "cross_check.engine"
    else:
        key = f"scenario.{problem.key}"
    return Problem(key, problem.value, problem.valid, study.origin.file_of(key))


@contextlib.contextmanager
def writing(folder: Path, key: str = "results") -> Iterator[None]:
    """Say in one sentence that results cannot be written, or what else ``key`` names."""
    try:
        yield
    except OSError as error:
        valid = f"a folder that takes files: {error.filename or 'it'} does not ({error.strerror})"
        raise BadInputError([Problem(key, str(folder), valid)]) from None


def _under_kept_names(runs: Sequence[Run], folder: Path) -> list[Run]:
    """Runs of a study, each by the name of the folder that holds it, where one does.

    A name begins with the swept keys, so it changes when a study sweeps one more; it ends with
    the replicate and the hash of the scenario, which stay.
    """
    places = folder / "runs"
    there = {path.name for path in places.iterdir()} if places.is_dir() else set()
    free = there - {run.run for run in runs}
    by_end = {_end(name): name for name in sorted(free) if re.fullmatch(RUN_NAME, name)}
    kept = []
    for run in runs:
        name = by_end.get(_end(run.run), "") if run.run not in there else ""
        if name and _hash_of(places / name) == scenario_hash(run.scenario):
            del by_end[_end(name)]
            run = replace(run, run=name)
        kept.append(run)
    return kept


def _end(name: str) -> str:
    """Replicate and hash, with which the name of a run ends."""
    return name.rpartition("_r")[2]


def _hash_of(folder: Path) -> str:
    """Of the run that lies in a folder; empty where that cannot be read."""
    try:
        if (folder / MANIFEST_FILE).exists():
            return str(read_manifest(folder)["origin"]["scenario_sha256"])
        return scenario_hash(read_run(folder / SCENARIO_FILE).scenario)
    except (BadInputError, *UNREADABLE):
        return ""
