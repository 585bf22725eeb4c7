"""A scenario computed by the in-house solver."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.dem import source_hash
from sandmould.dem.solver import NotANumberError
from sandmould.engines.box_motion import displacements
from sandmould.engines.program import Program
from sandmould.engines.reference.model import grains_of, scene_of, solver_of
from sandmould.engines.session import Array, EngineStop, RefusedError
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.staged_session import StagedSession
from sandmould.engines.step_mover import StepMover
from sandmould.runs.outcome import Outcome


class ReferenceSession(StagedSession):
    """See ``sandmould.engines.session.Session``."""

    def __init__(self, program: Program, checkpoint: Path | None = None) -> None:
        """Set the solver up, afresh or from a checkpoint.

        Parameters
        ----------
        program : Program
        checkpoint : Path, optional
            Folder that ``write_checkpoint`` wrote.
        """
        super().__init__(program)
        self.version = source_hash()
        self.solver = solver_of(self._scenario, self.stage, self.step_s)
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
        top = s.pouring_top_m
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

    def _open(self, gate: str) -> None:
        if self.grains:
            self.solver.remove_surface(gate)
        else:  # about to be restored: there is nothing to list yet
            self.solver.surfaces.remove(gate)

    def _restore(self, checkpoint: Path) -> None:
        with np.load(checkpoint / "solver.npz", allow_pickle=False) as arrays:
            self.solver.restore(dict(arrays))

    def _change_step(self, earlier_s: float, steps: int) -> None:
        self.solver.change_step(earlier_s, steps)

    def _begin_stage(self) -> None:
        self.solver.scene = scene_of(self._scenario, self.stage, self.step_s)

    def _compute_to(self, target: int) -> None:
        first = self.steps - self._stage_start - 1
        moved = displacements(self.stage, first, target - self.steps + 2, self.step_s)
        try:
            self.solver.advance(moved)
        except NotANumberError as error:
            raise EngineStop(
                Outcome.UNSTABLE, f"a velocity is not a number after {error} steps"
            ) from error
        self._check_sums = self.solver.moving.walls.loads.sum(axis=0)
        if self.steps % self._counts.check == 0:
            self._loads = self.solver.mean_loads(self._counts.check)

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
        first = self.steps - self._stage_start - 1
        before, now, ahead = displacements(self.stage, first, 3, self.step_s)
        return float(((ahead - now) - (now - before)) / self.step_s**2)

    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box."""
        grains = self.solver.grains
        velocity, spin = self.solver.whole_step_velocities(self._body())
        order = np.argsort(grains.id)
        turned = self.solver.orientation[order] if self._scenario.record.orientation else None
        spins = np.zeros((self.grains, 3))
        spins[:, 3 - spin.shape[1] :] = spin[order]
        return self._snapshot(
            grains.id[order],
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
        """Copies of the solver's arrays, loads of this check, where the stage stands."""
        loads = self.solver.moving.walls.loads.sum(axis=0)
        state = copy.deepcopy(self.solver.state())
        return state, loads, dict(self._loads), self._stage_state()

    def restore_checkpoint(self, checkpoint: Any) -> None:
        """Compute on from what ``save_checkpoint`` gave."""
        arrays, loads, means, stage = checkpoint
        self.solver.restore(copy.deepcopy(arrays))
        self.solver.moving.walls.loads[0] = loads
        self._loads = dict(means)
        self._restore_stage(stage)

    def _save(self, folder: Path) -> None:
        """Write the solver's state, of which nothing is lost."""
        arrays: dict[str, Any] = self.solver.state()
        np.savez(folder / "solver.npz", **arrays)

    def close(self) -> None:
        """Free nothing: arrays go with the session."""
