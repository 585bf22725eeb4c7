"""Sand and pattern as one session: the staggered loop inside ``advance``."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.program import StepCounts
from sandmould.engines.session import EngineStop, SandSession
from sandmould.pattern_fe.coupling.body import ElasticBody, StaticSolution
from sandmould.pattern_fe.coupling.convergence_log import (
    WindowEntry,
    force_n,
    imbalance_n,
    rms_m,
    work_of,
)
from sandmould.pattern_fe.coupling.gain import measure_gain
from sandmould.pattern_fe.coupling.pattern_session import PatternSession
from sandmould.pattern_fe.coupling.relaxation import (
    STRUCK,
    AitkenRelaxation,
    MeasuredRelaxation,
    relaxation_of,
)
from sandmould.pattern_fe.large_displacement import LoadNotReachedError
from sandmould.pattern_fe.surroundings import Surroundings
from sandmould.runs.outcome import Outcome
from sandmould.scenario.pattern import TOO_SOFT, Loop

Array = NDArray[np.float64]
GOES_ON = 0.7
"""Part of the way of the last window that the first iteration of the next one adds, where windows
are iterated: a surface that moves evenly is met sooner, and below 1 it comes to rest."""
GAIN_EVERY_S = 0.02
"""About how often the gain is measured, at checks: it costs two windows."""


@dataclass(frozen=True)
class _Iteration:
    """What an iteration of a window found."""

    displacement_m: Array
    """(nv, d) float64, m: at the interface, at the end of the window."""
    load_n: Array
    """(nv, d) float64, N: mean of the sand on the vertices."""
    solution: StaticSolution
    next_m: Array
    """(nv, d) float64, m: displacement of the next iteration, or towards the next window."""

    @property
    def residual_m(self) -> float:
        """What the solution is off the displacement, root of the mean square."""
        return rms_m(self.solution.displacement_m - self.displacement_m)


class CoupledSession(PatternSession):
    """A session whose sand presses on a pattern that gives way; else the engine's own.

    Two participants, sand and pattern, are coupled in windows. In a window the surface between
    them, the interface, moves evenly to a displacement, the sand's mean load on its vertices is
    taken (conservative: force and moment are kept), the pattern is solved at rest under it, and the
    next window moves part of the way to that displacement (consistent: vertex for vertex). A window
    may be iterated, computed again from its checkpoint, until the solution is the displacement at
    the interface. One whose last iteration is far off is the one that came nearest: a surface that
    strikes the sand would throw it. Loads of one way move no surface; by layers it stands still
    until the sand rests, and then goes to where the loads bend the pattern.
    """

    def __init__(
        self,
        sand: SandSession,
        body: ElasticBody,
        surface: str,
        loop: Loop,
        counts: StepCounts,
        work: Path,
        checkpoint: Path | None = None,
        load_tolerance: float | None = None,
        surroundings: Surroundings | None = None,
    ) -> None:
        """Start with the pattern at rest, or where a checkpoint left it.

        Parameters
        ----------
        sand, body, surface, load_tolerance
            See ``PatternSession``; the engine can move the surface.
        loop : Loop
            Of the scenario; one that has windows.
        surroundings : Surroundings, optional
            What the surface must not enter, wherever a scheme leads it.
        """
        tolerance = load_tolerance if loop.scheme != "one_way" else None
        super().__init__(sand, body, surface, tolerance)
        self._surroundings = surroundings
        self._loop = loop
        self._counts = counts
        self._ends = window_ends(loop.window_s, counts)
        checks = round(GAIN_EVERY_S / (counts.check * counts.step_s))
        self._gain_steps = counts.check * max(1, checks)
        self._relaxation = relaxation_of(loop)
        rest = np.zeros_like(body.vertices_m)
        self._interface = rest
        """Displacement at the interface, which the sand meets, m."""
        self._next = rest
        """Displacement to which the next window leads, m."""
        self._solved = rest
        """Displacement of the pattern's last solution that counts, m."""
        self._load_sum, self._load_steps = rest, 0
        self._work_j = self._contact_j = self._solve_s = 0.0
        self._gain = np.nan
        self._begin(work, checkpoint)

    @property
    def displacement_m(self) -> Array:
        """Displacement at the interface, (nv, d) float64, m.

        Of loads of one way, which move no interface, where they bend the pattern.
        """
        return self._solved if self._loop.scheme == "one_way" else self._interface

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration, or up to the next check, in windows of the loop.

        Raises
        ------
        EngineStop
            Also where the pattern finds no equilibrium, or is to move too far.
        """
        try:
            self._advance(duration_s)
        except LoadNotReachedError as fault:
            detail = f"after {self.sand.time_s:.4g} s {fault}"
            raise EngineStop(Outcome.NO_EQUILIBRIUM, detail) from fault

    def _advance(self, duration_s: float | None) -> None:
        sand = self.sand
        now, check = sand.steps, self._counts.check
        ahead = check - now % check
        if duration_s is not None:
            ahead = self._counts.steps(duration_s)
        end = now + ahead
        while sand.steps < end and not sand.stage_over:
            within = sand.steps % check
            window = int(self._ends[np.searchsorted(self._ends, within, side="right")]) - within
            if within == 0:
                self._load_sum, self._load_steps = np.zeros_like(self._load), 0
            if sand.steps % self._gain_steps == 0:
                self._measure(window * sand.step_s)
            self._window(min(window, end - sand.steps))
        if sand.is_root:
            self._shapes.write(sand.time_s, self.displacement_m)

    def _measure(self, window_s: float) -> None:
        """Measure the gain anew, which moving sand changes; without a load the factor stays."""
        relaxation = self._relaxation
        if isinstance(relaxation, MeasuredRelaxation):
            measured = measure_gain(self.sand, self._body, self._surface, self._next, window_s)
            if measured is not None:
                self._gain = measured.gain
                relaxation.set_limit(measured.limit)

    def _window(self, steps: int) -> None:
        """Compute one window, in as many iterations as its residual needs."""
        loop = self._loop
        checkpoint = self.sand.save_checkpoint() if loop.most_passes > 1 else None
        # Where sand rests the noise is the loop's own: it is computed to the share asked of rest.
        tolerance = min(loop.tolerance, self._rest.share if self.sand.sand_rests else np.inf)
        start, displacement, iterations = self._interface, self._next, 0
        self._solve_s = 0.0
        self._relaxation.begin_window(loop.most_passes > 1)
        nearest: _Iteration | None = None
        while True:
            iteration = self._iterate(displacement, steps * self.sand.step_s)
            iterations += 1
            if iteration is None:  # too short a window for a sample: its load counts in the next
                self._interface = displacement
                return
            ahead = iteration.next_m
            if iteration.residual_m <= tolerance * rms_m(displacement):
                break
            least_m = np.inf if nearest is None else nearest.residual_m
            if iterations == loop.most_passes:
                if nearest is not None and iteration.residual_m > STRUCK * least_m:
                    iteration = nearest
                    self.sand.restore_checkpoint(checkpoint)
                    self._sand_load(iteration.displacement_m, steps * self.sand.step_s)
                    self._solved = iteration.solution.displacement_m
                break
            if self._relaxation.keeps_nearest and iteration.residual_m < least_m:
                nearest = iteration
            self.sand.restore_checkpoint(checkpoint)
            displacement = ahead
        self._take(start, steps, iteration)
        if checkpoint is not None and self._relaxation.keeps_nearest:
            ahead = self._outside(ahead + GOES_ON * (self._interface - start))
        self._next = ahead
        self._write(steps, iterations, iteration)
        self._check()

    def _take(self, start: Array, steps: int, iteration: _Iteration) -> None:
        """Count the iteration that ends a window: its loads, its work, its displacement."""
        displacement, load = iteration.displacement_m, iteration.load_n
        self._load_sum, self._load_steps = self._load_sum + steps * load, self._load_steps + steps
        self._load = self._load_sum / self._load_steps
        self._work_j += work_of(load, displacement - start)
        if iteration.solution.contact_n is not None:
            self._contact_j -= work_of(iteration.solution.contact_n, displacement - start)
        self._interface = displacement
        self._rest.see(displacement, iteration.solution.displacement_m)

    def _iterate(self, displacement: Array, window_s: float) -> _Iteration | None:
        """Move the interface through a window, and solve the pattern; None without a load."""
        sand, load = self.sand, self._sand_load(displacement, window_s)
        if load is None:
            return None
        begun = time.perf_counter()
        solution = self._body.solve(load)
        if self._loop.scheme != "per_layer" or sand.sand_rests or sand.stage_over:
            self._solved = solution.displacement_m
        if isinstance(self._relaxation, AitkenRelaxation):
            self._relaxation.is_calm = sand.sand_rests and self._loop.most_passes == 1
        relaxed = self._relaxation.next(displacement.ravel(), self._solved.ravel())
        self._solve_s += time.perf_counter() - begun
        next_m = self._outside(relaxed.reshape(displacement.shape))
        return _Iteration(displacement, load, solution, next_m)

    def _sand_load(self, displacement: Array, window_s: float) -> Array | None:
        """Mean load of the sand on the vertices while the interface moves through a window, N."""
        self.sand.move_surface(self._surface, self._body.vertices_m + displacement, window_s)
        self.sand.advance(window_s)
        return self.sand.vertex_loads(self._surface)

    def _outside(self, displacement: Array) -> Array:
        """A displacement that enters nothing: steps beyond the solution may lead into a wall."""
        around = self._surroundings
        return displacement if around is None else around.pushed_out(displacement)

    def _write(self, steps: int, iterations: int, iteration: _Iteration) -> None:
        displacement, load, solution = self._interface, iteration.load_n, iteration.solution
        self._log.write(
            WindowEntry(
                time_s=self.sand.time_s,
                window_s=steps * self.sand.step_s,
                passes=iterations,
                factor=self._relaxation.factor,
                gain=self._gain,
                residual_m=iteration.residual_m,
                displacement_m=rms_m(displacement),
                largest_m=float(np.linalg.norm(displacement, axis=1).max()),
                load_n=float(np.linalg.norm(load.sum(axis=0))),
                imbalance_n=imbalance_n(load, solution),
                moment_left_n_m=solution.moment_left_n_m,
                work_j=self._work_j,
                energy_j=solution.energy_j,
                solve_s=self._solve_s,
                contact_n=force_n(solution.contact_n),
                contact_j=self._contact_j,
            )
        )

    def _check(self) -> None:
        """Stop where the next displacement is beyond all bounds."""
        largest_m = float(np.linalg.norm(self._next, axis=1).max())
        if not largest_m <= self._loop.largest_displacement_m:
            raise EngineStop(
                Outcome.COUPLING_DIVERGED,
                f"the pattern is to move by {largest_m:.3g} m, more than pattern.loop."
                f"largest_displacement_m = {self._loop.largest_displacement_m:g}, after "
                f"{self.sand.time_s:.4g} s: {TOO_SOFT}; or take a smaller factor or another scheme",
            )

    def _state(self) -> dict[str, Array]:
        memory = {f"relaxation_{name}": a for name, a in self._relaxation.state().items()}
        return memory | {  # names on disk: paused runs of an earlier version go on
            "shown": self._interface,
            "next": self._next,
            "answered": self._solved,
            "work_j": np.array(self._work_j),
            "contact_j": np.array(self._contact_j),
            "gain": np.array(self._gain),
        }

    def _take_up(self, state: dict[str, Array]) -> None:
        self._interface, self._next, self._solved = state["shown"], state["next"], state["answered"]
        self._work_j, self._contact_j = float(state["work_j"]), float(state["contact_j"])
        self._gain = float(state["gain"])
        start = "relaxation_"
        memory = {k.removeprefix(start): a for k, a in state.items() if k.startswith(start)}
        self._relaxation.restore(memory)


def window_ends(window_s: float, counts: StepCounts) -> NDArray[np.int64]:
    """Steps of a check at which windows end: about as long as asked, of whole load samples."""
    samples = counts.check // counts.load
    windows = min(samples, max(1, round(counts.check * counts.step_s / window_s)))
    return counts.load * np.rint(np.arange(1, windows + 1) * samples / windows).astype(np.int64)
