"""How long a study will still take: runs, measures and report; by finished runs first."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from sandmould.definition.run import Run
from sandmould.kinds.kind import SpeedClass
from sandmould.study.plan.price import END_S, Piece, Prices, ratios_of, spread_s


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
