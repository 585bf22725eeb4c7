"""How fast elements exchange heat on this machine: a casting cools for a moment."""

from __future__ import annotations

import time
from pathlib import Path

from sandmould.kinds.stored_speed import StoredSpeed
from sandmould.scenario.casting.solidification import Solidification

TIMED_S = 0.5
STEPS = 10
"""Between two looks at the clock."""


class SolidificationSpeed(StoredSpeed[Solidification]):
    """See ``StoredSpeed``."""

    def computed_by(self, scenario: Solidification) -> str:
        """What the speed depends on: how heat is exchanged, our code, the dimension."""
        from sandmould.casting.arpm import source_hash

        return f"{scenario.exchange} {source_hash()} {scenario.dimensions}D"

    def trial(self, scenario: Solidification, results: Path) -> float | None:
        """Element-steps per second of one core, in the first steps of a casting."""
        from sandmould.casting.arpm import scene
        from sandmould.casting.arpm.elements import placed

        try:
            raster, filling = scene.drawn_raster(scenario), scene.filling_of(scenario)
            elements = placed(raster, scenario.layers)
            marching = scene.method_of(scenario).marching(elements, filling, raster)
            heat = filling.heat(elements)
            marching.advance(heat, 1e-9)  # compiled before it is timed
            before, begun_s = heat.element_steps, time.process_time()
            while time.process_time() - begun_s < TIMED_S:
                marching.advance(heat, STEPS * marching.step_s)
        except (ArithmeticError, ValueError):
            return None
        return (heat.element_steps - before) / (time.process_time() - begun_s)
