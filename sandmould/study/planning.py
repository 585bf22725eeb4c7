"""From a study's file to the plan that Snakemake's graph is built of, and its price."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from sandmould import ROOT
from sandmould.engines.choosing import deck_sources, engine_of, engine_problem
from sandmould.engines.program import build_program
from sandmould.engines.session import EngineStop
from sandmould.scenario.bad_input import BadInputError, Problem
from sandmould.scenario.fill import Fill, Layer
from sandmould.scenario.placement import plan_counts
from sandmould.scenario.scenario import Scenario
from sandmould.study.batches import Batch, plan_batches
from sandmould.study.certificate.asked import provisional_hz
from sandmould.study.comparing import ENGINE
from sandmould.study.expand import Run, expand, swept_key
from sandmould.study.opening import OpenStudy, open_study
from sandmould.study.plan import (
    kind_of,
    plan_table,
    planned_grain_steps,
    write_plan,
    write_study,
)
from sandmould.study.rounds.ledger import read_ledger

RESULTS = Path("results")
DEFAULT_STUDY = ROOT / "config" / "studies" / "tube_demo.yaml"
CALIBRATION_GRAINS = 400
CALIBRATION_FALL_WALL_S = 5.0
CALIBRATION_WALL_S = 1.0
BASE_MEMORY_MB = 600
GRAINS_PER_MB = 50
SLOW_RATE = 1e6
"""Grain-steps per second of a slow core; benchmarks/ has those measured."""


@dataclass(frozen=True)
class Plan:
    """A study and its runs."""

    study: OpenStudy
    runs: tuple[Run, ...]

    @cached_property
    def _by_name(self) -> dict[str, Run]:
        return {run.run: run for run in self.runs}

    def batches(self, wall_s: float) -> list[Batch]:
        """Runs that share a job until it lasts so long; none for 0, when every run has its own."""
        return plan_batches(self.runs, wall_s) if wall_s > 0 else []

    def threads(self, name: str) -> int:
        """Cores that a run keeps busy, as MPI ranks or as threads."""
        return self._by_name[name].scenario.engine.ranks

    def ranks(self, name: str) -> int:
        """MPI ranks of a run; the reference engine's ranks are threads of one process."""
        engine = self._by_name[name].scenario.engine
        return 1 if engine.name == "reference" else engine.ranks

    def deck_sources(self, name: str) -> list[str]:
        """Files of the repository that a run's deck is made from, and its solver if it is ours.

        Decks name the state of the solver, so a changed kernel changes the decks of its runs and
        they are computed again.
        """
        files = deck_sources(self._by_name[name].scenario)
        # As seen from here: another place of the repository is no reason to compute again.
        return [os.path.relpath(path) for path in files]

    def memory_mb(self, name: str) -> int:
        """Memory to ask for: several times the 126 MB measured at 1 134 discs, 144 at 8 000."""
        return BASE_MEMORY_MB + sum(plan_counts(self._by_name[name].scenario)) // GRAINS_PER_MB

    def runtime_min(self, *names: str) -> int:
        """Wall time to ask for some runs: that of a machine slower than any measured."""
        seconds = 0.0
        for name in names:
            scenario = self._by_name[name].scenario
            seconds += planned_grain_steps(scenario) / SLOW_RATE / scenario.engine.ranks
        return 10 + math.ceil(seconds / 60)

    def labels(self, name: str) -> dict[str, str]:
        """Labels of a run in Snakemake's own report."""
        run = self._by_name[name]
        labels = {key: str(value) for key, value in run.parameters.items()}
        return labels | {"replicate": str(run.replicate)}


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


def open_plan(path: Path, results: Path = RESULTS) -> Plan:
    """Open, validate and expand a study.

    Parameters
    ----------
    path : Path
    results : Path
        Where finished studies lie that this one may rest on.

    Raises
    ------
    BadInputError
        With one sentence a problem; a missing engine is one of them.
    """
    study = open_study(path)
    ledger = read_ledger(results / study.name, study.study)
    runs = expand(study, ledger.runs, ledger.certified_hz)
    found: dict[str, Problem] = {}
    # Controls come hours later, at frequencies that are not known yet: they are tried at others.
    asked = study.study.certificate
    trial_hz = provisional_hz(asked, study.study.sweep, study.study.scenario.seed)
    trial = expand(study, (), trial_hz) if trial_hz and not ledger.certified_hz else []
    for run in (*runs, *trial):
        problem = engine_problem(run.scenario)
        if problem is not None:
            told = _told(study, run, problem)
            found[str(told)] = told
    for problem in _unfinished(study, results):
        found[str(problem)] = problem
    if found:
        raise BadInputError(list(found.values()))
    return Plan(study, tuple(runs))


def _unfinished(study: OpenStudy, results: Path) -> Iterator[Problem]:
    """Studies that help to calibrate and have not been run."""
    for i, name in enumerate(study.study.calibration.also):
        if not (results / name / "summary.tsv").is_file():
            key = f"calibration.also.{i}"
            valid = f"a study with results: make study STUDY=config/studies/{name}.yaml comes first"
            yield Problem(key, name, valid, study.origin.file_of(key))


def _told(study: OpenStudy, run: Run, problem: Problem) -> Problem:
    """What an engine refuses, told at the key that gave the value."""
    if problem.key in run.parameters:
        key, file = swept_key(study, run.parameters, problem.key), study.file
    elif problem.key == ENGINE and run.part == "cross_check":
        key, file = "cross_check.engine", study.origin.file_of("cross_check.engine")
    else:
        key = f"scenario.{problem.key}"
        file = study.origin.file_of(key)
    return Problem(key, problem.value, problem.valid, file)


def announce(plan: Plan, results: Path, cores: int) -> str:
    """Write the plan to disk and say what it will take.

    Raises
    ------
    BadInputError
        When the results cannot be written.
    """
    folder = results / plan.study.name
    try:
        write_plan(plan.runs, folder)
        write_study(plan.study.study, folder)
    except OSError as error:
        valid = f"a folder that takes files: {error.filename} does not ({error.strerror})"
        raise BadInputError([Problem("results", str(folder), valid)]) from None
    one_each = {kind_of(run.scenario): run.scenario for run in plan.runs}
    rates = {kind: calibrated_rate(one, results) for kind, one in one_each.items()}
    title = plan.study.study.title or plan.study.name
    return f"\n{title}\n{plan_table(plan.runs, rates, cores)}"


def calibrated_rate(scenario: Scenario, results: Path) -> float | None:
    """Grain-steps per second of one core of this machine, measured once and kept.

    Returns
    -------
    float or None
        None when the engine could not run the calibration; the study's own runs will say why.
    """
    path = results / "calibration.json"
    version = engine_of(scenario).installed_version()
    key = f"{platform.node()} {scenario.engine.name} {version} {scenario.dimension}D"
    known: dict[str, Any] = {}
    if path.is_file():
        try:
            known = json.loads(path.read_text(encoding="utf-8"))
        except ValueError:
            known = {}
    if key not in known:
        rate = _measure_rate(scenario)
        if rate is None:
            return None
        known[key] = rate
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(known, indent=1), encoding="utf-8")
    return float(known[key])


def main(path: Path) -> int:
    """Check a study and print its plan; nothing starts."""
    try:
        print(announce(open_plan(path), RESULTS, os.cpu_count() or 1))
    except BadInputError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _measure_rate(scenario: Scenario) -> float | None:
    """Let a few hundred grains of the scene fall and settle, and time the end of it.

    Falling grains touch nothing and are too cheap to count, so they fall first, as far as a few
    seconds of this machine take them.
    """
    trial = scenario.model_copy(
        update={
            "fill": Fill(layers=(Layer(count=CALIBRATION_GRAINS),)),
            "obstacles": (),
            "vibration": (),
            "engine": scenario.engine.model_copy(update={"ranks": 1}),
        }
    )
    program = build_program(trial)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        engine = engine_of(trial)
        engine.write_deck(program, {}, folder, "calibration", "calibration")
        try:
            session = engine.open_session(program, folder, folder / "engine.log")
            session.insert_layer(1)
            session.start_stage(program.stages[0])
            begun, rest_s = time.perf_counter(), program.expected_s / 2
            while session.time_s < rest_s and (
                time.perf_counter() - begun < CALIBRATION_FALL_WALL_S
            ):
                session.advance()
            steps, begun = session.steps, time.perf_counter()
            while time.perf_counter() - begun < CALIBRATION_WALL_S:
                session.advance()
            rate = session.grains * (session.steps - steps) / (time.perf_counter() - begun)
            session.close()
        except EngineStop:
            return None
    return rate


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1])))
