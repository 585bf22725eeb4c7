"""What runs and whole studies will take: the one place where time is foretold."""

from __future__ import annotations

import contextlib
import heapq
import math
import statistics
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sandmould.definition.run import Run
from sandmould.kinds.kind import CORE_SECONDS, SpeedClass
from sandmould.kinds.registry import kind_of
from sandmould.plain_file import UNREADABLE
from sandmould.runs.columns import WALL_S
from sandmould.runs.manifest import read_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.batches import START_S
from sandmould.study.plan.fills import beside_s, own_work, predicted_s

BEGIN_S = 4.0
"""What Snakemake takes to read its rules, and the study to be planned."""
END_S = 6.0
"""What tables, report and check take once all runs have ended: three jobs."""


@dataclass(frozen=True)
class Piece:
    """Something to compute that keeps some cores busy for a while."""

    wall_s: float
    threads: int = 1


@dataclass(frozen=True)
class Prices:
    """What runs take: by finished ones like them, else by this machine's speed, else fixed."""

    rate_per_s: Mapping[SpeedClass, float] = field(default_factory=dict)
    """Work a second of one core, as measured on this machine."""
    ratios: Mapping[SpeedClass, float] = field(default_factory=dict)
    """Finished runs of a class over what is foretold of them without these."""

    def engine_s(self, run: Run) -> float:
        """Wall time of a run's computation alone."""
        return self.ratios.get(_class_of(run), 1.0) * foretold_s(run, self.rate_per_s)

    def work(self, run: Run) -> float:
        """Work that a run does itself: time is what it is foretold to be, not what was guessed."""
        planning = kind_of(run.scenario).planning
        if planning.work_unit != CORE_SECONDS:
            return own_work(run)
        return self.engine_s(run) * planning.threads(run.scenario)

    def piece(self, run: Run) -> Piece:
        """A run with its process, its deck and its measures."""
        return Piece(
            START_S + self.engine_s(run), kind_of(run.scenario).planning.threads(run.scenario)
        )

    def basis(self, runs: Iterable[Run]) -> str:
        """What the price of some runs rests on."""
        runs = list(runs)
        classes = {_class_of(run) for run in runs}
        if classes <= set(self.ratios):
            return "by finished runs"
        known = {*self.ratios, *self.rate_per_s}
        planning = kind_of(runs[0].scenario).planning
        return planning.speed.basis if planning.speed and classes <= known else planning.guess


def foretold_s(run: Run, rate_per_s: Mapping[SpeedClass, float]) -> float:
    """Wall time of a run's computation by the machine's speed, or by one fixed everywhere."""
    planning, scenario = kind_of(run.scenario).planning, run.scenario
    rate = rate_per_s.get(planning.speed_class(scenario))
    if rate is None:
        return predicted_s(run) + beside_s(run)
    return own_work(run) / rate / planning.threads(scenario) + beside_s(run)


def ratios_of(
    finished: Iterable[tuple[Run, float]], rate_per_s: Mapping[SpeedClass, float]
) -> dict[SpeedClass, float]:
    """How much longer finished runs took than was foretold of them, by class: the median.

    ``finished``, iterable of (Run, float): runs with the wall time of their computation in s.
    """
    found: dict[SpeedClass, list[float]] = {}
    for run, wall_s in finished:
        found.setdefault(_class_of(run), []).append(wall_s / foretold_s(run, rate_per_s))
    return {each: statistics.median(ratios) for each, ratios in found.items()}


def spread_s(pieces: Sequence[Piece], cores: int) -> float:
    """Wall time of pieces that share cores: each begins, in order, once enough cores are free."""
    free_at = [0.0] * max(cores, 1)
    last_s = 0.0
    for piece in pieces:
        taken = [heapq.heappop(free_at) for _ in range(min(piece.threads, len(free_at)))]
        end_s = max(taken) + piece.wall_s
        for _ in taken:
            heapq.heappush(free_at, end_s)
        last_s = max(last_s, end_s)
    return last_s


def study_s(pieces: Sequence[Piece], cores: int) -> float:
    """Wall time of a whole study: its beginning, its runs, its tables and its report."""
    return BEGIN_S + spread_s(pieces, cores) + END_S


def _class_of(run: Run) -> SpeedClass:
    return kind_of(run.scenario).planning.speed_class(run.scenario)


def computed_wall_s(folder: Path) -> float:
    """Wall time that a finished run's computation took; NaN where it failed or none is written."""
    with contextlib.suppress(*UNREADABLE):
        if RunOutcome.read(folder / "outcome.json").outcome is Outcome.FINISHED:
            return float(read_manifest(folder)["cost"][WALL_S])
    return math.nan


class TimeLeft:
    """Foretells from what runs have taken, and learns from each that ends."""

    def __init__(self, runs: Iterable[Run], rate_per_s: Mapping[SpeedClass, float]) -> None:
        """Begin with no finished run.

        ``rate_per_s``: work a second of one core, as measured on this machine.
        """
        self._runs = {run.run: run for run in runs}
        self._rate_per_s = rate_per_s
        self._finished: list[tuple[Run, float]] = []
        self._foreseen: dict[str, float] = {}
        self._prices: Prices | None = None

    def foresee(self, run: str, wall_s: float) -> None:
        """Take in what a run that is being computed will have taken, until one like it ends."""
        self._foreseen[run] = wall_s
        self._prices = None

    def learn(self, run: str, wall_s: float) -> None:
        """Take in what a finished run has taken; ``NaN`` teaches nothing."""
        if wall_s > 0.0 and run in self._runs:
            self._finished.append((self._runs[run], wall_s))
            self._prices = None

    @property
    def prices(self) -> Prices:
        """What runs take by what has been learnt."""
        if self._prices is None:
            foreseen = [(self._runs[run], wall_s) for run, wall_s in self._foreseen.items()]
            ratios = ratios_of(foreseen, self._rate_per_s)
            ratios |= ratios_of(self._finished, self._rate_per_s)
            self._prices = Prices(self._rate_per_s, ratios)
        return self._prices

    def seconds(self, running: Mapping[str, float], waiting: Collection[str], cores: int) -> float:
        """Wall time until the report is written; 0 where no run is left.

        ``running``: runs that are being computed, or stopped on the way, with the share that is
        done.
        """
        pieces = [self._rest(run, share) for run, share in running.items()]
        pieces += [self.prices.piece(self._runs[run]) for run in waiting]
        return spread_s(pieces, cores) + END_S if pieces else 0.0

    def seconds_of(self, run: str, share: float) -> float:
        """Wall time that one run will still take, of which a share is done."""
        return self._rest(run, share).wall_s

    def _rest(self, run: str, share: float) -> Piece:
        whole = self.prices.piece(self._runs[run])
        return Piece((1.0 - min(share, 1.0)) * whole.wall_s, whole.threads)
