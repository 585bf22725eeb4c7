"""What sessions of all schemes have: tables, checkpoints and the pattern in snapshots."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.session import SandSession
from sandmould.engines.snapshot import Snapshot
from sandmould.pattern_fe.coupling.body import ElasticBody
from sandmould.pattern_fe.coupling.convergence_log import (
    CONVERGENCE_LOG,
    ConvergenceLog,
    WindowEntry,
)
from sandmould.pattern_fe.coupling.delegating_session import DelegatingSession
from sandmould.pattern_fe.coupling.explicit_foam import ExplicitFoam
from sandmould.pattern_fe.coupling.in_step_foam import InStepFoam
from sandmould.pattern_fe.coupling.pattern_rest import PatternRest
from sandmould.pattern_fe.coupling.shapes_file import SHAPES, ShapesFile

Array = NDArray[np.float64]
CHECKPOINT = "pattern.npz"


class PatternSession(DelegatingSession, ABC):
    """A session whose sand presses on a pattern that gives way; else the engine's own."""

    entry: type[Any] = WindowEntry
    """What the convergence log is made of."""
    load_name = "load"
    """Of the load in checkpoints."""

    def __init__(
        self,
        sand: SandSession,
        body: ElasticBody,
        surface: str,
        load_tolerance: float | None = None,
    ) -> None:
        """Start with no load; tables are opened by ``_begin``.

        ``body``: the pattern at rest under given loads. ``surface``: its name in the engine, vertex
        for vertex that of the body.
        """
        super().__init__(sand)
        self._body, self._surface = body, surface
        self._rest = PatternRest(sand, load_tolerance)
        self._load = np.zeros_like(body.vertices_m)
        """Of the sand on the vertices, as snapshots have it, (nv, d) float64, N."""

    def _begin(self, work: Path, checkpoint: Path | None) -> None:
        """Open the tables in a folder, afresh or with the state where a checkpoint left them."""
        log_bytes, rows = None, 0
        if checkpoint is not None:
            with np.load(checkpoint / CHECKPOINT, allow_pickle=False) as saved:
                state = {name: saved[name] for name in saved.files}
            self._load = state[self.load_name]
            # windows had two numbers of their own before
            trusted = (
                state["trusted"] if "trusted" in state else (state["ledger_bytes"], state["rows"])
            )
            log_bytes, rows = (int(number) for number in trusted)
            self._take_up(state)
        self._log = ConvergenceLog(work / CONVERGENCE_LOG, log_bytes, self.entry)
        self._shapes = ShapesFile(work / SHAPES, rows, *self._load.shape)

    @property
    @abstractmethod
    def displacement_m(self) -> Array:
        """Displacement of the surface, (nv, d) float64, m."""

    @abstractmethod
    def _state(self) -> dict[str, Array]:
        """All that a continued run needs of the pattern, by name."""

    @abstractmethod
    def _take_up(self, state: dict[str, Array]) -> None:
        """Go on from what ``_state`` gave."""

    def snapshot(self) -> Snapshot:
        """State of all grains relative to the box, and the pattern among them."""
        moved_m = self._body.vertices_m + self.displacement_m
        return replace(self.sand.snapshot(), pattern_m=moved_m, pattern_load_n=self._load)

    def write_checkpoint(self, folder: Path) -> None:
        """Write the engine's state and the pattern's."""
        self.sand.write_checkpoint(folder)
        self._shapes.flush()
        trusted = np.array([self._log.size(), self._shapes.rows])
        own: dict[str, Any] = {self.load_name: self._load, "trusted": trusted}
        np.savez(folder / CHECKPOINT, **own | self._state())

    def close(self) -> None:
        """Close the tables and free the engine."""
        self._log.close()
        self._shapes.close()
        self.sand.close()


Foam = TypeVar("Foam", ExplicitFoam, InStepFoam)
"""A pattern in motion."""


class SteppedSession(PatternSession, Generic[Foam]):
    """A session whose pattern moves in every step."""

    def __init__(
        self,
        sand: SandSession,
        foam: Foam,
        body: ElasticBody,
        surface: str,
        work: Path,
        checkpoint: Path | None = None,
        load_tolerance: float | None = None,
    ) -> None:
        """Start with the pattern at rest, or where a checkpoint left it.

        Parameters
        ----------
        sand, body, surface, load_tolerance
            See ``PatternSession``; the body is the same pattern at rest.
        """
        super().__init__(sand, body, surface, load_tolerance)
        self._foam: Foam = foam
        self._begin(work, checkpoint)

    @property
    def displacement_m(self) -> Array:
        """Displacement of the surface, (nv, d) float64, m."""
        return self._foam.displacement_m

    def _state(self) -> dict[str, Array]:
        return self._foam.state()

    def _take_up(self, state: dict[str, Array]) -> None:
        self._foam.restore(state)
