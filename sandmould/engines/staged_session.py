"""What sessions of all engines do alike: stages cut at checks, rest, snapshots, checkpoints."""

from __future__ import annotations

import bisect
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.program import Program, Stage, StepCounts, box_motion
from sandmould.engines.rest import RestWatch
from sandmould.engines.session import Array, RefusedError, Shared, StepMover
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.table_periods import TablePeriod
from sandmould.scenario.fill import Settling
from sandmould.scenario.stages import StageKind
from sandmould.sums import added


class StageState(NamedTuple):
    """How far a session is in its stage, beside the engine's own state."""

    stage_over: bool
    at_rest: bool
    ended_check: bool
    watch: RestWatch
    last_sums: dict[str, tuple[int, int, Array]]
    """See ``StagedSession``."""


def _state_of(checkpoint: Path) -> dict[str, Any]:
    """Where the stage of a checkpoint stands."""
    state: dict[str, Any] = json.loads((checkpoint / "session.json").read_text(encoding="utf-8"))
    return state


def step_of(checkpoint: Path) -> float | None:
    """Time step of a checkpoint, s; those of earlier versions do not say it."""
    return _state_of(checkpoint).get("step_s")


class StagedSession(ABC):
    """A session in one process; see ``sandmould.engines.session.Session``.

    An engine adds how it computes, and what it saves of its own.
    """

    version: str
    _valid_surface: ClassVar[str]
    """What is named as valid where a mover of a surface is refused."""

    def __init__(self, program: Program) -> None:
        """Stand before the first stage."""
        self._program = program
        self._scenario = program.scenario
        self._counts = StepCounts.of(program.scenario)
        self._layer_of_id = np.repeat(program.layer_numbers, program.counts)
        self.step_s = self._counts.step_s
        self._time_at_0_s = 0.0
        """Simulated time at step 0, had the step always been this one."""
        self.stage = program.stages[0]
        self.stage_over = self.at_rest = False
        self._watch = self._new_watch()
        self._stage_start = self._stage_end = 0
        self._vibration_start: int | None = None
        """Step at which vibration began, moved on by every rest: it is no time of vibration."""
        self._ended_check = False
        self._opened: set[str] = set()
        self._last_sums: dict[str, tuple[int, int, Array]] = {}
        """Check, samples and sums of the loads on a surface's vertices when last asked for."""

    @property
    @abstractmethod
    def grains(self) -> int:
        """Grains now in the box."""

    @property
    @abstractmethod
    def steps(self) -> int:
        """Steps since the run began, resumed ones included."""

    @abstractmethod
    def _open(self, gate: str) -> None:
        """Take a plate away."""

    @abstractmethod
    def _begin_stage(self) -> None:
        """Prepare the engine for the stage that begins."""

    @abstractmethod
    def _compute_to(self, target: int) -> None:
        """Compute up to a step of the stage."""

    @abstractmethod
    def _rms_speed_m_s(self) -> float:
        """Root mean square speed of all grains, weighted by mass."""

    @abstractmethod
    def _mean_loads(self) -> Mapping[str, Array]:
        """Mean force of the sand on each surface over the check that has just ended, N."""

    @abstractmethod
    def _vertex_sums(self, name: str) -> tuple[Array, int]:
        """Sum of the loads on vertices over this check, or the one just ended, and its samples."""

    @abstractmethod
    def _save(self, folder: Path) -> None:
        """Write the engine's own state."""

    @abstractmethod
    def _restore(self, checkpoint: Path) -> None:
        """Read what ``_save`` wrote."""

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self._time_at_0_s + self.steps * self.step_s

    @property
    def is_root(self) -> bool:
        """Whether this process writes the files: there is one process."""
        return True

    def share(self, value: Shared) -> Shared:
        """Give back the value: there is one process."""
        return value

    def _stage_steps(self) -> int:
        return self.stage.longest_steps(self._counts)

    def start_stage(self, stage: Stage) -> None:
        """Begin to settle, to flow out, to vibrate or to rest."""
        if stage.opens:
            self._take_away(stage.opens)
        self._start(stage)

    def _take_away(self, gate: str) -> None:
        self._open(gate)
        self._opened.add(gate)

    def _start(self, stage: Stage) -> None:
        if self.stage.kind is StageKind.REST and self._vibration_start is not None:
            self._vibration_start += self.steps - self._stage_start
        self.stage, self.stage_over, self.at_rest = stage, False, False
        self._watch = self._new_watch()
        self._stage_start = self.steps
        self._stage_end = self._stage_start + self._stage_steps()
        if stage.counts_as_vibration and self._vibration_start is None:
            self._vibration_start = self._stage_start
        self._begin_stage()

    def _new_watch(self) -> RestWatch:
        rest = self._scenario.rest
        return RestWatch(rest, rest.speed_limit_m_s(flows=bool(self.stage.opens)))

    @property
    def sand_rests(self) -> bool:
        """Whether the checks of this stage find the sand at rest, held or not."""
        return self.stage.settling is not None and self._watch.sand_rests

    def hold_rest(self, why: str) -> None:
        """Let the stage go on while something else than the sand still moves; see ``Session``."""
        self._watch.hold(why)

    @property
    def rest_sentence(self) -> str:
        """What the last check for rest found."""
        return self._watch.sentence

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration or up to the next check, not past the end of the stage."""
        now, check = self.steps, self._counts.check
        ahead = check - now % check if duration_s is None else self._counts.steps(duration_s)
        target = min(now + ahead, self._stage_end)
        while self.steps < target:
            self._compute_to(min(target, (self.steps // check + 1) * check))
            self._ended_check = self.steps % check == 0
            if self._ended_check and self.stage.settling is not None:
                self._check_rest(self.stage.settling)
            self.stage_over = self.at_rest or self.steps >= self._stage_end
            if self.stage_over:
                return

    def _check_rest(self, settling: Settling) -> None:
        """Let the watch see a check that lies in the stage as a whole."""
        if self.steps - self._counts.check < self._stage_start:
            return
        loads = self.surface_loads() or {}
        support_n = -added(float(force[-1]) for force in loads.values())
        self._watch.check(self._rms_speed_m_s(), support_n, self._weight_n())
        long_enough = self.steps - self._stage_start >= self._counts.steps(settling.shortest_s)
        self.at_rest = long_enough and self._watch.at_rest

    def _weight_n(self) -> float:
        layers = bisect.bisect_right(list(accumulate(self._program.counts)), self.grains)
        return self._program.mass_kg(layers) * self._scenario.gravity_m_s2

    def _snapshot(
        self,
        ids: NDArray[np.int64],
        position_m: Array,
        velocity_m_s: Array,
        spin_rad_s: Array,
        radius_m: Array,
        orientation: Array | None = None,
    ) -> Snapshot:
        """Make a snapshot relative to the box from arrays in the order of ids, in their frame."""
        shift, speed = self._box_motion()
        start = self._vibration_start
        shaken = self._stage_start if self.stage.kind is StageKind.REST else self.steps
        return Snapshot(
            time_s=self.time_s,
            vibration_time_s=math.nan if start is None else (shaken - start) * self.step_s,
            stage=self.stage.name,
            id=ids,
            layer=self._layer_of_id[: self.grains],
            position_m=position_m - shift,
            velocity_m_s=velocity_m_s - speed,
            spin_rad_s=spin_rad_s,
            radius_m=radius_m,
            orientation=orientation,
        )

    def _box_motion(self) -> tuple[Array, Array]:
        """Displacement and velocity of the walls in the frame of the computation."""
        steps = self.steps - self._stage_start
        return box_motion(self._scenario, self.stage, steps, self.step_s)

    def table_periods(self) -> list[TablePeriod]:
        """None: the box moves as it is laid down."""
        return []

    def surface_loads(self) -> Mapping[str, Array] | None:
        """Mean force of the sand on each surface over the last check, N."""
        if not self._ended_check:
            return None
        return {name: f for name, f in self._mean_loads().items() if name not in self._opened}

    def vertex_loads(self, name: str) -> Array | None:
        """Mean force of the sand on each vertex of a surface since the last asking, N."""
        check = (self.steps - 1) // self._counts.check
        sums, samples = self._vertex_sums(name)
        earlier = self._last_sums.get(name)
        self._last_sums[name] = (check, samples, sums)
        if earlier is not None and earlier[0] == check:
            sums, samples = sums - earlier[2], samples - earlier[1]
        return sums / samples if samples else None

    def save_checkpoint(self) -> Any:
        """Refuse: checkpoints are written to disk alone."""
        raise RefusedError("pattern.loop.repeats", "above 0", "0 on this engine")

    def restore_checkpoint(self, checkpoint: Any) -> None:
        """Refuse as ``save_checkpoint`` does."""
        self.save_checkpoint()

    def _stage_state(self) -> StageState:
        """How far the session is in its stage, for a checkpoint in memory."""
        return StageState(
            self.stage_over,
            self.at_rest,
            self._ended_check,
            replace(self._watch),
            dict(self._last_sums),
        )

    def _restore_stage(self, state: StageState) -> None:
        """Stand in the stage as ``_stage_state`` found it."""
        self.stage_over, self.at_rest, self._ended_check = state[:3]
        self._watch = replace(state.watch)
        self._last_sums = dict(state.last_sums)

    def attach_mover(self, name: str, mover: StepMover) -> None:
        """Refuse: this engine calls nobody in its steps."""
        raise RefusedError("surface", name, self._valid_surface)

    def _take_step_over(self, earlier_s: float, earlier_steps: int) -> None:
        """Go on from the end of a stage with another step, at the next step that ends a check."""
        time_s = self._time_at_0_s + earlier_steps * earlier_s
        lasted_s = (earlier_steps - self._stage_start) * earlier_s
        self._change_step(earlier_s, -(-earlier_steps // self._counts.check) * self._counts.check)
        self._time_at_0_s = time_s - self.steps * self.step_s
        self._stage_start = self.steps - self._counts.steps(lasted_s)

    @abstractmethod
    def _change_step(self, earlier_s: float, steps: int) -> None:
        """Compute with the step of the session from now on, after a state restored with another."""

    @property
    def can_checkpoint(self) -> bool:
        """Whether the last advance ended a check and the stage goes on."""
        return self._ended_check and not self.stage_over

    def write_checkpoint(self, folder: Path) -> None:
        """Write the engine's state and where the stage stands."""
        self._save(folder)
        if self.is_root:
            state = {
                "stage": self.stage.name,
                "steps": self.steps,
                "stage_start": self._stage_start,
                "vibration_start": self._vibration_start,
                "checks_at_rest": [self._watch.in_row, self._watch.all_in_row],
                "held": self._watch.held,
                "stage_over": self.stage_over,
                "at_rest": self.at_rest,
                "step_s": self.step_s,
                "time_at_0_s": self._time_at_0_s,
            }
            (folder / "session.json").write_text(json.dumps(state), encoding="utf-8")

    def _take_up(self, checkpoint: Path) -> None:
        """Go on inside the stage of a checkpoint, with the gates of earlier stages open."""
        state = _state_of(checkpoint)
        names = [stage.name for stage in self._program.stages]
        passed = self._program.stages[: names.index(state["stage"]) + 1]
        for stage in passed:
            if stage.opens:
                self._take_away(stage.opens)
        self._restore(checkpoint)
        self._start(passed[-1])
        self._stage_start = state["stage_start"]
        # Earlier versions had one step and one beginning.
        self._time_at_0_s = state.get("time_at_0_s", 0.0)
        earlier_s = state.get("step_s", self.step_s)
        if earlier_s != self.step_s:
            self._take_step_over(earlier_s, state.get("steps", self.steps))
        self._stage_end = self._stage_start + self._stage_steps()
        self._vibration_start = state["vibration_start"]
        self._watch.in_row, self._watch.all_in_row = state["checks_at_rest"]
        self._watch.held = state["held"]
        # Checkpoints of earlier versions were all written within a stage.
        self.stage_over, self.at_rest = state.get("stage_over", False), state.get("at_rest", False)
        self._ended_check = True
