"""What the mend costs: the same settled bed computed in turns with either slip."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks.size_ratio.filled_box import PLANES, filled_box
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from tests.verification.cases.bench import Bench

WINDOW_S = 0.01
SETTLING_S = 0.3


def _one_layer(engine: str, plane: str) -> Scenario:
    changes = {"engine": {"name": engine}, "fill": {"layers": [{"count": 2000}]}}
    given = filled_box(plane, 1).model_dump(exclude_none=True)
    return Scenario.model_validate(merge(given, changes, Origin(), "cost"))


def cost(engine: str, turns: int) -> dict[str, Any]:
    """Processor time with the slip of half a step ago over that with the other, in turns."""
    first, second = (Bench(_one_layer(engine, plane)) for plane in PLANES)
    with first, second:
        first.session.start_stage(first.program.stages[0])
        settled = first.advance(SETTLING_S)
        state = settled.position_m, settled.velocity_m_s, settled.spin_rad_s
        for bench in (first, second):
            bench.place(*state)
            bench.advance(WINDOW_S)
        ratios = []
        for _ in range(turns):
            took = []
            for bench in (first, second):
                begun = time.process_time()
                bench.session.advance(WINDOW_S)
                took.append(time.process_time() - begun)
            ratios.append(took[0] / took[1])
    return {
        "engine": engine,
        "turns": turns,
        "median": round(float(np.median(ratios)), 3),
        "least": round(min(ratios), 3),
        "most": round(max(ratios), 3),
    }
