"""Studies of sand: a scenario of grains on one of the engines."""

from __future__ import annotations

import json
import math
import platform
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pattern_fe
from sandmould.digest import digest
from sandmould.engines import recording, registry
from sandmould.engines.cost import cost_before
from sandmould.engines.driver import Driver, Opening
from sandmould.engines.program import build_program
from sandmould.engines.session import EngineStop, Session
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.products import SAND_PRODUCTS, Computed
from sandmould.scenario import checks
from sandmould.scenario.fill import Fill, Layer
from sandmould.scenario.placement import plan_counts
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import SolidMesh, with_hash
from sandmould.study.kinds.kind import SpeedClass
from sandmould.study.run import Run

MODEL = Scenario
WORK = "grain-steps"
PRODUCTS = SAND_PRODUCTS
CALIBRATION_GRAINS = 400
CALIBRATION_FALL_WALL_S = 5.0
CALIBRATION_WINDOWS, CALIBRATION_WINDOW_S = 8, 0.125
"""The fastest counts: what else the machine does for a moment is not the engine's."""
BASE_MEMORY_MB = 600
GRAINS_PER_MB = 50
SLOW_RATE = 1e6
"""Grain-steps per second of a slow core; benchmarks/ has those measured."""
IN_3D = 0.4
"""Share in 3D of an engine's speed in 2D."""
PASSES = 4.0
"""Times that a window of sand and pattern is computed, where it may be repeated: 3.2 to 4.3 in the
mean on the L while it is filled, in windows of 2 to 20 ms (study l_judged)."""

problems = checks.problems
engine_problem = registry.engine_problem
no_cost = cost_before


def defaults() -> dict[str, Any]:
    """The default scene."""
    return Scenario().model_dump(mode="json")


def resolved(scenario: Scenario) -> Scenario:
    """The scenario with its pattern's outline and the hashes of its meshes.

    So a changed mesh makes another run.
    """
    if scenario.pattern is not None:
        from pattern_fe.coupling.interface import with_surface  # scikit-fem: few studies need it

        scenario = with_surface(scenario)
    obstacles = tuple(with_hash(o) if isinstance(o, SolidMesh) else o for o in scenario.obstacles)
    return scenario.model_copy(update={"obstacles": obstacles})


def sources(scenario: Scenario) -> list[Path]:
    """Templates, and our own code where it computes."""
    ours = pattern_fe.source_files() if scenario.pattern else []
    return registry.deck_sources(scenario) + ours


def template_hash(scenario: Scenario) -> str:
    """Hash of all that turns a scenario into a deck, and of our code where it computes."""
    return registry.deck_hash(scenario) + (pattern_fe.source_hash() if scenario.pattern else "")


def computed_hash(scenario: Scenario) -> str:
    """Hash of what the engine is told to compute, and of the pattern beside it."""
    told = registry.computed_hash(scenario)
    if scenario.pattern is None:
        return told
    beside = scenario.pattern.model_dump_json() + pattern_fe.source_hash()
    return digest(told, beside)


def lasts_s(scenario: Scenario) -> float:
    """The whole vibration."""
    return sum(stage.whole_duration_s for stage in scenario.vibration)


def threads(scenario: Scenario) -> int:
    """Ranks of MPI, or threads."""
    return scenario.engine.ranks


def ranks(scenario: Scenario) -> int:
    """MPI ranks; the ranks of some engines are threads of one process."""
    return registry.mpi_ranks(scenario)


def memory_mb(scenario: Scenario) -> int:
    """Several times the 126 MB measured at 1 134 discs, 144 at 8 000."""
    return BASE_MEMORY_MB + sum(plan_counts(scenario)) // GRAINS_PER_MB


def allowed_s(scenario: Scenario) -> float:
    """Wall time on a machine slower than any measured."""
    return planned_work(scenario) / SLOW_RATE / scenario.engine.ranks


def planned_work(scenario: Scenario) -> float:
    """Steps times grains in the box at the time, and again where windows are repeated."""
    most = 1 if scenario.pattern is None else scenario.pattern.loop.most_passes
    return min(most, PASSES) * build_program(scenario).expected_grain_steps


def predicted_s(scenario: Scenario) -> float:
    """Wall time at fixed speeds."""
    in_3d = IN_3D if scenario.dimension == 3 else 1.0
    of_core = registry.engine_of(scenario).GRAIN_STEPS_PER_S
    return planned_work(scenario) / (of_core * scenario.engine.ranks * in_3d)


def planned_s(scenario: Scenario) -> float:
    """Fill, estimated, discharge and vibration."""
    return build_program(scenario).expected_s


def planned_steps(scenario: Scenario) -> int:
    """Time steps of a run: its fill, estimated, and its vibration."""
    stages = build_program(scenario).stages
    return sum(math.ceil(stage.expected_s / scenario.step_s) for stage in stages)


def speed_class(scenario: Scenario) -> SpeedClass:
    """Engine and dimension."""
    return scenario.engine.name, scenario.dimension


def plan_cells(scenario: Scenario) -> Mapping[str, str]:
    """Grains, time step and steps."""
    return {
        "grains": f"{sum(plan_counts(scenario)):,}",
        "time step": f"{scenario.step_s:.3g} s",
        "steps": f"{planned_steps(scenario):,}",
    }


def render(run: Run, folder: Path) -> None:
    """Write the deck and the layers."""
    program = build_program(run.scenario)
    engine = registry.engine_of(run.scenario)
    engine.write_deck(program, run.sources, folder, run.run, run.study)


def compute(run: Run, folder: Path) -> Computed:
    """Take the scenario through its program."""
    program = build_program(run.scenario)
    opening: Opening = registry.engine_of(run.scenario).open_session
    if run.scenario.pattern is not None:
        from pattern_fe.coupling.opening import open_coupled

        opening = open_coupled
    driver = Driver(program, folder, run.run, scenario_hash(run.scenario), opening)
    outcome = driver.run()
    return Computed(outcome, driver.cost, driver.is_root)


def complete(scenario: Scenario, work: Path) -> None:
    """Make empty tables, so that collection finds them."""
    recording.create_tables(work, scenario.dimension)


def measure(run: Run, folder: Path) -> None:
    """Measure every snapshot."""
    from sandmould.study.measure import measure_sand  # draws: not every job needs that

    measure_sand(folder)


def rate(scenario: Scenario, results: Path) -> float | None:
    """Grain-steps per second of one core of this machine, measured once and kept.

    Returns
    -------
    float or None
        None when the engine could not run the calibration; the study's own runs will say why.
    """
    path = results / "calibration.json"
    version = registry.engine_of(scenario).installed_version()
    key = f"{platform.node()} {scenario.engine.name} {version} {scenario.dimension}D"
    known: dict[str, Any] = {}
    if path.is_file():
        try:
            known = json.loads(path.read_text(encoding="utf-8"))
        except ValueError:
            known = {}
    if key not in known:
        measured = _measure_rate(scenario)
        if measured is None:
            return None
        known[key] = measured
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(known, indent=1), encoding="utf-8")
    return float(known[key])


def _measure_rate(scenario: Scenario) -> float | None:
    """Let a few hundred grains of the scene fall and settle, and time the end of it.

    Falling grains touch nothing and are too cheap to count, so they fall first, as far as a few
    seconds of this machine take them.
    """
    trial = scenario.model_copy(
        update={
            "fill": Fill(layers=(Layer(count=CALIBRATION_GRAINS),)),
            "obstacles": (),
            "vibration": (),
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
            begun, rest_s = time.perf_counter(), program.expected_s / 2
            while session.time_s < rest_s and (
                time.perf_counter() - begun < CALIBRATION_FALL_WALL_S
            ):
                session.advance()
            measured = max(_window_rate(session) for _ in range(CALIBRATION_WINDOWS))
            session.close()
        except EngineStop:
            return None
    return measured


def _window_rate(session: Session) -> float:
    """Grain-steps per second of wall time over a moment."""
    steps, begun = session.steps, time.perf_counter()
    while time.perf_counter() - begun < CALIBRATION_WINDOW_S:
        session.advance()
    return session.grains * (session.steps - steps) / (time.perf_counter() - begun)
