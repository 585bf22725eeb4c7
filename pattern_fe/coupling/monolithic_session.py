"""Grains and pattern in one loop of central differences, what other schemes are compared with.

The paper's own way (section 4.3): explicit DEM and explicit FEM share the time step. It takes
nothing from the staggered loop: neither its loads, which are means over windows, nor its motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.session import EngineStop, Session
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.step_counts import StepCounts
from sandmould.pattern_fe.coupling.body import ElasticBody
from sandmould.pattern_fe.coupling.convergence_log import (
    CONVERGENCE_LOG,
    ConvergenceLog,
    force_n,
    rms_m,
)
from sandmould.pattern_fe.coupling.delegating_session import DelegatingSession
from sandmould.pattern_fe.coupling.explicit_foam import ExplicitFoam
from sandmould.pattern_fe.coupling.pattern_rest import PatternRest
from sandmould.pattern_fe.coupling.shapes_file import SHAPES, ShapesFile
from sandmould.runs.outcome import Outcome

Array = NDArray[np.float64]
CHECKPOINT = "pattern.npz"


@dataclass(frozen=True)
class MonolithicEntry:
    """The pattern at a check, and what became of the work of the sand since the run began."""

    time_s: float
    displacement_m: float
    """Root of the mean square over the vertices."""
    largest_m: float
    """Largest displacement of a vertex."""
    load_n: float
    """Size of the sand's force on the pattern at this step."""
    work_j: float
    """Work of the sand."""
    elastic_j: float
    kinetic_j: float
    """Of the scaled masses."""
    damped_j: float
    """Taken by the mass damping."""
    contact_n: float
    """Size of the force of floor, walls and obstacles on the pattern in the last step."""
    contact_j: float
    """Taken by contact with them: the kinetic energy of vertices that they stop."""
    balance_j: float
    """Work less all four energies: round-off."""


class MonolithicSession(DelegatingSession):
    """A session with an explicit pattern stepped after every step of the grains.

    Positions of grains and nodes belong to a step, their velocities to half a step before it; the
    contact forces of a step, found where both are, drive both over the next one.
    """

    def __init__(
        self,
        sand: Session,
        foam: ExplicitFoam,
        body: ElasticBody,
        surface: str,
        largest_m: float,
        counts: StepCounts,
        work: Path,
        checkpoint: Path | None = None,
        load_tolerance: float | None = None,
    ) -> None:
        """Start with the pattern at rest, or where a checkpoint left it.

        Parameters
        ----------
        sand : Session
            Of any engine that gives the loads of every step.
        foam : ExplicitFoam
        body : ElasticBody
            The same pattern at rest, for where the loads bend it.
        surface : str
            Its name in the engine, vertex for vertex that of the foam.
        largest_m : float
            Displacement beyond which the pattern has run away.
        counts : StepCounts
            Of the scenario.
        work : Path
            Folder of the tables.
        checkpoint : Path, optional
            Folder that ``write_checkpoint`` wrote.
        load_tolerance : float, optional
            See ``PatternRest``.
        """
        super().__init__(sand)
        self._body, self._rest = body, PatternRest(sand, load_tolerance)
        self._foam, self._surface, self._largest_m = foam, surface, largest_m
        self._counts = counts
        self._load = np.zeros_like(foam.vertices_m)
        self._load_sum, self._load_steps = np.zeros_like(self._load), 0
        """Of the loads in this call of ``advance``, N."""
        log_bytes, rows = None, 0
        if checkpoint is not None:
            with np.load(checkpoint / CHECKPOINT, allow_pickle=False) as saved:
                foam.restore({name: saved[name] for name in saved.files})
                self._load = saved["load"]
                log_bytes, rows = (int(number) for number in saved["trusted"])
        self._log = ConvergenceLog(work / CONVERGENCE_LOG, log_bytes, MonolithicEntry)
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
        check, now = self._counts.check, self.sand.steps
        ahead = check - now % check if duration_s is None else self._counts.steps(duration_s)
        while self.sand.steps < now + ahead and not self.sand.stage_over:
            self._step()
        if self._load_steps:
            mean_n = self._load_sum / self._load_steps
            self._rest.see(self.displacement_m, self._body.solve(mean_n).displacement_m)
            self._load_sum, self._load_steps = np.zeros_like(mean_n), 0
        self._write()

    def _step(self) -> None:
        """Step the pattern under the loads of the last step, then the grains."""
        self._foam.advance(self._load)
        displacement = self.displacement_m
        self._check(displacement)
        vertices_m = self._foam.vertices_m + displacement
        self.sand.move_surface(self._surface, vertices_m, self.sand.step_s)
        self.sand.advance(self.sand.step_s)
        load = self.sand.vertex_loads(self._surface)
        assert load is not None, "an engine that gives the loads of every step has one"
        self._load = load
        self._load_sum, self._load_steps = self._load_sum + load, self._load_steps + 1

    def _check(self, displacement: Array) -> None:
        largest_m = float(np.abs(displacement).max())
        if not largest_m <= self._largest_m:
            raise EngineStop(
                Outcome.COUPLING_DIVERGED,
                f"the pattern has moved by {largest_m:.3g} m, more than pattern.loop."
                f"largest_displacement_m = {self._largest_m:g}, after {self.time_s:.4g} s",
            )

    def _write(self) -> None:
        foam, displacement = self._foam, self.displacement_m
        elastic_j, kinetic_j = foam.elastic_j, foam.kinetic_j
        self._log.write(
            MonolithicEntry(
                time_s=self.time_s,
                displacement_m=rms_m(displacement),
                largest_m=float(np.linalg.norm(displacement, axis=1).max()),
                load_n=float(np.linalg.norm(self._load.sum(axis=0))),
                work_j=foam.work_j,
                elastic_j=elastic_j,
                kinetic_j=kinetic_j,
                damped_j=foam.damped_j,
                contact_n=force_n(foam.contact_n),
                contact_j=foam.contact_j,
                balance_j=foam.work_j - elastic_j - kinetic_j - foam.damped_j - foam.contact_j,
            )
        )
        self._shapes.write(self.time_s, displacement)

    def snapshot(self) -> Snapshot:
        """State of all grains relative to the box, and the pattern among them."""
        moved_m = self._foam.vertices_m + self.displacement_m
        return replace(self.sand.snapshot(), pattern_m=moved_m, pattern_load_n=self._load)

    def save_checkpoint(self) -> Any:
        """Copies of what grains and pattern are; the tables go on."""
        return self.sand.save_checkpoint(), self._foam.state(), self._load

    def restore_checkpoint(self, checkpoint: Any) -> None:
        """Compute on from what ``save_checkpoint`` gave."""
        grains, foam, self._load = checkpoint
        self.sand.restore_checkpoint(grains)
        self._foam.restore(foam)

    def write_checkpoint(self, folder: Path) -> None:
        """Write the engine's state and the pattern's."""
        self.sand.write_checkpoint(folder)
        self._shapes.flush()
        trusted = np.array([self._log.size(), self._shapes.rows])
        np.savez(
            folder / CHECKPOINT,
            load=self._load,
            trusted=trusted,
            **self._foam.state(),  # type: ignore[arg-type]
        )

    def close(self) -> None:
        """Close the tables and free the engine."""
        self._log.close()
        self._shapes.close()
        self.sand.close()
