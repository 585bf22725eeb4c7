"""Expand a study to its runs: every point of the sweep, checked, with every replicate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.certificate import SEEDS, frequency_key, spanned_hz
from sandmould.definition.comparing import ENGINE
from sandmould.definition.run import Part, Run
from sandmould.definition.sweep import Point, points, value_at
from sandmould.kinds.kind import AnyScenario
from sandmould.kinds.registry import kind_named
from sandmould.runs.columns import CROSS_CHECK, CROSS_CHECK_OWN
from sandmould.runs.formatting import setting_text
from sandmould.runs.hashing import by_name, scenario_hash
from sandmould.scenario.quantity import Section
from sandmould.scenario.reading import Origin, Tree, merge, validated
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.labels import Labels, letters
from sandmould.study.plan.load_study import ROOT_KEY, OpenStudy
from sandmould.study.plan.measured import problems as measure_problems
from sandmould.study.plan.trust import outside
from sandmould.study.robustness.controls import COARSER, Case, cases, swept_steps

MOST_PROBLEMS = 10
"""Problems told at once; the first few are those that teach."""


def replicate_seed(seed: int, replicate: int) -> int:
    """Seed of a replicate, the same one at every point of the sweep.

    Replicates are therefore blocks: runs of one replicate share their draws, and two points are
    compared in pairs, which takes the spread between fillings out of their difference.
    """
    word = np.random.SeedSequence([seed, replicate]).generate_state(1)[0]
    return int(word) & 0x7FFFFFFF


def expand(
    study: OpenStudy,
    more: Sequence[tuple[Point, int]] = (),
    certified_hz: Sequence[float] = (),
    measured: bool = True,
) -> list[Run]:
    """List the runs of a study.

    Parameters
    ----------
    more : sequence of (point, replicate)
        Runs that its rounds have added.
    certified_hz : sequence of float, Hz
        Frequencies of its certificate, the best in the middle; none before that is known.
    measured : bool, optional
        Whether the runs must have the measures that the study asks for; not to draw them.

    Points come in the order of the sweep, the replicates of a point together; those of the cross
    check after those of its point, those of the rounds and of the certificate last.

    Raises
    ------
    BadInputError
        When a point cannot be run; a value that came with the sweep is named at its swept key.
    """
    problems: dict[str, Problem] = {}
    runs: dict[str, Run] = {}
    opened = _opener(study)
    every = range(1, study.study.replicates + 1)
    planned = points(study.study.sweep, study.study.scenario)
    swept = [(point, every) for point in planned]
    added = [(as_planned(point, planned), range(n, n + 1)) for point, n in more]
    certificate = study.study.certificate
    key = frequency_key(study.study.sweep)
    controlled = {}
    if certificate.controls and certified_hz:
        controlled = {step: {key: f} for step, f in spanned_hz(certified_hz).items()
                      if step in swept_steps(certificate)}  # fmt: skip
    seeds = range(1, SEEDS + 1)
    added += [(point, seeds) for point in controlled.values()]
    beyond: list[_AtPoint] = []
    for point, replicates in (*swept, *added):
        at_point = opened(point, measured)
        if replicates is every and at_point.table_limit:
            beyond.append(at_point)
            continue
        for problem in map(study.as_written, at_point.problems):
            problems[str(problem)] = problem
        if len(problems) >= MOST_PROBLEMS:
            break
        if problems:
            continue
        checked = at_point.cross_check() if replicates is every else ()
        for run in (*at_point.runs(replicates), *checked):
            if run.run in runs and replicates is not every:
                continue  # the sweep has come to hold it
            if run.run in runs:
                said = " and ".join(f"{key} = {_short(value)}" for key, value in point.items())
                twice = Problem(
                    "sweep", point, "points that differ", study.file, f"sweep: {said} stands twice"
                )
                problems[str(twice)] = twice
                break
            runs[run.run] = run
    for step, point in controlled.items():
        at_point = opened(point)
        for case in cases(certificate, study.study.scenario, certified_hz[1]):
            if step not in case.steps:
                continue
            scenario, wrong = at_point.changed(case)
            problems |= {str(problem): problem for problem in wrong}
            runs |= {run.run: run for run in at_point.control(case, scenario, seeds)}
    checked_at = study.study.cross_check and study.study.cross_check.at
    of_table = [p for p in beyond if not runs or p.point == checked_at]
    problems |= {str(p): p for p in (each.table_problem() for each in of_table[:1])}
    if problems:
        raise BadInputError(list(problems.values())[:MOST_PROBLEMS])
    return list(runs.values())


def coarser_runs(study: OpenStudy, point: Point, replicates: Iterable[int]) -> list[Run]:
    """Runs of a point with coarser grains; none where no engine can compute them."""
    at_point = _opener(study)(point)
    if at_point.scenario is None or at_point.problems:
        return []
    scenario, wrong = at_point.changed(COARSER)
    return [] if wrong else list(at_point.control(COARSER, scenario, replicates))


def as_planned(point: Point, planned: Sequence[Point]) -> Point:
    """A chosen point as the sweep writes it now.

    Files that it names may have moved since, and tables have 0.0 for a 0, which a deck would have
    as another text.
    """
    for other in planned:
        if other == point:
            return other
    named = by_name(point)
    if named == point:
        return point
    return next((other for other in planned if by_name(other) == named), point)


def scenes(study: OpenStudy) -> Iterator[AnyScenario]:
    """The scenario of each point of a sweep, whether or not it can be computed.

    Raises
    ------
    BadInputError
        At a point whose values have a wrong type.
    """
    opened = _opener(study)
    for point in points(study.study.sweep, study.study.scenario):
        at_point = opened(point)
        if at_point.scenario is None:
            raise BadInputError(at_point.problems)
        yield at_point.scenario


class _AtPoint:
    """The scenario of one point of a sweep."""

    def __init__(
        self, study: OpenStudy, base: Tree, labels: Labels, point: Point, measured: bool = True
    ) -> None:
        self.measured = measured
        self.study, self.base, self.point, self.labels = study, base, point, labels
        self.kind = kind_named(study.study.kind)
        scene = study.scene_origin
        self.origin = Origin(dict(scene.file), dict(scene.source))
        self.scenario: Any = None
        try:
            self.scenario = self._scenario(point, self.origin)
        except BadInputError as error:
            self.problems = [self._at_swept_key(p) for p in error.problems]
        else:
            self.problems = [self._at_changed_key(p) for p in self._misfits(self.scenario)]

    @property
    def table_limit(self) -> str:
        """Key of the limit of the user's table that the point lies beyond; empty where none."""
        if self.scenario is None or self.problems:
            return ""
        return self.study.study.table_limit(self.scenario)

    def table_problem(self) -> Problem:
        """Why the table cannot do the point."""
        key = f"table.{self.table_limit}"
        at = setting_text(self.point) if self.point else "the motion of the scenario"
        value = value_at(self.study.study.model_dump(mode="json"), key)
        said = f"{key} = {value} does not allow {at}: shake it less, or at another frequency"
        return Problem(
            key, value, f"a limit that allows {at}", self.study.origin.file_of(key), said
        )

    def _scenario(self, point: Point, origin: Origin) -> Any:
        tree = self.base
        for key, value in point.items():
            tree = _put(tree, key.split("."), value, origin, f"sweep of {self.study.file}")
        scenario = validated(self.kind.scenario, tree, origin, ROOT_KEY)
        # before any of its files is opened
        if beyond := outside(self.study, scenario):
            raise BadInputError([replace(p, file=origin.file_of(p.key)) for p in beyond])
        try:
            return self.kind.planning.resolved(scenario)
        except BadInputError as error:
            problems = [replace(p, key=f"{ROOT_KEY}.{p.key}") for p in error.problems]
            raise BadInputError(
                [replace(p, file=origin.file_of(p.key)) for p in problems]
            ) from error

    def _misfits(self, scenario: AnyScenario) -> list[Problem]:
        """What is wrong with a well-typed scenario of this study, keys from the study's root."""
        planning = self.kind.planning
        misfits = [replace(p, key=f"{ROOT_KEY}.{p.key}") for p in planning.problems(scenario)]
        replicates = self.study.study.replicates
        if not misfits and replicates > 1 and not planning.takes_seed(scenario):
            valid = "1, since the template has no {{ seed }}: all runs of a setting would be equal"
            return [Problem("replicates", replicates, valid)]
        # What a scene can be measured by is told of one that can be computed.
        if misfits or not self.measured:
            return misfits
        return [*measure_problems(self.study.study, self.kind, scenario)]

    def _at_changed_key(self, problem: Problem) -> Problem:
        """A misfit told at the key that the user has to change."""
        if not self.point or problem in self._misfits(self.study.study.scenario):
            return replace(problem, file=self.study.origin.file_of(problem.key))
        if any(_holds(key, problem.key) for key in self.point):
            return self._at_swept_key(problem)
        guilty = {k: v for k, v in self.point.items() if self._alone_fails(k, v, problem.key)}
        blamed = guilty or self.point
        key, value = next(iter(blamed.items())) if len(blamed) == 1 else ("", dict(blamed))
        valid = f"one with which {problem.key}, here {problem.value}, is {problem.valid}"
        return self._in_sweep(key, value, valid)

    def _alone_fails(self, key: str, value: Any, problem_key: str) -> bool:
        """Whether one swept value, laid over the base alone, gives the same misfit."""
        try:
            scenario = self._scenario({key: value}, Origin())
        except BadInputError:
            return True
        return any(p.key == problem_key for p in self._misfits(scenario))

    def _at_swept_key(self, problem: Problem) -> Problem:
        """A problem moved from the scenario's key to the sweep that gave its value."""
        for key, value in self.point.items():
            if _holds(key, problem.key) or f"{ROOT_KEY}.{key}".startswith(f"{problem.key}."):
                # Below a swept section the problem's own value says more than the section.
                below = problem.key.removeprefix(f"{ROOT_KEY}.{key}")
                inner = below if below.startswith(".") else ""
                wrong_value = problem.value if _holds(key, problem.key) else value
                return self._in_sweep(key + inner, wrong_value, problem.valid)
        return problem

    def _in_sweep(self, key: str, value: Any, valid: str) -> Problem:
        """A problem of a swept key; an empty one stands for all."""
        key = swept_key(self.study, self.point, key)
        return Problem(key, value, valid, self.study.origin.file_of(key))

    def runs(self, replicates: Iterable[int]) -> Iterator[Run]:
        """Some replicates of this point."""
        yield from self._replicates(self.scenario, replicates, {}, "sweep")

    def cross_check(self) -> Iterator[Run]:
        """Replicates of this point on the engine that checks it, if this is the point to check."""
        check = self.study.study.cross_check
        if check is None or check.at != self.point:
            return
        own = self.scenario
        if check.vibration_s is not None:
            own = _vibrated_for(check.vibration_s, own)
        engine = own.engine.model_copy(update={"name": check.engine})
        other = own.model_copy(update={"engine": engine})
        number = check.replicates or self.study.study.replicates
        source = {ENGINE: f"cross_check of {self.study.file}"}
        yield from self._replicates(other, range(1, number + 1), source, CROSS_CHECK)
        if own is not self.scenario:
            yield from self._replicates(own, range(1, number + 1), source, CROSS_CHECK_OWN)

    def changed(self, case: Case) -> tuple[Scenario, list[Problem]]:
        """The scenario of a control at this point, and why it cannot be run."""
        scenario = case.change(self.scenario)
        try:
            scenario = validated(Scenario, scenario.model_dump(mode="json"), Origin(), ROOT_KEY)
            wrong = self._misfits(scenario)
        except BadInputError as error:
            wrong = list(error.problems)
        key, control_text = "certificate.controls", f"{case.control} {case.value}"
        return scenario, [
            Problem(key, control_text, f"one with which {p.key}, here {p.value}, is {p.valid}",
                    self.study.file)
            for p in wrong
        ]  # fmt: skip

    def control(self, case: Case, scenario: Scenario, replicates: Iterable[int]) -> Iterator[Run]:
        """Replicates of a control at this point."""
        key = "grain_check" if case is COARSER else "certificate.controls"
        source = {key: f"{case.part} of {self.study.file}"}
        yield from self._replicates(scenario, replicates, source, case.part)

    def _replicates(
        self, base: Any, replicates: Iterable[int], source: dict[str, str], part: Part
    ) -> Iterator[Run]:
        dump = base.model_dump(mode="json")
        parameters = {key: value_at(dump, key) for key in self.point}
        engine = {ENGINE: self.kind.planning.speed_class(base)[0]} if source else {}
        if part.startswith("control"):
            label = f"{letters(part)}_{self.labels.of(by_name(parameters))}"
        else:
            label = self.labels.of(by_name({**engine, **parameters}))
        sources = {**dict(_sources(base, self.origin)), **source}
        own = base.seed
        for replicate in replicates:
            scenario = self.kind.planning.seeded(base, replicate_seed(own, replicate))
            yield Run(
                self.study.name,
                f"{label}_r{replicate}_{scenario_hash(scenario)[:6]}",
                parameters,
                replicate,
                scenario,
                {**sources, "seed": f"replicate {replicate} of seed {own} ({sources['seed']})"},
                part,
            )


def _opener(study: OpenStudy) -> Callable[..., _AtPoint]:
    """Opens points of a study, which share its scenario and get labels of their own."""
    kind = kind_named(study.study.kind)
    labels = Labels(kind.scenario, kind.labels_have_units)
    return partial(_AtPoint, study, study.study.scenario.model_dump(mode="json"), labels)


def _vibrated_for(duration_s: float, scenario: Scenario) -> Scenario:
    """A scene whose last vibration has another duration."""
    last = scenario.vibrations[-1]
    shorter = last.model_copy(update={"duration_s": duration_s})
    stages = tuple(shorter if stage is last else stage for stage in scenario.vibration)
    return scenario.model_copy(update={"vibration": stages})


def swept_key(study: OpenStudy, point: Point, key: str) -> str:
    """Where the value of a swept key at a point stands in the study's file."""
    sweep = study.study.sweep
    place = "sweep.keys"
    if sweep.design == "list":
        number = next((i for i, p in enumerate(sweep.points) if p == point), "")
        place = f"sweep.points.{number}".rstrip(".")
    return f"{place}.{key}".rstrip(".")


def _holds(swept: str, problem_key: str) -> bool:
    """Whether a problem lies at a swept key or below it."""
    return f"{problem_key}.".startswith(f"{ROOT_KEY}.{swept}.")


def _put(tree: Any, parts: list[str], value: Any, origin: Origin, source: str) -> Any:
    """A copy of a tree with one value laid in, as a file would: mappings in sections merge."""

    def below(node: Any, left: list[str], above: str) -> Any:
        name, *rest = left
        if not rest:
            section = node if isinstance(node, dict) else {}
            laid = merge(section, {name: value}, origin, source, above)
            return laid if isinstance(node, dict) else _with(node, name, laid[name])
        inner = node[name] if isinstance(node, dict) else node[int(name)]
        return _with(node, name, below(inner, rest, f"{above}.{name}"))

    return below(tree, parts, ROOT_KEY)


def _with(node: Any, name: str, value: Any) -> Any:
    if isinstance(node, dict):
        return {**node, name: value}
    return [value if i == int(name) else item for i, item in enumerate(node)]


def _sources(section: Section, origin: Origin, above: str = "", group: str | None = None) -> (
    Iterator[tuple[str, str]]
):  # fmt: skip
    """Source of every leaf: what a file states, the file's name, or the default's own source."""
    for name, field in type(section).model_fields.items():
        value, key = getattr(section, name), f"{above}{name}"
        extra = field.json_schema_extra
        # The source of a whole curve holds for its points.
        declared = group or (str(extra["source"]) if isinstance(extra, dict) else None)
        if isinstance(value, Section):
            yield from _sources(value, origin, f"{key}.", declared)
        elif isinstance(value, tuple) and value and isinstance(value[0], Section):
            for i, item in enumerate(value):
                yield from _sources(item, origin, f"{key}.{i}.", declared)
        else:
            stated = origin.source_of(f"{ROOT_KEY}.{key}")
            # What the user alone can give has no source while it is not given.
            yield key, stated or (declared if declared not in (None, "user") else "default")


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
