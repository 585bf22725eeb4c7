"""Sand and pattern as one session: the pattern is stepped inside the engine, with the grains."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sandmould.engines.session import EngineStop
from sandmould.pattern_fe.coupling.convergence_log import WindowEntry, force_n, imbalance_n, rms_m
from sandmould.pattern_fe.coupling.in_step_foam import InStepFoam
from sandmould.pattern_fe.coupling.pattern_session import SteppedSession
from sandmould.runs.outcome import Outcome
from sandmould.scenario.pattern import TOO_SOFT


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
