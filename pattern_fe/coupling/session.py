"""Sand and pattern as one session: the staggered loop inside ``advance``."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pattern_fe.coupling.body import Answer, ElasticBody
from pattern_fe.coupling.choosing import relaxation_of
from pattern_fe.coupling.gain import measure_gain
from pattern_fe.coupling.ledger import LEDGER, Entry, Ledger, imbalance_n, rms_m, work_of
from pattern_fe.coupling.relaxation import Measured
from pattern_fe.coupling.shapes_file import SHAPES, ShapesFile
from sandmould.engines.session import EngineStop, Session
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.step_counts import StepCounts
from sandmould.runs.outcome import Outcome
from sandmould.scenario.pattern import Loop

Array = NDArray[np.float64]
CHECKPOINT = "pattern.npz"


class CoupledSession:
    """A session whose sand presses on a pattern that gives way; else the engine's own.

    In a window the surface moves evenly to a displacement, the sand's mean load on its vertices is
    taken, the pattern answers with the displacement at rest under it, and the next window moves
    part of the way there. A window may be computed again from the state at its beginning until
    the answer is what was shown. Loads of one way move no surface; with one solve a layer it goes
    to where the loads at the end of the last stage bent the pattern.
    """

    def __init__(
        self,
        inner: Session,
        body: ElasticBody,
        surface: str,
        loop: Loop,
        counts: StepCounts,
        work: Path,
        checkpoint: Path | None = None,
    ) -> None:
        """Start with the pattern at rest, or where a checkpoint left it.

        Parameters
        ----------
        inner : Session
            Of any engine that can move the surface.
        body : ElasticBody
        surface : str
            Its name in the engine, vertex for vertex that of the body.
        loop : Loop
            Of the scenario; one that has windows.
        counts : StepCounts
            Of the scenario.
        work : Path
            Folder of the tables.
        checkpoint : Path, optional
            Folder that ``write_checkpoint`` wrote.
        """
        self._inner = inner
        self._body = body
        self._surface = surface
        self._loop = loop
        self._counts = counts
        self._ends = window_ends(loop.window_s, counts)
        self._relaxation = relaxation_of(loop)
        rest = body.vertices_m
        self._shown = np.zeros_like(rest)
        self._next = np.zeros_like(rest)
        self._answered = np.zeros_like(rest)
        self._load = np.zeros_like(rest)
        self._load_sum, self._load_steps = np.zeros_like(rest), 0
        self._work_j = self._solve_s = 0.0
        self._gain = np.nan
        ledger_bytes, rows = None, 0
        if checkpoint is not None:
            ledger_bytes, rows = self._take_up(checkpoint)
        self._ledger = Ledger(work / LEDGER, ledger_bytes)
        self._shapes = ShapesFile(work / SHAPES, rows, *rest.shape)

    def __getattr__(self, name: str) -> Any:
        """All else is the engine's own."""
        return getattr(self._inner, name)

    @property
    def displacement_m(self) -> Array:
        """Displacement of the surface that the sand sees, (nv, d) float64, m.

        Of loads of one way, which it never sees, where they bend the pattern.
        """
        return self._answered if self._loop.scheme == "one_way" else self._shown

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration, or up to the next record, in windows of the loop."""
        inner = self._inner
        now, record = inner.steps, self._counts.window
        ahead = record - now % record
        if duration_s is not None:
            ahead = self._counts.steps(duration_s)
        end = now + ahead
        while inner.steps < end and not inner.stage_over:
            within = inner.steps % record
            window = int(self._ends[np.searchsorted(self._ends, within, side="right")]) - within
            if within == 0:
                self._load_sum, self._load_steps = np.zeros_like(self._load), 0
                self._measure(window * inner.step_s)
            self._window(min(window, end - inner.steps))
        if inner.is_root:
            self._shapes.write(inner.time_s, self.displacement_m)

    def _measure(self, window_s: float) -> None:
        """Measure the gain anew, at every record: sand that falls, settles or is shaken changes it.

        Without a load the factor stays.
        """
        relaxation = self._relaxation
        if isinstance(relaxation, Measured):
            found = measure_gain(self._inner, self._body, self._surface, self._next, window_s)
            if found is not None:
                self._gain = found.gain
                relaxation.learn(found.limit)

    def _window(self, steps: int) -> None:
        """Compute one window, as often as is asked."""
        loop = self._loop
        kept = self._inner.keep() if loop.most_passes > 1 else None
        start, shown, passes = self._shown, self._next, 0
        self._solve_s = 0.0
        while True:
            told = self._pass(shown, steps * self._inner.step_s)
            passes += 1
            if told is None:  # too short a window for a sample: its load counts in the next
                self._shown = shown
                return
            load, answer, target = told
            residual_m = rms_m(answer.displacement_m - shown)
            if passes == loop.most_passes or residual_m <= loop.tolerance * rms_m(shown):
                break
            self._inner.go_back(kept)
            shown = target
        self._load_sum, self._load_steps = self._load_sum + steps * load, self._load_steps + steps
        self._load = self._load_sum / self._load_steps
        self._work_j += work_of(load, shown - start)
        self._shown = shown
        self._next = self._predicted(start, shown, target)
        self._write(steps, passes, load, answer)
        self._check()

    def _pass(self, shown: Array, window_s: float) -> tuple[Array, Answer, Array] | None:
        """Move the surface through a window; give load, answer and what to show next."""
        inner = self._inner
        inner.move_surface(self._surface, self._body.vertices_m + shown, window_s)
        inner.advance(window_s)
        load = inner.vertex_loads(self._surface)
        if load is None:
            return None
        begun = time.perf_counter()
        answer = self._body.answer(load)
        if self._loop.scheme != "per_layer" or inner.stage_over:
            self._answered = answer.displacement_m
        target = self._relaxation.next(shown.ravel(), self._answered.ravel())
        self._solve_s += time.perf_counter() - begun
        return load, answer, target.reshape(shown.shape)

    def _predicted(self, start: Array, shown: Array, target: Array) -> Array:
        """Where the next window leads: part of the way to the answer, or on as in this one."""
        if self._loop.predicts:
            return np.asarray(target + (shown - start))
        return target

    def _write(self, steps: int, passes: int, load: Array, answer: Answer) -> None:
        shown = self._shown
        self._ledger.write(
            Entry(
                time_s=self._inner.time_s,
                window_s=steps * self._inner.step_s,
                passes=passes,
                factor=self._relaxation.factor,
                gain=self._gain,
                residual_m=rms_m(answer.displacement_m - shown),
                displacement_m=rms_m(shown),
                largest_m=float(np.linalg.norm(shown, axis=1).max()),
                load_n=float(np.linalg.norm(load.sum(axis=0))),
                imbalance_n=imbalance_n(load, answer),
                moment_left_n_m=answer.moment_left_n_m,
                work_j=self._work_j,
                energy_j=answer.energy_j,
                solve_s=self._solve_s,
            )
        )

    def _check(self) -> None:
        """Stop where the next displacement is beyond all bounds.

        Raises
        ------
        EngineStop
        """
        largest_m = float(np.linalg.norm(self._next, axis=1).max())
        if not largest_m <= self._loop.largest_displacement_m:
            raise EngineStop(
                Outcome.COUPLING_DIVERGED,
                f"the pattern is to move by {largest_m:.3g} m, more than pattern.loop."
                f"largest_displacement_m = {self._loop.largest_displacement_m:g}, after "
                f"{self._inner.time_s:.4g} s: a smaller factor or another scheme may hold",
            )

    def snapshot(self) -> Snapshot:
        """State of all grains relative to the box, and the pattern among them."""
        moved_m = self._body.vertices_m + self.displacement_m
        return replace(self._inner.snapshot(), pattern_m=moved_m, pattern_load_n=self._load)

    def write_checkpoint(self, folder: Path) -> None:
        """Write the engine's state and the loop's."""
        self._inner.write_checkpoint(folder)
        size = self._ledger.size()
        self._shapes.flush()
        arrays: dict[str, Any] = {
            "shown": self._shown,
            "next": self._next,
            "answered": self._answered,
            "load": self._load,
            "work_j": self._work_j,
            "gain": self._gain,
            "ledger_bytes": size,
            "rows": self._shapes.rows,
        }
        arrays |= {f"relaxation_{name}": a for name, a in self._relaxation.state().items()}
        np.savez(folder / CHECKPOINT, **arrays)

    def _take_up(self, checkpoint: Path) -> tuple[int, int]:
        """Read what ``write_checkpoint`` wrote; give the trusted parts of the tables."""
        with np.load(checkpoint / CHECKPOINT) as kept:
            self._shown, self._next, self._load = kept["shown"], kept["next"], kept["load"]
            self._answered = kept["answered"]
            self._work_j = float(kept["work_j"])
            self._gain = float(kept["gain"])
            start = "relaxation_"
            memory = {k.removeprefix(start): kept[k] for k in kept.files if k.startswith(start)}
            self._relaxation.restore(memory)
            return int(kept["ledger_bytes"]), int(kept["rows"])

    def close(self) -> None:
        """Close the tables and free the engine."""
        self._ledger.close()
        self._shapes.close()
        self._inner.close()


def window_ends(window_s: float, counts: StepCounts) -> NDArray[np.int64]:
    """Steps of a record at which windows end: about as long as asked, of whole load samples."""
    samples = counts.window // counts.load
    windows = min(samples, max(1, round(counts.window * counts.step_s / window_s)))
    return counts.load * np.rint(np.arange(1, windows + 1) * samples / windows).astype(np.int64)
