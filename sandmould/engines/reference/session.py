"""A scenario computed by the in-house solver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.dem import source_hash
from sandmould.dem.solver import NotANumberError
from sandmould.dem.table import MountedTable, TableDrive
from sandmould.engines.program import Program, Stage, displacements, start_of_grains
from sandmould.engines.reference.model import grains_of, scene_of, solver_of
from sandmould.engines.session import Array, EngineStop, RefusedError, StepMover
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.staged_session import StagedSession
from sandmould.engines.table_periods import TablePeriod, TablePeriods, window_of
from sandmould.runs.outcome import Outcome
from sandmould.scenario.box import piston_wall
from sandmould.scenario.fill import Settling, slid_away_m
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind
from sandmould.scenario.unbalance import BRAKE_PERIODS, Unbalance
from sandmould.scenario.vibration import STOP_PERIODS, VibrationStage


@dataclass(frozen=True)
class TableMotion:
    """How a table is driven in a stage, or comes to rest in it."""

    vibration: VibrationStage
    """The stage's own, or the last one before it."""
    steps_before: int | None
    """Steps since that vibration began when the stage begins; None where it is long over."""
    stops_smoothly: bool

    @property
    def unbalance(self) -> Unbalance:
        """Table, mounts and rotating masses."""
        assert self.vibration.unbalance is not None
        return self.vibration.unbalance

    def table(self, scenario: Scenario, weight_n: float) -> MountedTable:
        """The table under sand of a weight."""
        direction = self.vibration.unit_direction(scenario.dimension)
        unbalance = self.unbalance
        return MountedTable(
            unbalance.moving_mass_kg,
            unbalance.stiffness_n_m,
            scenario.sand_share(unbalance),
            -weight_n * direction[-1],
        )

    def times_s(self, first: int, count: int, step_s: float) -> Array:
        """Time since the vibration began at some steps of the stage; see ``displacements``."""
        if self.steps_before is None:
            long_over_s = 2 * max(STOP_PERIODS, BRAKE_PERIODS) / self.vibration.frequency_hz
            return np.full(count, self.vibration.whole_duration_s + long_over_s)
        steps = np.arange(first, first + count) + self.steps_before
        times: Array = (steps - 1) * np.float64(step_s)
        return times

    def drive(self, times_s: Array) -> TableDrive:
        """Force and damping at some times since the vibration began.

        Once it is over, a brake brings the damping of the mounts up to the critical one, so that
        the table comes back to its place without swinging.
        """
        stage, unbalance = self.vibration, self.unbalance
        over_s = np.maximum(0.0, times_s - stage.whole_duration_s)
        braked = np.minimum(1.0, over_s * stage.frequency_hz / BRAKE_PERIODS)
        more = max(0.0, unbalance.critical_damping_kg_s - unbalance.damping_kg_s)
        return TableDrive(
            stage.unbalance_forces_at(times_s, self.stops_smoothly),
            unbalance.damping_kg_s + more * 0.5 * (1.0 - np.cos(np.pi * braked)),
        )


def table_motion(program: Program, stage: Stage) -> TableMotion | None:
    """How the table moves in a stage; None where it stands, or moves as laid down."""
    vibration = stage.vibration
    if vibration is not None:
        if vibration.unbalance is None:
            return None
        return TableMotion(vibration, stage.vibration_steps, stage.stops_smoothly)
    before = program.stages[: program.stages.index(stage)] if stage in program.stages else ()
    earlier = [s.vibration for s in before if s.vibration is not None and not s.kind.fills]
    if not earlier or earlier[-1].unbalance is None:
        return None
    return TableMotion(earlier[-1], None, stops_smoothly=False)


class ReferenceSession(StagedSession):
    """See ``sandmould.engines.session.Session``."""

    def __init__(self, program: Program, checkpoint: Path | None = None) -> None:
        """Set the solver up, afresh or from a checkpoint."""
        super().__init__(program)
        self.version = source_hash()
        self.solver = solver_of(self._scenario, self.stage, self.step_s)
        self._motion = table_motion(program, self.stage)
        self._table_speed_m_s = 0.0
        """Largest of the table in the last computation."""
        self._periods = TablePeriods()
        self._ended_periods: list[TablePeriod] = []
        self._loads: dict[str, Array] = {}
        self._check_sums: Array = np.zeros((0, self._scenario.dimension))
        if checkpoint is not None:
            self._take_up(checkpoint)

    @property
    def grains(self) -> int:
        """Grains now in the box."""
        return len(self.solver.grains.id)

    @property
    def steps(self) -> int:
        """Steps since the run began."""
        return self.solver.steps

    def insert_layer(self, number: int) -> None:
        """Drop a planned layer from over the bed and all obstacles."""
        s = self._scenario
        since = self.steps - self._stage_start
        shift, velocity = start_of_grains(s, self.stage, since, self.step_s)
        top = s.pouring_top_m + float(shift[-1])
        if self.grains:
            grains = self.solver.grains
            top = max(top, float((grains.position[:, -1] + grains.radius).max()))
        layer = self._program.layers[number - 1]
        grains = grains_of(s, layer, top - shift[-1] + s.fill.drop_height_m, self.grains + 1)
        grains.position[:] += shift
        grains.velocity[:] += velocity
        self.solver.add(grains)

    def set_state(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> None:
        """Place all grains now in the box exactly, without contact history."""
        spins = self.solver.grains.spin.shape[1]
        self.solver.place(position_m, velocity_m_s, spin_rad_s[:, 3 - spins :])

    def _open(self, gate: str) -> None:
        if self.grains:
            self.solver.remove_surface(gate)
        else:  # about to be restored: there is nothing to list yet
            self.solver.surfaces.remove(gate)

    def start_stage(self, stage: Stage) -> None:
        """Begin a stage, in which a gate may slide away or a wall move as a piston."""
        super().start_stage(stage)
        if stage.kind is StageKind.PRESS:
            self._press(stage.steps * self.step_s)
        if stage.slides:
            gate = self._scenario.gate
            assert gate is not None
            open_m = slid_away_m(gate, self._scenario.dimension)
            self.move_surface(gate.name, open_m, stage.steps * self.step_s)

    def _press(self, time_s: float) -> None:
        """Let the piston go its way from where the wall stands; a lid is put on the box first."""
        s, piston = self._scenario, self._scenario.piston
        assert piston is not None
        begin = piston_wall(piston, s.box, s.dimension, 0.0)
        end = piston_wall(piston, s.box, s.dimension, piston.velocity_m_s * time_s)
        self.solver.surfaces.arrays.vertices[self._vertices_of(begin.name)] = begin.point_m
        self.move_surface(end.name, end.point_m[None], time_s)

    def _restore(self, checkpoint: Path) -> None:
        with np.load(checkpoint / "solver.npz", allow_pickle=False) as arrays:
            self.solver.restore(dict(arrays))
            # Fills that runs share may be older than tables.
            self._periods.steps = arrays.get("table_steps", self._periods.steps)

    def _change_step(self, earlier_s: float, steps: int) -> None:
        self.solver.change_step(earlier_s, steps)

    def _begin_stage(self) -> None:
        self._motion = table_motion(self._program, self.stage)
        stage = self.stage
        if self._motion is not None:
            stage = replace(stage, vibration=self._motion.vibration)
        self.solver.scene = scene_of(self._scenario, stage, self.step_s)

    def _compute_to(self, target: int) -> None:
        first = self.steps - self._stage_start - 1
        try:
            if self._motion is None:
                moved = displacements(self.stage, first, target - self.steps + 2, self.step_s)
                self.solver.advance(moved)
            else:
                self._compute_on_table(target)
        except NotANumberError as error:
            raise EngineStop(
                Outcome.UNSTABLE, f"a velocity is not a number after {error} steps"
            ) from error
        self._check_sums = self.solver.moving.walls.loads.sum(axis=0)
        if self.steps % self._counts.check == 0:
            self._loads = self.solver.mean_loads(self._counts.check)

    def _table(self) -> MountedTable:
        assert self._motion is not None
        return self._motion.table(self._scenario, self._weight_n())

    def _compute_on_table(self, target: int) -> None:
        motion, table = self._motion, self._table()
        assert motion is not None
        first = self.steps - self._stage_start
        times_s = motion.times_s(first, target - self.steps, self.step_s)
        drive = motion.drive(times_s)
        places_m = self.solver.advance_on_table(table, drive)
        self._table_speed_m_s = float(np.abs(np.diff(places_m)).max()) / self.step_s
        if self.stage.counts_as_vibration:
            start = self._vibration_start or 0
            vibration = motion.vibration
            self._ended_periods += self._periods.add(
                self.stage.name,
                vibration.frequency_hz,
                round(vibration.whole_duration_s * vibration.frequency_hz),
                (self._stage_start - start) * self.step_s,
                window_of(table, drive, places_m, times_s, self.step_s),
            )

    def table_periods(self) -> list[TablePeriod]:
        """Periods of a vibration on mounts that have ended since the last asking."""
        ended, self._ended_periods = self._ended_periods, []
        return ended

    def _check_rest(self, settling: Settling) -> None:
        """The same rule, once the table under the sand is slow too."""
        if self._motion is not None and self._table_speed_m_s > self._watch.speed_limit_m_s:
            self.hold_rest(f"the table still moved at {self._table_speed_m_s:.3g} m/s")
        super()._check_rest(settling)

    def _rms_speed_m_s(self) -> float:
        mass = self.solver.grains.mass
        velocity, _ = self.solver.whole_step_velocities(self._body())
        return float(np.sqrt((mass @ (velocity**2).sum(axis=1)) / mass.sum()))

    def end_stage(self) -> None:
        """Close the stage that is over: nothing is left of it."""

    def _body(self) -> float:
        """Acceleration of the box along its direction in the frame of the box, m/s2."""
        if self._scenario.frame == "laboratory":
            return 0.0
        before, now, ahead = self._places_m()
        return float(((ahead - now) - (now - before)) / self.step_s**2)

    def _places_m(self) -> tuple[float, float, float]:
        """Displacement of the box one step ago, now and one step on."""
        first = self.steps - self._stage_start - 1
        if self._motion is None:
            before, now, ahead = displacements(self.stage, first, 3, self.step_s).tolist()
            return before, now, ahead
        push, damping = self._motion.drive(self._motion.times_s(first + 1, 1, self.step_s))
        before, now = self.solver.table_places_m.tolist()
        ahead = self.solver.next_table_place_m(self._table(), float(push[0]), float(damping[0]))
        return before, now, ahead

    def _box_motion(self) -> tuple[Array, Array]:
        if self._motion is None or self._scenario.frame == "box":
            return super()._box_motion()
        before, now, ahead = self._places_m()
        direction = np.array(self.solver.scene.direction)
        return now * direction, (ahead - before) / (2 * self.step_s) * direction

    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box."""
        grains = self.solver.grains
        velocity, spin = self.solver.whole_step_velocities(self._body())
        order = np.argsort(grains.id)
        turned = self.solver.orientation[order] if self._scenario.record.orientation else None
        spins = np.zeros((self.grains, 3))
        spins[:, 3 - spin.shape[1] :] = spin[order]
        return self._snapshot(
            grains.id[order].astype(np.int64),
            grains.position[order],
            velocity[order],
            spins,
            grains.radius[order],
            turned,
        )

    def _mean_loads(self) -> Mapping[str, Array]:
        return self._loads

    def _vertex_sums(self, name: str) -> tuple[Array, int]:
        samples = (self.steps - 1) % self._counts.check + 1
        return self._check_sums[self._vertices_of(name)], samples

    def _vertices_of(self, name: str) -> slice:
        try:
            return self.solver.surfaces.vertices_of(name)
        except KeyError:
            raise RefusedError("surface", name, "a surface made of facets") from None

    def move_surface(self, name: str, vertices_m: Array, window_s: float) -> None:
        """Move a surface's vertices evenly to new places over the next window."""
        self._vertices_of(name)
        self.solver.surfaces.set_motion(name, vertices_m, window_s, self.step_s)

    def attach_mover(self, name: str, mover: StepMover) -> None:
        """Let a surface be moved in every step."""
        self._vertices_of(name)
        self.solver.attach_mover(name, mover)

    def save_checkpoint(self) -> Any:
        """Copies of the solver's arrays with its lists, loads, where the stage stands."""
        solver, periods = self.solver, self._periods.steps
        moving = _copied(solver.moving)
        loads = moving.walls.loads
        loads[0], loads[1:] = loads.sum(axis=0), 0.0
        table = solver.steps, solver.table_places_m, periods
        return moving, table, dict(self._loads), self._stage_state()

    def restore_checkpoint(self, checkpoint: Any) -> None:
        """Compute on from what ``save_checkpoint`` gave."""
        solver = self.solver
        moving, table, means, stage = checkpoint
        solver.moving = _copied(moving)
        solver.surfaces.arrays = solver.moving.walls.arrays
        solver.steps, solver.table_places_m, self._periods.steps = table
        self._loads = dict(means)
        self._restore_stage(stage)

    def exact_limit_s(self) -> float:
        """Limit of all contacts; sparse matrices are loaded for runs that ask for it alone."""
        from sandmould.dem.critical_step import active_contacts, whole_step

        of_step_s = self.step_s if self._scenario.has_step_of_bed else None
        return whole_step(active_contacts(self.solver), of_step_s).damped_s

    def _save(self, folder: Path) -> None:
        """Write the solver's state, of which nothing is lost."""
        arrays: dict[str, Any] = self.solver.state() | {"table_steps": self._periods.steps}
        np.savez(folder / "solver.npz", **arrays)

    def close(self) -> None:
        """Free nothing: arrays go with the session."""


def _copied(part: Any) -> Any:
    """The same with arrays of its own, also in tuples with names within it."""
    if isinstance(part, np.ndarray):
        return part.copy()
    return type(part)(*map(_copied, part)) if hasattr(part, "_fields") else part
