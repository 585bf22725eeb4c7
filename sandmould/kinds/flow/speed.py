"""How fast particles of metal flow on this machine: they flow for a moment."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

from sandmould.kinds.stored_speed import StoredSpeed
from sandmould.scenario.casting.flow import MetalFlow

TIMED_S = 0.5


class FlowSpeed(StoredSpeed[MetalFlow]):
    """See ``StoredSpeed``."""

    def computed_by(self, scenario: MetalFlow) -> str:
        """What the speed depends on: our code, and the case, which has its dimension."""
        from sandmould.casting.mps import source_hash

        return f"mps {source_hash()} {scenario.case.kind}"

    def trial(self, scenario: MetalFlow, results: Path) -> float | None:
        """Particle-solves per second of one core, in the first steps; of a mould that is full."""
        from sandmould.casting.mps import scene

        flow = scene.open_flow(scenario, full=True)
        with contextlib.suppress(ArithmeticError):
            flow.step()  # compiled before it is timed
        before, begun_s = flow.cost.particle_solves, time.process_time()
        # what a guard stops so early has run for its share of the time
        with contextlib.suppress(ArithmeticError):
            while time.process_time() - begun_s < TIMED_S:
                flow.step()
        solves = flow.cost.particle_solves - before
        return solves / (time.process_time() - begun_s) if solves else None
