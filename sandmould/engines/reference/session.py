"""A scenario computed by the in-house solver."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.dem import source_hash
from sandmould.dem.solver import NotANumberError
from sandmould.engines.box_motion import box_motion, displacements
from sandmould.engines.deck_lines import obstacle_top_m
from sandmould.engines.outcome import Outcome
from sandmould.engines.program import Program, Stage
from sandmould.engines.reference.model import grains_of, scene_of, solver_of
from sandmould.engines.session import Array, EngineStop, RefusedError, Shared
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.step_counts import StepCounts


class ReferenceSession:
    """See ``sandmould.engines.session.Session``."""

    is_root = True

    def __init__(self, program: Program, checkpoint: Path | None = None) -> None:
        """Set the solver up, afresh or from a checkpoint.

        Parameters
        ----------
        program : Program
        checkpoint : Path, optional
            Folder that ``write_checkpoint`` wrote.
        """
        self._program = program
        self._scenario = program.scenario
        self._counts = StepCounts.of(program.scenario)
        self._layer_of_id = np.repeat(np.arange(1, len(program.counts) + 1), program.counts)
        self.version = source_hash()
        self.step_s = self._counts.step_s
        self.stage = program.stages[0]
        self.stage_over = self.at_rest = False
        self.solver = solver_of(self._scenario, self.stage, self.step_s)
        self._stage_start = self._stage_end = 0
        self._vibration_start: int | None = None
        self._ended_window = False
        self._loads: dict[str, Array] = {}
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

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self.steps * self.step_s

    def share(self, value: Shared) -> Shared:
        """Give back the value: there is one process."""
        return value

    def insert_layer(self, number: int) -> None:
        """Drop a planned layer from over the bed and all obstacles."""
        s = self._scenario
        top = obstacle_top_m(s)
        if self.grains:
            grains = self.solver.grains
            top = max(top, float((grains.position[:, -1] + grains.radius).max()))
        base = top + s.fill.drop_height_m
        layer = self._program.layers[number - 1]
        self.solver.add(grains_of(s, layer, base, self.grains + 1))

    def set_state(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> None:
        """Place all grains now in the box exactly, without contact history."""
        spins = self.solver.grains.spin.shape[1]
        self.solver.place(position_m, velocity_m_s, spin_rad_s[:, 3 - spins :])

    def start_stage(self, stage: Stage) -> None:
        """Begin to settle or to vibrate."""
        self.stage, self.stage_over, self.at_rest = stage, False, False
        self._stage_start = self.steps
        if stage.vibration is None:
            length = self._counts.steps(self._scenario.fill.settling.longest_s)
        else:
            length = self._counts.vibration(stage.vibration)
        self._stage_end = self._stage_start + length
        if stage.counts_as_vibration and self._vibration_start is None:
            self._vibration_start = self._stage_start
        self.solver.scene = scene_of(self._scenario, stage, self.step_s)

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration or up to the next record, not past the end of the stage."""
        now, window = self.steps, self._counts.window
        ahead = window - now % window if duration_s is None else self._counts.steps(duration_s)
        target = min(now + ahead, self._stage_end)
        first = now - self._stage_start - 1
        moved = displacements(self.stage, first, target - now + 2, self.step_s)
        try:
            self.solver.advance(moved)
        except NotANumberError as error:
            raise EngineStop(
                Outcome.UNSTABLE, f"a velocity is not a number after {error} steps"
            ) from error
        self._ended_window = self.steps % window == 0
        if self._ended_window:
            self._loads = self.solver.mean_loads(window)
            self._ask_rest()
        self.stage_over = self.at_rest or self.steps >= self._stage_end

    def _ask_rest(self) -> None:
        """Apply the rest rule of a settling stage, as the decks do."""
        settling = self._scenario.fill.settling
        if not self.stage.layer:
            return
        if self.steps - self._stage_start < self._counts.steps(settling.shortest_s):
            return
        mass = self.solver.grains.mass
        velocity, _ = self.solver.whole_step_velocities(self._body())
        rms = np.sqrt((mass @ (velocity**2).sum(axis=1)) / mass.sum())
        self.at_rest = bool(rms < settling.rms_speed_m_s)

    def end_stage(self) -> None:
        """Close the stage that is over: nothing is left of it."""

    def _body(self) -> float:
        """Acceleration of the box along its direction in the frame of the box, m/s2."""
        if self._scenario.frame == "laboratory":
            return 0.0
        first = self.steps - self._stage_start - 1
        before, now, ahead = displacements(self.stage, first, 3, self.step_s)
        return float(((ahead - now) - (now - before)) / self.step_s**2)

    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box."""
        shift, speed = box_motion(
            self._scenario, self.stage, self.steps - self._stage_start, self.step_s
        )
        grains, start = self.solver.grains, self._vibration_start
        velocity, spin = self.solver.whole_step_velocities(self._body())
        order = np.argsort(grains.id)
        turned = self.solver.orientation[order] if self._scenario.record.orientation else None
        spins = np.zeros((self.grains, 3))
        spins[:, 3 - spin.shape[1] :] = spin[order]
        return Snapshot(
            time_s=self.time_s,
            vibration_time_s=-1.0 if start is None else (self.steps - start) * self.step_s,
            stage=self.stage.name,
            id=grains.id[order],
            layer=self._layer_of_id[: self.grains],
            position_m=grains.position[order] - shift,
            velocity_m_s=velocity[order] - speed,
            spin_rad_s=spins,
            radius_m=grains.radius[order],
            orientation=turned,
        )

    def surface_loads(self) -> Mapping[str, Array] | None:
        """Mean force of the sand on each surface over the last window, N."""
        return self._loads if self._ended_window else None

    def move_surface(self, name: str, vertices_m: Array, window_s: float) -> None:
        """Move a surface's vertices evenly to new places over the next window."""
        try:
            self.solver.surfaces.set_motion(name, vertices_m, window_s, self.step_s)
        except KeyError:
            raise RefusedError("surface", name, "a surface made of facets") from None

    def attach_elastic_surface(
        self, name: str, stiffness: Array, mass: Array, damping: Array
    ) -> None:
        """Refuse: surfaces move as they are told."""
        raise RefusedError("surface", name, "a surface moved by move_surface")

    @property
    def can_checkpoint(self) -> bool:
        """Whether the last advance ended a window and the stage goes on."""
        return self._ended_window and not self.stage_over

    def write_checkpoint(self, folder: Path) -> None:
        """Write the solver's state, of which nothing is lost, and where the stage stands."""
        arrays: dict[str, Any] = self.solver.state()
        np.savez(folder / "solver.npz", **arrays)
        state = {
            "stage": self.stage.name,
            "stage_start": self._stage_start,
            "vibration_start": self._vibration_start,
        }
        (folder / "session.json").write_text(json.dumps(state), encoding="utf-8")

    def _take_up(self, checkpoint: Path) -> None:
        """Go on inside the stage of a checkpoint."""
        state: dict[str, Any] = json.loads(
            (checkpoint / "session.json").read_text(encoding="utf-8")
        )
        with np.load(checkpoint / "solver.npz") as arrays:
            self.solver.restore(dict(arrays))
        stages = {stage.name: stage for stage in self._program.stages}
        self.start_stage(stages[state["stage"]])
        self._stage_end += state["stage_start"] - self._stage_start
        self._stage_start = state["stage_start"]
        self._vibration_start = state["vibration_start"]
        self._ended_window = True

    def close(self) -> None:
        """Free nothing: arrays go with the session."""
