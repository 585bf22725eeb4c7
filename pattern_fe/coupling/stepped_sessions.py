"""Sand and pattern as one session, the pattern stepped with the grains.

Grains and pattern in one loop of central differences is what other schemes are compared with, the
paper's own way (section 4.3): explicit DEM and explicit FEM share the time step. It takes nothing
from the staggered loop: neither its loads, which are means over windows, nor its motion. In the
in-step scheme the engine steps the pattern.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.program import StepCounts
from sandmould.engines.session import EngineStop, SandSession
from sandmould.pattern_fe.coupling.body import ElasticBody
from sandmould.pattern_fe.coupling.convergence_log import WindowEntry, force_n, imbalance_n, rms_m
from sandmould.pattern_fe.coupling.explicit_foam import ExplicitFoam
from sandmould.pattern_fe.coupling.in_step_foam import InStepFoam
from sandmould.pattern_fe.coupling.pattern_session import SteppedSession
from sandmould.runs.outcome import Outcome
from sandmould.scenario.pattern import TOO_SOFT

Array = NDArray[np.float64]


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
    first_hz: float
    """First frequency of the scaled masses."""
    own_first_hz: float
    """The same of the foam's own."""


class MonolithicSession(SteppedSession[ExplicitFoam]):
    """A session with an explicit pattern stepped after every step of the grains.

    Positions of grains and nodes belong to a step, their velocities to half a step before it; the
    contact forces of a step, found where both are, drive both over the next one.
    """

    entry = MonolithicEntry

    def __init__(
        self,
        sand: SandSession,
        foam: ExplicitFoam,
        body: ElasticBody,
        surface: str,
        largest_m: float,
        counts: StepCounts,
        work: Path,
        checkpoint: Path | None = None,
        load_tolerance: float | None = None,
    ) -> None:
        """Begin as ``SteppedSession`` does, on an engine that gives the loads of every step.

        Parameters
        ----------
        sand, foam, body, surface, work, checkpoint, load_tolerance
            See ``SteppedSession``.
        largest_m : float
            Displacement beyond which the pattern has run away.
        """
        super().__init__(sand, foam, body, surface, work, checkpoint, load_tolerance)
        self._largest_m, self._counts = largest_m, counts

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration, or up to the next check; see ``Session``.

        Raises
        ------
        EngineStop
            Also where the pattern runs away.
        """
        check, now = self._counts.check, self.sand.steps
        ahead = check - now % check if duration_s is None else self._counts.steps(duration_s)
        load_sum, steps = np.zeros_like(self._load), 0
        while self.sand.steps < now + ahead and not self.sand.stage_over:
            self._step()
            load_sum, steps = load_sum + self._load, steps + 1
        if steps:
            solution = self._body.solve(load_sum / steps)
            self._rest.see(self.displacement_m, solution.displacement_m)
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
                first_hz=foam.first_hz,
                own_first_hz=foam.first_hz * math.sqrt(foam.mass_scale),
            )
        )
        self._shapes.write(self.time_s, displacement)


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
    first_hz: float
    """First frequency of the scaled masses."""
    own_first_hz: float
    """The same of the foam's own."""


class InStepSession(SteppedSession[InStepFoam]):
    """A session of an engine that calls the pattern's step in its own."""

    entry, load_name = InStepEntry, "mean_load"

    def _begin(self, work: Path, checkpoint: Path | None) -> None:
        super()._begin(work, checkpoint)
        self.sand.attach_mover(self._surface, self._foam.mover)

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
                f"largest_displacement_m allows, before {self.sand.time_s:.4g} s: {TOO_SOFT}",
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
                first_hz=foam.mass.first_hz,
                own_first_hz=foam.mass.own_first_hz,
            )
        )
        self._shapes.write(self.sand.time_s, moved_m)
