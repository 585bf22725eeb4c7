"""How fast an engine is on this machine, measured on a few hundred grains and stored."""

from __future__ import annotations

import json
import platform
import statistics
import tempfile
import time
from pathlib import Path

from sandmould.engines import registry
from sandmould.engines.program import build_program
from sandmould.engines.session import EngineStop, Session
from sandmould.scenario.fill import Fill, Layer, Settling
from sandmould.scenario.placement import fall_s
from sandmould.scenario.scenario import Scenario

STORED = "calibration.json"
GRAINS = 400
FALL_WALL_S = 5.0
LONG_S = 60.0
"""The trial may settle or is shaken for longer than it is timed: no work is done past that."""
WINDOWS, WINDOW_S = 8, 0.125
"""Their median counts: what else the machine does slows an engine even on a core of its own."""


def stored_rate(scenario: Scenario, results: Path) -> float | None:
    """Grain-steps per second of one core of this machine, as measured before; starts nothing.

    Parameters
    ----------
    scenario : Scenario
    results : Path
        Folder of all results, which holds what was measured.
    """
    rates = _rates(results)
    return rates.get(_machine(scenario)) if rates else None


def measured_rate(scenario: Scenario, results: Path) -> float | None:
    """The same, measured now and stored where it was not; parameters as in ``stored_rate``.

    Returns
    -------
    float or None
        None when the engine could not run; the study's own runs will say why.
    """
    rates, machine = _rates(results), _machine(scenario)
    if machine not in rates:
        rate = _measure_rate(scenario)
        if rate is None:
            return None
        results.mkdir(parents=True, exist_ok=True)
        rates = {**_rates(results), machine: rate}  # another start may have measured meanwhile
        (results / STORED).write_text(json.dumps(rates, indent=1), encoding="utf-8")
    return rates[machine]


def _machine(scenario: Scenario) -> str:
    """Machine, engine, dimension, and the frame of sand that is shaken, as one text."""
    version = registry.engine_of(scenario).installed_version()
    how = f" shaken, {scenario.frame}" if scenario.vibrations else ""
    return f"{platform.node()} {scenario.engine.name} {version} {scenario.dimension}D{how}"


def _rates(results: Path) -> dict[str, float]:
    """All that was measured; nothing where the file is damaged."""
    try:
        tree = json.loads((results / STORED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return {machine: float(rate) for machine, rate in tree.items()}


def _measure_rate(scenario: Scenario) -> float | None:
    """Let a few hundred grains of the scene fall, and time how they are shaken, or settle.

    Falling grains touch nothing and are too cheap to count, so they fall first, as far as a few
    seconds of this machine take them.
    """
    shaken = scenario.vibrations
    trial = scenario.model_copy(
        update={
            "fill": Fill(layers=(Layer(count=GRAINS),), settling=Settling(longest_s=LONG_S)),
            "obstacles": (),
            "vibration": [s.model_copy(update={"duration_s": LONG_S}) for s in shaken[:1]],
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
            if shaken:
                session.end_stage()
                session.start_stage(program.stages[program.fill_stages])
            measured = statistics.median(_window_rate(session) for _ in range(WINDOWS))
            session.close()
        except EngineStop:
            return None
    return measured


def _window_rate(session: Session) -> float:
    """Grain-steps per second of a core over a moment."""
    steps, begun_s = session.steps, _spent_s()
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
