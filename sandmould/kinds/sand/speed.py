"""How fast an engine is on this machine, measured on a few hundred grains and stored."""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path

from sandmould.engines import registry
from sandmould.engines.program import build_program
from sandmould.engines.session import EngineStop, Session
from sandmould.kinds.kind import StoredSpeed
from sandmould.scenario.fill import Fill, Layer, Settling
from sandmould.scenario.placement import fall_s
from sandmould.scenario.scenario import Scenario

GRAINS = 400
FALL_WALL_S = 5.0
LONG_S = 60.0
"""The trial may settle or is shaken for longer than it is timed: no work is done past that."""
WINDOWS, WINDOW_S = 8, 0.125
"""Their median counts: what else the machine does slows an engine even on a core of its own."""


class SandSpeed(StoredSpeed[Scenario]):
    """See ``StoredSpeed``."""

    def computed_by(self, scenario: Scenario) -> str:
        """Engine, dimension, and the frame of sand that is shaken, as one text."""
        version = registry.engine_of(scenario).installed_version()
        how = f" shaken, {scenario.frame}" if scenario.vibrations else ""
        return f"{scenario.engine.name} {version} {scenario.dimension}D{how}"

    def trial(self, scenario: Scenario, results: Path) -> float | None:
        """Let a few hundred grains of the scene fall, and time how they settle or are shaken.

        Falling grains touch nothing and are too cheap to count, so they fall first, as far as a few
        seconds of this machine take them. In 3D, where runs fill for as long as they shake, and
        shaken spheres lose more of their contacts, both are timed.
        """
        shaken = scenario.vibrations
        trial = scenario.model_copy(
            update={
                "fill": Fill(layers=(Layer(count=GRAINS),), settling=Settling(longest_s=LONG_S)),
                "obstacles": (),
                "pattern": None,
                "vibration": tuple(s.model_copy(update={"duration_s": LONG_S}) for s in shaken[:1]),
                "engine": scenario.engine.model_copy(update={"ranks": 1}),
            }
        )
        program = build_program(trial)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            engine = registry.engine_of(trial)
            engine.write_deck(program, {}, folder, "calibration", "calibration")
            try:
                session = engine.open_session(program, folder, folder / "engine.log")
                session.insert_layer(1)
                session.start_stage(program.stages[0])
                begun, rest_s = time.perf_counter(), fall_s(trial, GRAINS)
                while session.time_s < rest_s and (time.perf_counter() - begun < FALL_WALL_S):
                    session.advance()
                rates = [_typical_rate(session)] if scenario.dimension == 3 or not shaken else []
                if shaken:
                    session.end_stage()
                    session.start_stage(program.stages[program.fill_stages])
                    rates.append(_typical_rate(session))
                session.close()
            except EngineStop:
                return None
        return statistics.harmonic_mean(rates)


def _typical_rate(session: Session) -> float:
    """Median of some windows."""
    return statistics.median(_window_rate(session) for _ in range(WINDOWS))


def _window_rate(session: Session) -> float:
    """Grain-steps per second of a core over a moment."""
    steps, begun_s = session.steps, _spent_s()
    session.advance()  # once at least: another thread may use up a short window
    while _spent_s() - begun_s < WINDOW_S:
        session.advance()
    return session.grains * (session.steps - steps) / (_spent_s() - begun_s)


def _spent_s() -> float:
    """Time that cores have worked for this process and those that it has started.

    It does not grow while others have the cores, as wall time does.
    """
    lists = Path("/proc/self/task").glob("*/children")
    started = [pid for each in lists for pid in each.read_text(encoding="ascii").split()]
    stats = [Path(f"/proc/{pid}/schedstat").read_text(encoding="ascii") for pid in started]
    return time.process_time() + sum(float(each.split()[0]) for each in stats) / 1e9
