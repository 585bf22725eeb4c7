"""Sand and pattern as one session: the pattern is stepped inside the engine, with the grains."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.session import EngineStop, Session
from sandmould.engines.snapshot import Snapshot
from sandmould.pattern_fe.coupling.body import ElasticBody
from sandmould.pattern_fe.coupling.convergence_log import (
    CONVERGENCE_LOG,
    ConvergenceLog,
    WindowEntry,
    force_n,
    imbalance_n,
    rms_m,
)
from sandmould.pattern_fe.coupling.delegating_session import DelegatingSession
from sandmould.pattern_fe.coupling.in_step_foam import InStepFoam
from sandmould.pattern_fe.coupling.pattern_rest import PatternRest
from sandmould.pattern_fe.coupling.shapes_file import SHAPES, ShapesFile
from sandmould.runs.outcome import Outcome

Array = NDArray[np.float64]
CHECKPOINT = "pattern.npz"


@dataclass(frozen=True)
class InStepEntry(WindowEntry):
    """One check of the in-step scheme; the columns of all schemes and its own balance of energy.

    Load and residual are those of the mean load over the check, work and energies those of all
    steps.
    """

    kinetic_j: float
    """Of the scaled masses."""
    damped_j: float
    """Taken by the mass damping."""
    balance_j: float
    """Work less all four energies, that which contact took among them: round-off."""


class InStepSession(DelegatingSession):
    """A session whose pattern gives way in every step; else the engine's own."""

    def __init__(
        self,
        sand: Session,
        foam: InStepFoam,
        body: ElasticBody,
        surface: str,
        work: Path,
        checkpoint: Path | None = None,
        load_tolerance: float | None = None,
    ) -> None:
        """Start with the pattern at rest, or where a checkpoint left it.

        Parameters
        ----------
        sand : Session
            Of any engine that calls a mover in its steps.
        foam : InStepFoam
        body : ElasticBody
            The same pattern at rest, for the residual.
        surface : str
            Its name in the engine, vertex for vertex that of the foam.
        work : Path
            Folder of the tables.
        checkpoint : Path, optional
            Folder that ``write_checkpoint`` wrote.
        load_tolerance : float, optional
            See ``PatternRest``.
        """
        super().__init__(sand)
        self._rest = PatternRest(sand, load_tolerance)
        self._foam, self._body = foam, body
        self._load = np.zeros_like(foam.vertices_m)
        log_bytes, rows = None, 0
        if checkpoint is not None:
            with np.load(checkpoint / CHECKPOINT, allow_pickle=False) as saved:
                foam.restore({name: saved[name] for name in saved.files})
                self._load = saved["mean_load"]
                log_bytes, rows = (int(number) for number in saved["trusted"])
        sand.attach_mover(surface, foam.mover)
        self._log = ConvergenceLog(work / CONVERGENCE_LOG, log_bytes, InStepEntry)
        self._shapes = ShapesFile(work / SHAPES, rows, *foam.vertices_m.shape)

    @property
    def displacement_m(self) -> Array:
        """Displacement of the surface, (nv, d) float64, m."""
        return self._foam.displacement_m

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration, or up to the next check; see ``Session``.

        Raises
        ------
        EngineStop
            Also where the pattern runs away.
        """
        before = self.sand.steps
        self.sand.advance(duration_s)
        if self._foam.ran_away:
            largest_m = np.abs(self.displacement_m).max()
            raise EngineStop(
                Outcome.COUPLING_DIVERGED,
                f"the pattern has moved by {largest_m:.3g} m, more than pattern.loop."
                f"largest_displacement_m allows, before {self.sand.time_s:.4g} s",
            )
        self._write(self.sand.steps - before)

    def _write(self, steps: int) -> None:
        foam, moved_m = self._foam, self.displacement_m
        load = self._load = foam.take_mean_load_n()
        begun = time.perf_counter()
        solution = self._body.solve(load)
        self._rest.see(moved_m, solution.displacement_m)
        elastic_j, kinetic_j = foam.elastic_j, foam.kinetic_j
        self._log.write(
            InStepEntry(
                time_s=self.sand.time_s,
                window_s=steps * self.sand.step_s,
                passes=1,
                factor=1.0,
                gain=np.nan,
                residual_m=rms_m(solution.displacement_m - moved_m),
                displacement_m=rms_m(moved_m),
                largest_m=float(np.linalg.norm(moved_m, axis=1).max()),
                load_n=float(np.linalg.norm(load.sum(axis=0))),
                imbalance_n=imbalance_n(load, solution),
                moment_left_n_m=solution.moment_left_n_m,
                work_j=foam.work_j,
                energy_j=elastic_j,
                solve_s=time.perf_counter() - begun,
                contact_n=force_n(foam.mean_contact_n),
                contact_j=foam.contact_j,
                kinetic_j=kinetic_j,
                damped_j=foam.damped_j,
                balance_j=foam.work_j - elastic_j - kinetic_j - foam.damped_j - foam.contact_j,
            )
        )
        self._shapes.write(self.sand.time_s, moved_m)

    def snapshot(self) -> Snapshot:
        """State of all grains relative to the box, and the pattern among them."""
        moved = self._foam.vertices_m + self.displacement_m
        return replace(self.sand.snapshot(), pattern_m=moved, pattern_load_n=self._load)

    def save_checkpoint(self) -> Any:
        """Copies of what grains and pattern are; the tables go on."""
        return self.sand.save_checkpoint(), self._foam.state()

    def restore_checkpoint(self, checkpoint: Any) -> None:
        """Compute on from what ``save_checkpoint`` gave."""
        grains, foam = checkpoint
        self.sand.restore_checkpoint(grains)
        self._foam.restore(foam)

    def write_checkpoint(self, folder: Path) -> None:
        """Write the engine's state and the pattern's."""
        self.sand.write_checkpoint(folder)
        self._shapes.flush()
        trusted = np.array([self._log.size(), self._shapes.rows])
        np.savez(
            folder / CHECKPOINT,
            trusted=trusted,
            mean_load=self._load,
            **self._foam.state(),  # type: ignore[arg-type]
        )

    def close(self) -> None:
        """Close the tables and free the engine."""
        self._log.close()
        self._shapes.close()
        self.sand.close()
