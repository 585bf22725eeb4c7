"""The session's side of the force callback: its arrays, its memory, what it is told and asked."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any

import numpy as np

from sandmould.dem.addresses import table_of
from sandmould.dem.contact_law import Law
from sandmould.dem.surfaces import Surfaces
from sandmould.dem.vectors import dim_of
from sandmould.dem.wall_history import new_history
from sandmould.engines.lammps.bridge import (
    COUNTS,
    EXTRACT,
    FIRST_MOVED,
    FIRST_SHOWN,
    GRAIN_ARRAYS,
    HANDLE,
    LAST_STEP,
    LISTED,
    LOAD_EVERY,
    MOVER_CALL,
    MOVER_TABLE,
    ROWS,
    WINDOW,
    Bridge,
    Constants,
)
from sandmould.engines.lammps.callback import address_of
from sandmould.engines.program import Program, Stage, StepCounts, displacements
from sandmould.engines.session import Array, StepMover
from sandmould.engines.solid_surfaces import add_solids

_PER_ROW, _PER_SLOT = ("row_ids", "used"), ("normal", "friction", "rolling")
"""Arrays as long as the rows of the list, or as the slots of all rows; the rest is not in use."""
_WHOLE = ("vertices", "vertex_velocity", "steps_left", "loads")


class SurfaceKernel:
    """Surface contacts and isotropic damping inside one instance of LAMMPS."""

    def __init__(self, lmp: Any, program: Program, skin_m: float) -> None:
        """Prepare the arrays; nothing is called yet.

        ``skin_m``: a list of grains near surfaces serves until a grain has gone so far.
        """
        scenario = program.scenario
        self._lmp = lmp
        self._counts = StepCounts.of(scenario)
        self._in_box_frame = scenario.frame == "box"
        self._surfaces = Surfaces(scenario.dimension)
        add_solids(self._surfaces, scenario.scene)
        d, n = scenario.dimension, sum(program.counts)
        self._dimension = d
        arrays = self._surfaces.arrays
        memory = new_history(dim_of(d), n)
        # LAMMPS' side knows arrays of numbers and of whole numbers alone.
        slots = {k: getattr(memory, k).astype(np.int64) for k in ("first_slot", "used")}
        # The names must live as long as LAMMPS is asked by their addresses.
        self._names = [ctypes.create_string_buffer(name) for name in GRAIN_ARRAYS]
        contact, damping = scenario.laws, scenario.background_damping
        law = Law(**contact.parameters(contact.grain_wall, d, self._counts.step_s))
        constants = Constants(
            damping.nonviscous_translation,
            damping.nonviscous_rotation,
            skin_m,
            self._counts.step_s,
        )
        self._bridge = Bridge(
            counts=np.zeros(COUNTS, dtype=np.int64),
            names=np.array([ctypes.addressof(name) for name in self._names], dtype=np.int64),
            law=np.array(law, dtype=float),
            constants=np.array(constants),
            direction=np.zeros((1, d)),
            displacement=np.zeros(2),
            **arrays._asdict(),
            listed=np.zeros((n, d)),
            listed_vertices=np.zeros_like(arrays.vertices),
            rows=np.zeros(n, dtype=np.int64),
            start=np.zeros(n + 1, dtype=np.int64),
            part=np.zeros(4 * n + 64, dtype=np.int64),
            row_ids=np.zeros(n, dtype=np.int64),
            **(memory._asdict() | slots),
            kind=np.arange(n),
            loads=np.zeros_like(arrays.vertices),
            step_loads=np.zeros_like(arrays.vertices),
            mover_load=np.zeros((0, d)),
            mover_velocity=np.zeros((0, d)),
        )
        counts = self._bridge.counts
        counts[LOAD_EVERY], counts[WINDOW] = self._counts.load, self._counts.check
        counts[HANDLE] = lmp.lmp.value
        extract = ctypes.cast(lmp.lib.lammps_extract_atom, ctypes.c_void_p)
        counts[EXTRACT] = extract.value or 0
        self._table = table_of(self._bridge)

    @property
    def names(self) -> tuple[str, ...]:
        """Surfaces that the callback presses on."""
        return self._surfaces.names

    def register(self, fix: str, what: str) -> None:
        """Let a ``fix external`` call ``press`` or ``damp``."""
        kind = ctypes.CFUNCTYPE(
            None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p
        )
        set_callback = ctypes.cast(self._lmp.lib.lammps_set_fix_external_callback, kind)
        address = address_of(what, self._dimension)
        set_callback(self._lmp.lmp, fix.encode(), address, self._table.ctypes.data)

    def _replace(self, **arrays: Any) -> None:
        """Put other arrays in the place of some; the table stays where LAMMPS knows it."""
        self._bridge = self._bridge._replace(**arrays)
        self._table[:] = table_of(self._bridge)

    def show_motion(self, stage: Stage, stage_start: int, now: int, target: int) -> None:
        """Tell how the box moves up to a step, and give a longer list where one was too short.

        ``stage_start``, ``now``, ``target``: in steps since the run began.
        """
        bridge = self._bridge
        # Contacts of a step feel the velocity since the step before.
        count = target - now + 2
        moved = np.zeros(2)
        if not self._in_box_frame and stage.vibration is not None:
            moved = displacements(stage, now - 1 - stage_start, count, self._counts.step_s)
            bridge.direction[0] = stage.vibration.unit_direction(self._dimension)
        bridge.counts[FIRST_SHOWN] = now - 1
        needed = int(bridge.start[bridge.counts[ROWS]])
        part = bridge.part
        if needed > len(part):
            part = np.zeros(2 * needed, dtype=np.int64)
        self._replace(displacement=moved, part=part)

    def mean_loads(self) -> dict[str, Array]:
        """Mean force of the grains on each surface over the last check, (d,) float64, N."""
        samples = self._counts.check // self._counts.load
        return self._surfaces.forces(self._bridge.loads / samples)

    def load_sums(self, name: str) -> Array:
        """Sum of the loads on a surface's vertices over the samples of this check, N."""
        return self._bridge.loads[self._surfaces.vertices_of(name)].copy()

    def move(self, name: str, vertices_m: Array, window_s: float) -> None:
        """Let a surface move evenly to new vertices from the next step on."""
        self._surfaces.set_motion(name, vertices_m, window_s, self._counts.step_s)

    def attach_mover(self, name: str, mover: StepMover) -> None:
        """Let a surface be moved in every step from the next one on."""
        counts = self._bridge.counts
        counts[MOVER_CALL], counts[MOVER_TABLE] = mover.call, mover.table
        counts[FIRST_MOVED] = self._surfaces.vertices_of(name).start
        self._replace(mover_load=mover.load_n, mover_velocity=mover.velocity_m_s)

    def count_on(self, steps: int) -> None:
        """Let another number of steps count as done."""
        self._bridge.counts[LAST_STEP] = steps

    def forget(self) -> None:
        """Drop the memory of all contacts."""
        self._bridge.used[:] = 0

    def state(self) -> dict[str, Any]:
        """Copies of the memory of the contacts, where the surfaces stand, loads of this check."""
        bridge = self._bridge
        rows = bridge.counts[ROWS]
        slots = bridge.first_slot[rows]
        arrays = {
            "first_slot": bridge.first_slot[: rows + 1],
            **{name: getattr(bridge, name)[:rows] for name in _PER_ROW},
            **{name: getattr(bridge, name)[:slots] for name in _PER_SLOT},
            **{name: getattr(bridge, name) for name in _WHOLE},
        }
        copies = {name: array.copy() for name, array in arrays.items()}
        return {"last_step": int(bridge.counts[LAST_STEP]), **copies}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from what ``state`` gave."""
        bridge = self._bridge
        for name in ("first_slot", *_PER_ROW, *_PER_SLOT, *_WHOLE):
            getattr(bridge, name)[: len(state[name])] = state[name]
        bridge.counts[LAST_STEP] = int(state["last_step"])
        bridge.counts[ROWS] = len(state["row_ids"])
        bridge.counts[LISTED] = 0
