"""What sessions do alike whose engine executes the deck's own blocks: LAMMPS and LIGGGHTS."""

from __future__ import annotations

import math
from abc import abstractmethod
from pathlib import Path
from typing import ClassVar

from sandmould.engines.bed_deck import blocks_of
from sandmould.engines.deck import Deck
from sandmould.engines.program import Program
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.staged_session import StagedSession, step_of

_SETUP = ("header", "box", "create", "contacts", "motion", "walls", "background", "integration",
          "measures", "count_on")  # fmt: skip


class DeckSession(StagedSession):
    """A deck executed block by block, its long runs cut at checks."""

    grains = 0
    _restart: ClassVar[str]
    """Name of the engine's own file in a checkpoint."""

    def __init__(self, program: Program, deck: Deck) -> None:
        """Read the deck's blocks; nothing is executed yet."""
        super().__init__(program)
        self._blocks = blocks_of(deck, program.scenario)
        self._setup_due = True

    @abstractmethod
    def send(self, commands: str) -> str | None:
        """Execute commands; an error becomes the outcome that fits."""

    @abstractmethod
    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box."""

    def _set_up(self, checkpoint: Path | None) -> None:
        """Execute all blocks before the first layer, afresh or from a checkpoint."""
        # In the order of the deck: engines count on at different places.
        for name in (name for name in self._blocks if name in _SETUP):
            if name == "create" and checkpoint is not None:
                self.send(f'read_restart "{checkpoint.absolute()}/{self._restart}"')
            elif name != "count_on" or self._counts_on(checkpoint):
                self.send(self._blocks[name].text)

    def _counts_on(self, checkpoint: Path | None) -> bool:
        """Whether a checkpoint was computed with another time step."""
        return checkpoint is not None and step_of(checkpoint) not in (None, self.step_s)

    def _change_step(self, earlier_s: float, steps: int) -> None:
        assert self.steps == steps, "the deck counts on as the session does"

    def _around_run(self) -> tuple[str, str]:
        """Commands of the stage before and after its long run; none of a fill that is over."""
        block = self._blocks.get(self.stage.name)
        return ("", "") if block is None else block.around_run()

    def _open(self, gate: str) -> None:
        self.send(self._blocks[f"open_{gate}"].text)

    def _begin_stage(self) -> None:
        self.send(self._around_run()[0])
        self._setup_due = True

    def _compute_to(self, target: int) -> None:
        # Setup computes forces with whole-step velocities, and a checkpoint forces one. So it comes
        # at fixed steps, as in the deck, whether a file is written there or not.
        due = self._setup_due or self.steps % self._counts.setup == 0
        self.send(f"run {target - self.steps} pre {'yes' if due else 'no'} post no")
        self._setup_due = False

    def end_stage(self) -> None:
        """Close the stage that is over."""
        self.send(self._around_run()[1])
        after = self._blocks.get(f"after_{self.stage.name}")
        if after is not None:
            self.send(after.text)

    def exact_limit_s(self) -> float:
        """Limit of our own solver's contacts where the engine's grains are."""
        snapshot = self.snapshot()  # all ranks take part in gathering
        limit_s = math.inf
        if self.is_root:
            # Compiled code takes a while to load: only runs that ask for it wait.
            from sandmould.engines.bed_limit import limit_of_snapshot_s

            limit_s = limit_of_snapshot_s(self._scenario, self.stage, snapshot, self._opened)
        return self.share(limit_s)

    def _save(self, folder: Path) -> None:
        self.send(f'write_restart "{folder.absolute()}/{self._restart}"')
        self._setup_due = True

    def _restore(self, checkpoint: Path) -> None:
        """Read nothing: it was read before the walls were made, in place of an empty box."""

    def _take_up(self, checkpoint: Path) -> None:
        """Go on inside the stage of a checkpoint."""
        super()._take_up(checkpoint)
        self._tell_stage_start()

    def _tell_stage_start(self) -> None:
        """Give a stage whose commands were executed again its own start step."""
        self.send(f"variable stage_start equal {self._stage_start}")
