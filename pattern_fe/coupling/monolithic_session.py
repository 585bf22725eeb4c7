"""The judge of the staggered loop: grains and pattern in one loop of central differences.

The paper's own way (section 4.3): explicit DEM and explicit FEM share the time step. It takes
nothing from the staggered loop: neither its loads, which are means over windows, nor its motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pattern_fe.coupling.explicit_foam import ExplicitFoam
from pattern_fe.coupling.ledger import LEDGER, Ledger, rms_m
from pattern_fe.coupling.shapes_file import SHAPES, ShapesFile
from sandmould.engines.program import Program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.session import EngineStop
from sandmould.engines.snapshot import Snapshot
from sandmould.runs.outcome import Outcome

Array = NDArray[np.float64]
CHECKPOINT = "pattern.npz"


@dataclass(frozen=True)
class JudgeEntry:
    """The pattern at a record, and what became of the work of the sand since the run began."""

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
    balance_j: float
    """Work less all three energies: round-off."""


class JudgeSession(ReferenceSession):
    """The reference engine with an explicit pattern stepped after every step of the grains.

    Positions of grains and nodes belong to a step, their velocities to half a step before it; the
    contact forces of a step, found where both are, drive both over the next one.
    """

    def __init__(
        self,
        program: Program,
        foam: ExplicitFoam,
        surface: str,
        largest_m: float,
        work: Path,
        checkpoint: Path | None = None,
    ) -> None:
        """Start with the pattern at rest, or where a checkpoint left it.

        Parameters
        ----------
        program : Program
        foam : ExplicitFoam
        surface : str
            Its name in the engine, vertex for vertex that of the foam.
        largest_m : float
            Displacement beyond which the pattern has run away.
        work : Path
            Folder of the tables.
        checkpoint : Path, optional
            Folder that ``write_checkpoint`` wrote.
        """
        self._foam, self._surface, self._largest_m = foam, surface, largest_m
        self._load = np.zeros_like(foam.vertices_m)
        self._trusted: tuple[int | None, int] = (None, 0)
        super().__init__(program, checkpoint)
        self._ledger = Ledger(work / LEDGER, self._trusted[0], JudgeEntry)
        self._shapes = ShapesFile(work / SHAPES, self._trusted[1], *foam.vertices_m.shape)

    @property
    def displacement_m(self) -> Array:
        """Displacement of the surface, (nv, d) float64, m."""
        return self._foam.displacement_m

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration, or up to the next record; see ``Session``."""
        super().advance(duration_s)
        self._write()

    def _compute_to(self, target: int) -> None:
        """Step pattern and grains in turn; raises EngineStop where the pattern runs away."""
        while self.steps < target:
            self._foam.advance(self._load)
            moved_m = self.displacement_m
            self._check(moved_m)
            self.move_surface(self._surface, self._foam.vertices_m + moved_m, self.step_s)
            rows = self._vertices_of(self._surface)
            before = self.solver.moving.walls.loads[:, rows].sum(axis=0)
            super()._compute_to(self.steps + 1)
            # the engine's sums, for it clears the solver's where a record ends
            self._load = self._record_sums[rows] - before

    def _check(self, moved_m: Array) -> None:
        largest_m = float(np.abs(moved_m).max())
        if not largest_m <= self._largest_m:
            raise EngineStop(
                Outcome.COUPLING_DIVERGED,
                f"the pattern has moved by {largest_m:.3g} m, more than pattern.loop."
                f"largest_displacement_m = {self._largest_m:g}, after {self.time_s:.4g} s",
            )

    def _write(self) -> None:
        foam, moved_m = self._foam, self.displacement_m
        elastic_j, kinetic_j = foam.elastic_j, foam.kinetic_j
        self._ledger.write(
            JudgeEntry(
                time_s=self.time_s,
                displacement_m=rms_m(moved_m),
                largest_m=float(np.linalg.norm(moved_m, axis=1).max()),
                load_n=float(np.linalg.norm(self._load.sum(axis=0))),
                work_j=foam.work_j,
                elastic_j=elastic_j,
                kinetic_j=kinetic_j,
                damped_j=foam.damped_j,
                balance_j=foam.work_j - elastic_j - kinetic_j - foam.damped_j,
            )
        )
        self._shapes.write(self.time_s, moved_m)

    def snapshot(self) -> Snapshot:
        """State of all grains relative to the box, and the pattern among them."""
        moved = self._foam.vertices_m + self.displacement_m
        return replace(super().snapshot(), pattern_m=moved, pattern_load_n=self._load)

    def keep(self) -> Any:
        """Copies of what grains and pattern are; the tables go on."""
        return super().keep(), self._foam.state(), self._load

    def go_back(self, kept: Any) -> None:
        """Compute on from what ``keep`` gave."""
        grains, foam, self._load = kept
        super().go_back(grains)
        self._foam.restore(foam)

    def _save(self, folder: Path) -> None:
        super()._save(folder)
        self._shapes.flush()
        trusted = np.array([self._ledger.size(), self._shapes.rows])
        np.savez(
            folder / CHECKPOINT,
            load=self._load,
            trusted=trusted,
            **self._foam.state(),  # type: ignore[arg-type]
        )

    def _restore(self, checkpoint: Path) -> None:
        super()._restore(checkpoint)
        with np.load(checkpoint / CHECKPOINT) as kept:
            self._foam.restore({name: kept[name] for name in kept.files})
            self._load = kept["load"]
            self._trusted = int(kept["trusted"][0]), int(kept["trusted"][1])

    def close(self) -> None:
        """Close the tables."""
        self._ledger.close()
        self._shapes.close()
        super().close()
