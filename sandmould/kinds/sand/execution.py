"""How a run of sand is computed: its deck, its session, its measures."""

from __future__ import annotations

import importlib
from pathlib import Path

from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.definition.run import FILL, PICTURE, Run
from sandmould.engines import recording, registry
from sandmould.engines.deck import environment
from sandmould.engines.driver import Driver, Opening
from sandmould.engines.durations import cost_before
from sandmould.engines.program import Program, build_program
from sandmould.engines.snapshot import close_torn
from sandmould.kinds.kind import Execution
from sandmould.kinds.sand.shared_fill import fill_apart, lay_fill
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.products import SAND_PRODUCTS, Computed, Cost
from sandmould.scenario.pattern import MeshFile
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import with_hash


class SandExecution(Execution[Scenario]):
    """See ``Execution``."""

    products = SAND_PRODUCTS

    def render(self, run: Run, folder: Path) -> None:
        """Write the deck and the layers, unless a pattern's mesh has changed since the plan."""
        pattern = run.scenario.pattern
        for body in () if pattern is None else pattern.bodies:
            mesh = body.shape
            if not isinstance(mesh, MeshFile):
                continue
            now = with_hash(mesh.model_copy(update={"sha256": None}))
            if mesh.sha256 not in (None, now.sha256):
                valid = "the file that the study was planned with; this one has changed since"
                file_name = display_path(mesh.path)
                raise BadInputError([Problem("pattern.shape.file", file_name, valid)])
        _write_deck(build_program(run.scenario), run, folder)

    def compute(self, run: Run, folder: Path) -> Computed:
        """Take the scenario through its program, or through what its shared fill leaves of it."""
        program = build_program(run.scenario)
        failed = lay_fill(run, folder, program)
        if failed is not None:
            return failed
        opening: Opening = registry.engine_of(run.scenario).open_session
        if run.scenario.pattern is not None:
            from sandmould.pattern_fe.coupling.opening import open_coupled

            opening = open_coupled
        if run.scenario.rest.shaken_check_every_s is not None:
            stopped = fill_apart(run, folder, program, opening)
            if stopped is not None:
                return stopped
            program = build_program(run.scenario.from_vibration)
        run_hash, is_fill = scenario_hash(run.scenario), run.part == FILL

        def write_deck(program: Program) -> None:
            world = registry.communicator_of(run.scenario)
            if world is None or world.rank == 0:  # one process writes for all
                _write_deck(program, run, folder)
            if world is not None:
                world.barrier()

        driver = Driver(program, folder, run.run, run_hash, opening, is_fill, write_deck)
        outcome = driver.run()
        return Computed(outcome, driver.cost, driver.is_root)

    def no_cost(self, scenario: Scenario) -> Cost:
        """Its engine and its time step."""
        return cost_before(scenario)

    def complete(self, scenario: Scenario, work: Path) -> None:
        """Make empty tables, so that collection finds them, and end the file of snapshots."""
        recording.create_tables(work, scenario.dimension)
        close_torn(work)

    def measure(self, run: Run, folder: Path) -> None:
        """Measure every snapshot."""
        from sandmould.kinds.sand.measure import measure_sand  # not every job needs that

        measure_sand(run.scenario, folder)

    def export(self, run: Run, folder: Path) -> None:
        """Draw the last snapshot, and write some for ParaView and OVITO."""
        from sandmould.kinds.sand.exports import write_exports, write_picture  # they draw

        write_picture(run.scenario, folder, folder / PICTURE)
        write_exports(run.scenario, folder, folder / "exports.zip")

    def load_computing(self, scenario: Scenario) -> None:
        """Import the engine's side of the house and its deck, and the pattern's if there is one."""
        registry.engine_of(scenario).load_session(scenario)
        environment(scenario.engine.name).get_template("deck.in.j2")
        if scenario.takes_step_of_bed:
            importlib.import_module("sandmould.engines.bed_limit")
        if scenario.pattern is not None:
            importlib.import_module("sandmould.pattern_fe.coupling.opening")

    def load_measuring(self, scenario: Scenario) -> None:
        """Import what measures."""
        importlib.import_module("sandmould.kinds.sand.measure")
        if scenario.pattern is not None:
            importlib.import_module("sandmould.kinds.sand.bent_files")


def _write_deck(program: Program, run: Run, folder: Path) -> None:
    engine = registry.engine_of(run.scenario)
    engine.write_deck(program, run.sources, folder, run.run, run.study)
