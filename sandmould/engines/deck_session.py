"""What sessions do alike whose engine executes the deck's own blocks: LAMMPS and LIGGGHTS."""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path
from typing import ClassVar

from sandmould.engines.deck import Deck
from sandmould.engines.program import Program
from sandmould.engines.staged_session import StagedSession

_SETUP = ("header", "box", "create", "contacts", "motion", "walls", "background", "integration",
          "measures")  # fmt: skip


class DeckSession(StagedSession):
    """A deck executed block by block, its long runs cut at checks."""

    grains = 0
    _restart: ClassVar[str]
    """Name of the engine's own file in a checkpoint."""

    def __init__(self, program: Program, deck: Deck) -> None:
        """Read the deck's blocks; nothing is executed yet.

        Parameters
        ----------
        program : Program
        deck : Deck
        """
        super().__init__(program)
        self._blocks = deck.blocks
        self._setup_due = True

    @abstractmethod
    def send(self, commands: str) -> str | None:
        """Execute commands; an error becomes the outcome that fits."""

    def _set_up(self, checkpoint: Path | None) -> None:
        """Execute all blocks before the first layer, afresh or from a checkpoint."""
        for name in _SETUP:
            if name == "create" and checkpoint is not None:
                self.send(f'read_restart "{checkpoint.absolute()}/{self._restart}"')
            else:
                self.send(self._blocks[name].text)

    def _around_run(self) -> tuple[str, str]:
        """Commands of the stage before and after its long run."""
        return self._blocks[self.stage.name].around_run()

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
