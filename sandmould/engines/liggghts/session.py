"""A scenario computed by a living LIGGGHTS: the deck's own blocks, runs cut into windows."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.engines.box_motion import box_motion
from sandmould.engines.deck import Block, Deck
from sandmould.engines.liggghts.grains_file import read_grains
from sandmould.engines.liggghts.process import (
    Conversation,
    LiggghtsDied,
    executable,
    version_of,
)
from sandmould.engines.liggghts.refusals import refuse
from sandmould.engines.liggghts.render import atoms_data, surface_meshes
from sandmould.engines.liggghts.vtk_stress import TriangleLoads, read_triangle_loads
from sandmould.engines.outcome import Outcome
from sandmould.engines.program import Program, Stage
from sandmould.engines.session import Array, EngineStop, RefusedError, Shared, engine_stop
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.step_counts import StepCounts

_SETUP = ("header", "box", "create", "contacts", "motion", "walls", "background", "integration",
          "measures")  # fmt: skip
_LOOP = re.compile(r"^label settling_\d+$.*^label settled_\d+$\n", re.M | re.S)
_VALUE = re.compile(r"^value (\S+)$", re.M)


def around_run(block: Block) -> tuple[str, str]:
    """Commands before and after a block's long run, be it one command or a loop of windows."""
    loop = _LOOP.search(block.text)
    if loop is None:
        return block.around_run()
    return block.text[: loop.start()], block.text[loop.end() :]


class LiggghtsSession:
    """See ``sandmould.engines.session.Session``.

    A checkpoint keeps the history of all contacts, those with meshes included. In the laboratory
    frame one force is lost: at the first step after a checkpoint, whether the run stopped there or
    not, the dashpots of walls see a wall that stands still.
    """

    def __init__(
        self, program: Program, deck: Deck, folder: Path, log: Path, checkpoint: Path | None = None
    ) -> None:
        """Start LIGGGHTS on a deck, afresh or from a checkpoint.

        Parameters
        ----------
        program : Program
        deck : Deck
        folder : Path
            Where the deck and its layers lie.
        log : Path
            LIGGGHTS's own log; files that are read at once lie beside it.
        checkpoint : Path, optional
            Folder that ``write_checkpoint`` wrote.

        Raises
        ------
        RefusedError
        EngineStop
        """
        refuse(program.scenario)
        path = executable()
        version = version_of(path) if path else None
        if path is None or version is None:
            raise EngineStop(
                Outcome.ENGINE_MISSING, "LIGGGHTS cannot be started: apt install liggghts"
            )
        self.version = version
        self._program = program
        self._scenario = program.scenario
        self._blocks = deck.blocks
        self._counts = StepCounts.of(program.scenario)
        self._surfaces = list(surface_meshes(program))
        self._layer_of_id = np.repeat(np.arange(1, len(program.counts) + 1), program.counts)
        self._scratch = tempfile.TemporaryDirectory(prefix="liggghts_", dir=log.absolute().parent)
        self._liggghts = Conversation(path, folder, log)
        self.steps = 0
        self.step_s = self._counts.step_s
        self.stage = program.stages[0]
        self.stage_over = self.at_rest = False
        self._stage_start = self._stage_end = 0
        self._vibration_start: int | None = None
        self._ended_window = False
        self._setup_due = True
        self.grains = 0
        for name in _SETUP:
            if name == "create" and checkpoint is not None:
                self.send(f'read_restart "{checkpoint.absolute()}/liggghts.restart"')
            else:
                self.send(self._blocks[name].text)
        if checkpoint is not None:
            self._take_up(json.loads((checkpoint / "session.json").read_text(encoding="utf-8")))

    def send(self, commands: str) -> str:
        """Execute commands of LIGGGHTS; an error becomes the outcome that fits."""
        try:
            return self._liggghts.say(commands)
        except LiggghtsDied as death:
            raise engine_stop("LIGGGHTS", str(death)) from death

    def values(self, formulas: list[str]) -> list[float]:
        """Numbers that LIGGGHTS's formulas give now, such as ``c_top``."""
        printed = self.send("\n".join(f'print "value $({formula})"' for formula in formulas))
        return [float(word) for word in _VALUE.findall(printed)]

    def _take_up(self, state: dict[str, Any]) -> None:
        """Go on inside the stage of a checkpoint: its commands again, its own start step."""
        stages = {stage.name: stage for stage in self._program.stages}
        self.steps, self.grains = (int(x) for x in self.values(["step", "count(all)"]))
        self.start_stage(stages[state["stage"]])
        self.send(f"variable stage_start equal {state['stage_start']}")
        self._stage_start = state["stage_start"]
        self._stage_end = self._stage_start + self._stage_steps()
        self._vibration_start = state["vibration_start"]
        self._ended_window = True

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self.steps * self.step_s

    @property
    def is_root(self) -> bool:
        """Whether this process writes the files; there is only this one."""
        return True

    def share(self, value: Shared) -> Shared:
        """Give a value to all ranks, of which there is one."""
        return value

    def insert_layer(self, number: int) -> None:
        """Drop a planned layer from over the bed."""
        self.send(self._blocks[f"layer_{number}"].text)
        self.grains = int(self.values(["count(all)"])[0])

    def set_state(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> None:
        """Place all grains now in the box exactly, without contact history."""
        kinds = np.concatenate([layer.class_number for layer in self._program.layers])
        path = Path(self._scratch.name) / "state.data"
        text = atoms_data(
            self._scenario, "a given state", 1, kinds[: self.grains], position_m,
            (velocity_m_s, spin_rad_s),
        )  # fmt: skip
        path.write_text(text, encoding="utf-8")
        self.send(f'delete_atoms group all\nread_data "{path}" add\nrun 0')
        self._setup_due = True

    def _stage_steps(self) -> int:
        if self.stage.vibration is not None:
            return self._counts.vibration(self.stage.vibration)
        return self._counts.steps(self._scenario.fill.settling.longest_s)

    def start_stage(self, stage: Stage) -> None:
        """Begin to settle or to vibrate."""
        self.stage, self.stage_over, self.at_rest = stage, False, False
        self.send(around_run(self._blocks[stage.name])[0])
        self._setup_due = True
        self._stage_start = self.steps
        self._stage_end = self._stage_start + self._stage_steps()
        if stage.counts_as_vibration and self._vibration_start is None:
            self._vibration_start = self._stage_start

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration or up to the next record, not past the end of the stage."""
        now, window = self.steps, self._counts.window
        ahead = window - now % window if duration_s is None else self._counts.steps(duration_s)
        target = min(now + ahead, self._stage_end)
        # Setup computes forces with whole-step velocities; only without it do windows add up to
        # the deck's own run, bit for bit.
        self.send(f"run {target - now} pre {'yes' if self._setup_due else 'no'} post no")
        self._setup_due = False
        self.steps = target
        self._ended_window = self.steps % window == 0
        if self._ended_window and self.stage.layer:
            self.at_rest = self.values(["v_at_rest"])[0] == 1.0
        self.stage_over = self.at_rest or self.steps >= self._stage_end

    def end_stage(self) -> None:
        """Close the stage that is over."""
        self.send(around_run(self._blocks[self.stage.name])[1])

    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box.

        Raises
        ------
        EngineStop
            When grains are missing.
        """
        path = Path(self._scratch.name) / "grains.bin"
        self.send(f'write_dump all custom "{path}" id x y z vx vy vz omegax omegay omegaz radius')
        table = read_grains(path)
        if len(table) != self.grains:
            raise EngineStop(
                Outcome.LOST_GRAINS, f"LIGGGHTS has {len(table)} grains left of {self.grains}"
            )
        d, start = self._scenario.dimension, self._vibration_start
        shift, speed = box_motion(
            self._scenario, self.stage, self.steps - self._stage_start, self.step_s
        )
        return Snapshot(
            time_s=self.time_s,
            vibration_time_s=-1.0 if start is None else (self.steps - start) * self.step_s,
            stage=self.stage.name,
            id=table[:, 0].astype(np.int64),
            layer=self._layer_of_id[: self.grains],
            position_m=table[:, 1 : 1 + d] - shift,
            velocity_m_s=table[:, 4 : 4 + d] - speed,
            spin_rad_s=table[:, 7:10],
            radius_m=table[:, 10],
        )

    def surface_loads(self) -> Mapping[str, Array] | None:
        """Mean force of the sand on each surface over the last window, N."""
        if not self._ended_window:
            return None
        d = self._scenario.dimension
        count = d * len(self._surfaces)
        values = np.array(self.values([f"f_loads[{i + 1}]" for i in range(count)]))
        return dict(zip(self._surfaces, values.reshape(-1, d), strict=True))

    def triangle_loads(self, name: str) -> TriangleLoads:
        """Stress of the sand on each triangle of a surface at this instant, in three dimensions."""
        path = Path(self._scratch.name) / "surface.vtk"
        fields = "stress stresscomponents area id"
        self.send(f'write_dump all mesh/vtk "{path}" {fields} surface_{name}')
        return read_triangle_loads(path)

    def move_surface(self, name: str, vertices_m: Array, window_s: float) -> None:
        """Refuse: meshes of LIGGGHTS move as a whole."""
        raise RefusedError("surface", name, "a rigid surface on engine liggghts")

    def attach_elastic_surface(
        self, name: str, stiffness: Array, mass: Array, damping: Array
    ) -> None:
        """Refuse: meshes of LIGGGHTS are rigid."""
        raise RefusedError("surface", name, "a rigid surface on engine liggghts")

    @property
    def can_checkpoint(self) -> bool:
        """Whether the last advance ended a window and the stage goes on."""
        return self._ended_window and not self.stage_over

    def write_checkpoint(self, folder: Path) -> None:
        """Write LIGGGHTS's restart file and where the stage stands."""
        self.send(f'write_restart "{folder.absolute()}/liggghts.restart"')
        self._setup_due = True
        state = {
            "stage": self.stage.name,
            "stage_start": self._stage_start,
            "vibration_start": self._vibration_start,
        }
        (folder / "session.json").write_text(json.dumps(state), encoding="utf-8")

    def close(self) -> None:
        """End LIGGGHTS."""
        self._liggghts.close()
        self._scratch.cleanup()
