"""Take a scenario through its program: layers, rest, vibration; record, guard, checkpoint."""

from __future__ import annotations

import errno
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType

from sandmould.engines.bed_step import MOST_AGAIN, limit_moments, limit_notes, with_bed_step
from sandmould.engines.durations import cost_before, grain_steps, run_s
from sandmould.engines.guard import Guard
from sandmould.engines.program import Program, Stage, StepCounts, build_program
from sandmould.engines.recording import Recorder
from sandmould.engines.registry import engine_of
from sandmould.engines.rest import what_blocks
from sandmould.engines.session import EngineStop, Session
from sandmould.runs import checkpoint_folders as checkpoints
from sandmould.runs.checkpoint_folders import CheckpointMark
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import Cost, cpu_time_s, peak_memory_bytes
from sandmould.runs.progress import Progress

DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
"""What a disk says that takes no more; other errors of the system are errors of a program."""


Opening = Callable[[Program, Path, Path, Path | None], Session]
"""Opens a session on a rendered deck: program, folder, log, checkpoint to go on from."""


class Driver:
    """One run from its newest checkpoint, or from its beginning, to its outcome."""

    def __init__(
        self,
        program: Program,
        folder: Path,
        name: str,
        scenario_hash: str,
        open_session: Opening | None = None,
        keeps_end: bool = False,
        write_deck: Callable[[Program], None] | None = None,
    ) -> None:
        """Prepare a run.

        Parameters
        ----------
        folder : Path
            Holds the deck; partial work goes to its ``work`` folder.
        scenario_hash : str
            Tells this scenario's checkpoints from those of another.
        open_session : Opening, optional
            Opens something that acts as a session; by default the scenario's engine.
        keeps_end : bool
            Whether a checkpoint of the end is a product, from which other runs go on.
        write_deck : callable, optional
            Writes the deck of a program again, once the filled bed has given its time step.
        """
        self._open_session = open_session or engine_of(program.scenario).open_session
        self._planned = program
        self._bed_limit_s: float | None = None
        self._moments: list[int] = []
        self._write_deck = write_deck
        self._folder = folder
        self._work = folder / "work"
        self._work.mkdir(parents=True, exist_ok=True)
        self._hash = scenario_hash
        self._name, self._keeps_end = name, keeps_end
        self._shared_stages = 0
        self._follow(program)
        self._stop_requested = False
        self._recorder: Recorder | None = None
        self.is_root = True
        """Whether this process writes the products; known once the engine has started."""
        self.cost = cost_before(program.scenario)
        self._simulated_s = 0.0

    def _follow(self, program: Program) -> None:
        """Go by a program and its time step from now on."""
        self._program = program
        self._scenario = program.scenario
        self._guard = Guard(program.scenario)
        counts, record = StepCounts.of(program.scenario), program.scenario.record
        self._check_steps, self._record_steps = counts.check, counts.record
        self._snapshot_steps = counts.records(record.snapshot_every_s)
        self._checkpoint_steps = counts.checkpoints(
            record.checkpoint_every_s,
            at_setups=engine_of(program.scenario).CAPABILITIES.checkpoints_at_setups,
        )

    def _take_step_of_bed(self, limit_s: float) -> None:
        """Go on with the time step that the filled bed gives, and say so in cost and deck."""
        self._bed_limit_s = limit_s
        self._follow(build_program(with_bed_step(self._planned.scenario, limit_s)))
        self._moments = limit_moments(self._program)
        now = cost_before(self._scenario)
        self.cost.time_step_s = now.time_step_s
        self.cost.time_step_fraction = now.time_step_fraction
        self.cost.bed_limit_s = limit_s
        if self._write_deck is not None:
            self._write_deck(self._program)

    def run(self) -> RunOutcome:
        """Compute to the end, to the wall-time limit or to what stops it.

        A restartable outcome leaves a checkpoint: the same command continues.
        """

        def ask_to_stop(number: int, frame: FrameType | None) -> None:
            self._stop_requested = True

        signal.signal(signal.SIGTERM, ask_to_stop)
        newest, notes = checkpoints.newest_checkpoint(self._work)
        if newest is not None and newest[1].scenario_hash != self._hash:
            aside = checkpoints.set_aside(self._work, newest[1])
            notes.append(
                f"checkpoints of another scenario were set aside in {aside.name} and left unused"
            )
            newest = None
        mark = newest[1] if newest else None
        if mark is not None:
            self.cost = Cost(**mark.cost)
            self._shared_stages = mark.shared_stages
            self._simulated_s = self.cost.steps * self.cost.time_step_s
        outcome, detail = Outcome.FINISHED, ""
        self._earlier = (self.cost.wall_s, self.cost.cpu_s)
        self._begun, self._cpu_begun = time.monotonic(), cpu_time_s()
        try:
            while not self._go_on(newest):
                newest, _ = checkpoints.newest_checkpoint(self._work)
        except EngineStop as stop:
            outcome, detail = stop.outcome, stop.detail
        except OSError as error:
            if error.errno not in DISK_ERRORS:
                raise
            where = f": {error.filename}" if error.filename else ""
            outcome, detail = Outcome.DISK_REFUSED, f"{error.strerror}{where}"
        detail = "; ".join(said for said in (detail, *limit_notes(self.cost), *notes) if said)
        return RunOutcome(outcome, detail, self._simulated_s, run_s(self._program))

    def _go_on(self, newest: tuple[Path, CheckpointMark] | None) -> bool:
        """Compute from a checkpoint or the beginning; False where the bed gives another step."""
        mark = newest[1] if newest else None
        if mark is not None and mark.bed_limit_s is not None:
            self._take_step_of_bed(mark.bed_limit_s)
        own = grain_steps(self._program, self._shared_stages)
        self._progress = Progress(self._name, self._work, own)
        self._progress.earlier_cpu_s = self._earlier[1]
        session: Session | None = None
        try:
            session = self._open_session(
                self._program,
                self._folder,
                self._work / "engine.log",
                newest[0] if newest else None,
            )
            self.is_root = session.is_root
            if session.is_root:
                if newest is not None and mark is not None and self._at_end_of_fill(mark):
                    checkpoints.keep_filled(self._work, newest)
                self._recorder = Recorder(self._work, self._scenario.dimension, mark)
            return self._go(session, mark)
        finally:
            self._end(session)

    def _at_end_of_fill(self, mark: CheckpointMark) -> bool:
        """Whether a checkpoint is where the filled bed has given its step."""
        end = self._program.stages[self._program.fill_stages - 1]
        return mark.bed_limit_s is not None and mark.stage == end.name

    def _read_clocks(self) -> None:
        self.cost.wall_s = self._earlier[0] + time.monotonic() - self._begun
        self.cost.cpu_s = self._earlier[1] + cpu_time_s() - self._cpu_begun
        self.cost.peak_memory_bytes = max(self.cost.peak_memory_bytes, peak_memory_bytes())

    def _end(self, session: Session | None) -> None:
        if self._recorder is not None:
            self._recorder.close()
        if session is not None:
            self.cost.version = session.version
            session.close()
        # Last, since the time of an engine of its own process counts once that has ended.
        self._read_clocks()

    def _go(self, session: Session, mark: CheckpointMark | None) -> bool:
        self._simulated_s = session.time_s
        names = [stage.name for stage in self._program.stages]
        first = names.index(mark.stage) if mark else 0
        for number, stage in enumerate(self._program.stages[first:], start=first):
            if mark is None or number > first:
                self._begin_stage(session, stage)
            self._guard.start_stage(stage, session.snapshot())
            while not session.stage_over:
                if not self._window(session):
                    return False
            self._check_rest(session, stage)
            ends_fill = self._keeps_end and stage is self._program.stages[-1]
            takes_step = self._scenario.takes_step_of_bed and self._bed_limit_s is None
            finds_limit = takes_step and (
                ends_fill or number + 1 == self._program.fill_stages < len(self._program.stages)
            )
            if finds_limit:
                self.cost.bed_limit_s = self._bed_limit_s = session.exact_limit_s()
            if ends_fill:
                self._write_end(session)
            elif finds_limit:
                self._write_next(session)
                session.share(None)  # no rank looks for the checkpoint before it is sealed
                return False
            session.end_stage()
        if session.is_root:
            self._show(session, last=True)
        return True

    def _check_rest(self, session: Session, stage: Stage) -> None:
        """Stop where the sand did not come to rest, or came to rest before it had flowed out."""
        settling = stage.settling
        if settling is not None and not session.at_rest:
            what = "the sand"
            if stage.layer:
                what = f"layer {self._program.layer_numbers[stage.layer - 1]}"
            longest_s = settling.longest_s - stage.stop_s
            raise EngineStop(
                Outcome.NOT_SETTLED,
                f"{what} was not at rest after {stage.longest_key} = {longest_s:g}; "
                f"{session.rest_sentence}",
            )
        if stage.opens and settling is not None:
            why = what_blocks(self._scenario, session.snapshot())
            if why:
                raise EngineStop(Outcome.NO_FLOW, why)

    def _begin_stage(self, session: Session, stage: Stage) -> None:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        snapshot = session.snapshot()  # all ranks take part in gathering
        if (
            stage.counts_as_vibration or stage.opens or stage.slides
        ) and self._recorder is not None:
            self._recorder.save(snapshot)

    def _window(self, session: Session) -> bool:
        """Compute up to the next check, and record it; False where the bed became too stiff."""
        before, cost = session.steps, self.cost
        if session.stage.counts_as_vibration and cost.limit_moments < len(self._moments):
            self._find_limits(session)
            if self._begins_again(session):
                return False
        self._advance(session)
        self._simulated_s = session.time_s
        cost.grains = session.grains
        cost.grain_steps += session.grains * (session.steps - before)
        cost.steps += session.steps - before
        snapshot = session.snapshot()
        health = self._guard.check(snapshot)
        cost.largest_overlap_fraction = max(
            cost.largest_overlap_fraction, health.largest_overlap_fraction
        )
        loads = session.surface_loads()
        ended_record = session.steps % self._record_steps == 0
        if self._recorder is not None:
            self._recorder.add_loads(loads)
            self._recorder.add_periods(session.table_periods())
            if ended_record or session.stage_over:
                self._recorder.record(snapshot, health)
            if session.steps % self._snapshot_steps == 0 or session.stage_over:
                self._recorder.save(snapshot)
            self._show(session)
        if ended_record:
            self._checkpoint_if_due(session)
        return True

    def _advance(self, session: Session, duration_s: float | None = None) -> None:
        began = time.monotonic()
        session.advance(duration_s)
        self.cost.engine_wall_s += time.monotonic() - began

    def _find_limits(self, session: Session) -> None:
        """Find the exact limit at the moments that lie before the next check."""
        cost, step_s = self.cost, session.step_s
        now = round(session.snapshot().vibration_time_s / step_s)
        check = now + self._check_steps - session.steps % self._check_steps
        for moment in self._moments[cost.limit_moments :]:
            if moment >= check or session.stage_over:
                return
            if moment > now:
                self._advance(session, (moment - now) * step_s)
                now = moment
            limit_s, least_s = session.exact_limit_s(), cost.least_limit_s
            cost.least_limit_s = limit_s if least_s is None else min(limit_s, least_s)
            cost.limit_moments += 1

    def _begins_again(self, session: Session) -> bool:
        """Go back to the end of the fill where the limit fell below a step taken from the bed."""
        cost, least_s = self.cost, self.cost.least_limit_s
        own = not self._planned.scenario.time_step.bed_fraction
        stays = least_s is None or least_s >= session.step_s or own
        if least_s is None or stays or cost.begun_again == MOST_AGAIN:
            return False
        cost.begun_again += 1
        cost.least_limit_s, cost.limit_moments = None, 0
        if session.is_root:
            why = f"the limit of the shaken bed fell to {least_s:.4g} s, below its time step"
            print(f"{self._name}: {why}; it begins again from its fill", file=sys.stderr)
            checkpoints.begin_again(self._work, least_s, cost.row())
        session.share(None)  # no rank looks for the checkpoint before it is sealed
        return True

    def _show(self, session: Session, last: bool = False) -> None:
        rate = self.cost.grain_steps / max(self.cost.engine_wall_s, 1e-9)
        self._progress.show(
            session.stage.name, session.time_s, self.cost.grain_steps, rate, last=last
        )

    def _checkpoint_if_due(self, session: Session) -> None:
        if not session.can_checkpoint:
            return
        limit_s = self._scenario.guard.wall_limit_s or float("inf")
        stop = session.share(self._stop_requested or time.monotonic() - self._begun > limit_s)
        if not stop and session.steps % self._checkpoint_steps:
            return
        self._write_next(session)
        if stop:
            why = "the system asked" if self._stop_requested else "guard.wall_limit_s came"
            raise EngineStop(
                Outcome.OUT_OF_WALL_TIME, f"stopped at {session.time_s:.4g} s because {why}"
            )

    def _write_next(self, session: Session) -> None:
        """Write a checkpoint: all ranks into the one folder that the first has emptied."""
        folder = checkpoints.next_folder(self._work) if session.is_root else self._work
        self._write_checkpoint(session, session.share(folder))

    def _write_end(self, session: Session) -> None:
        """Write the checkpoint that other runs go on from."""
        folder = self._work / checkpoints.END_CHECKPOINT
        if session.is_root:
            checkpoints.empty(folder)
        self._write_checkpoint(session, session.share(folder))

    def _write_checkpoint(self, session: Session, folder: Path) -> None:
        session.write_checkpoint(folder)
        if self._recorder is None:
            return
        self._read_clocks()
        series_bytes, loads_bytes, table_bytes = self._recorder.sizes()
        checkpoints.seal(
            folder,
            CheckpointMark(
                self._hash,
                session.stage.name,
                session.steps,
                self._recorder.snapshots,
                series_bytes,
                loads_bytes,
                self.cost.row(),
                self._shared_stages,
                self._bed_limit_s,
                table_bytes=table_bytes,
            ),
        )
