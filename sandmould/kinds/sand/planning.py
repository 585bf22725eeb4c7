"""How a run of sand is planned: its engine, its price, what it is hashed by."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sandmould import pattern_fe
from sandmould.bad_input import Problem
from sandmould.digest import digest
from sandmould.engines import registry
from sandmould.engines.durations import grain_steps, run_s, shaken_step_s, stage_steps
from sandmould.engines.program import build_program
from sandmould.kernel_cache import are_compiled
from sandmould.kinds.kind import BASE_MEMORY_MB, Planning, SpeedClass
from sandmould.kinds.sand.measures import MEASURES
from sandmould.kinds.sand.narrow import narrow_spaces, thin_walls
from sandmould.kinds.sand.speed import SandSpeed
from sandmould.kinds.sand.table_motion import table_lines
from sandmould.limits import FRAMES, RECORDS
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.templates import Note, notes
from sandmould.scenario.cavities import MeshCavity
from sandmould.scenario.checks.scene import problems as scene_problems
from sandmould.scenario.hardness import LEAST_KAPPA, bed_hardness
from sandmould.scenario.pattern import MeshFile, PatternDrawing, Placed
from sandmould.scenario.placement import plan_counts
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import READ_BYTES, SolidMesh, drawn_part, drawn_surface, with_hash

MEASURING = (
    *(f"sandmould/analysis/{name}.py" for name in (
        "cavity_fill", "coordination", "deflection", "density", "free_space", "intersections",
        "loose_zones", "repose", "sections", "solid_fraction", "tube_fill",
    )),
    *(f"sandmould/kinds/sand/{name}.py" for name in (
        "bending", "measure", "moments", "outflow",
    )),
)  # fmt: skip
HIGH_ACCELERATION_G = 20.0
"""Peak acceleration above which a plan asks whether the amplitude is meant so."""
COMPILE_S = 55.0
"""Processor time for what a first run compiles in lanes: 58 s measured in 2D, 50 s in 3D (an AMD
EPYC with AVX2, idle)."""
STEPPED_COPIES = 8
"""Matrices of a surface held together while the masses of the in-step scheme are found."""
GRAINS_PER_MB = 50
SLOW_RATE = 1e6
"""Grain-steps per second of a slow core; benchmarks/ has those measured."""
IN_3D = 0.4
"""Share in 3D of an engine's speed in 2D."""
STATE_BYTES, SNAPSHOT_BYTES = {2: 230, 3: 560}, {2: 75, 3: 97}
"""Disk that a grain at rest takes in a checkpoint of the reference engine, with its contacts, and
in a snapshot: measured at 282 discs and 2 000 spheres."""
PASSES = 3.2
"""Times that a window of sand and pattern is computed, where it may be repeated: 2.4 on the L of
l_pattern_small, 2.8 on one of 591 discs, 3.2 on a bracket of foam (bracket_foam_small)."""
MEASURING_3D_S = 1.3
"""Processor time for measures and pictures in 3D beside what any job takes: 1.4 to 4.0 s a run in
four shipped studies, nothing in a fifth (docs/developers/prices.md); in 2D it is lost in the
rest."""
STEPPED_ENTRY_S, STEPPED_CACHED_S = 0.2e-9, 0.06e-9
"""Processor time of a step for an entry of the matrix of a pattern stepped in step, where memory
decides (1 820 to 4 400 components) and where it fits the cache of 32 MB (1 290 components)."""
STEPPED_CACHED = 1_600
"""Most components of a surface whose matrix, here of 20 MB, is taken to stay in the cache."""
PASS_S = 2e-3
"""Processor time of a pass of a window beside its grain-steps: loads, solution, new surface."""

Body = TypeVar("Body", bound=Placed)


class SandPlanning(Planning[Scenario]):
    """See ``Planning``."""

    work_unit = "grain-steps"
    speed = SandSpeed()
    measures = MEASURES
    measuring = MEASURING

    def resolved(self, scenario: Scenario) -> Scenario:
        """The scenario with its pattern's outline and the hashes of its meshes.

        So a changed mesh makes another run.
        """
        pattern = scenario.pattern
        if pattern is not None:
            # scikit-fem: few studies need it
            from sandmould.pattern_fe.coupling.interface import with_surface

            pattern = _hashed(pattern)
            if pattern.others is not None:
                others = tuple(_hashed(other) for other in pattern.others)
                pattern = pattern.model_copy(update={"others": others})
            scenario = with_surface(scenario.model_copy(update={"pattern": pattern}))
        solids = {"obstacles": scenario.obstacles, "cavities": scenario.cavities}
        hashed = {
            key: tuple(with_hash(s) if isinstance(s, SolidMesh) else s for s in every)
            for key, every in solids.items()
        }
        return scenario.model_copy(update=hashed)

    def problems(self, scenario: Scenario) -> list[Problem]:
        """What keeps a scene from being computed, and more records of it than anyone can use."""
        return scene_problems(scenario) or [*self._records(scenario)]

    def _records(self, scenario: Scenario) -> Iterator[Problem]:
        lasts_s, record = self.planned_s(scenario), scenario.record
        for key, limit in (
            ("series_every_s", RECORDS),
            ("checkpoint_every_s", RECORDS),
            ("snapshot_every_s", FRAMES),
        ):
            every_s = getattr(record, key)
            yield from limit.problems(f"record.{key}", lasts_s / every_s, every_s)

    def engine_problem(self, scenario: Scenario) -> Problem | None:
        """Why the engine of a scene cannot compute it."""
        return registry.engine_problem(scenario)

    def sources(self, scenario: Scenario) -> list[Path]:
        """Templates, and our own code where it computes."""
        ours = pattern_fe.source_files() if scenario.pattern else []
        return registry.deck_sources(scenario) + ours

    def template_hash(self, scenario: Scenario) -> str:
        """Hash of all that turns a scenario into a deck, and of our code where it computes."""
        return registry.deck_hash(scenario) + (pattern_fe.source_hash() if scenario.pattern else "")

    def fill(self, scenario: Scenario) -> Scenario | None:
        """The scene up to its first vibration; None where there is none."""
        return scenario.before_vibration if scenario.vibrations else None

    def state_bytes(self, scenario: Scenario) -> int:
        """Disk for the end of a scene and for the snapshots up to there."""
        every_s, d = scenario.record.snapshot_every_s, scenario.dimension
        snapshots = self.planned_s(scenario) / every_s
        return round(sum(plan_counts(scenario)) * (STATE_BYTES[d] + snapshots * SNAPSHOT_BYTES[d]))

    def computed_hash(self, scenario: Scenario) -> str:
        """Hash of what the engine is told to compute, and of the pattern beside it."""
        of_engine = registry.computed_hash(scenario)
        if scenario.pattern is None:
            return of_engine
        return digest(of_engine, scenario_hash(scenario.pattern), pattern_fe.source_hash())

    def threads(self, scenario: Scenario) -> int:
        """Ranks of MPI, or threads."""
        return scenario.engine.ranks

    def ranks(self, scenario: Scenario) -> int:
        """MPI ranks; the ranks of some engines are threads of one process."""
        return registry.mpi_ranks(scenario)

    def memory_mb(self, scenario: Scenario) -> int:
        """Several times the 126 MB measured at 1 134 discs, 144 at 8 000, and what meshes take."""
        triangles = sum(len(mesh.triangles) for mesh in scenario.scene.meshes)
        grains_mb = sum(plan_counts(scenario)) // GRAINS_PER_MB
        mesh_mb = READ_BYTES * triangles // 1_000_000
        return BASE_MEMORY_MB + grains_mb + mesh_mb + _foam_mb(scenario)

    def allowed_s(self, scenario: Scenario) -> float:
        """Wall time on a machine slower than any measured."""
        return self.planned_work(scenario) / SLOW_RATE / scenario.engine.ranks

    def planned_work(self, scenario: Scenario) -> float:
        """Steps times grains in the box at the time, and again where windows are repeated."""
        most = 1 if scenario.pattern is None else scenario.pattern.loop.most_passes
        return min(most, PASSES) * grain_steps(build_program(scenario))

    def predicted_s(self, scenario: Scenario) -> float:
        """Wall time at fixed speeds."""
        in_3d = IN_3D if scenario.dimension == 3 else 1.0
        of_core = registry.engine_of(scenario).GRAIN_STEPS_PER_S
        return self.planned_work(scenario) / (of_core * scenario.engine.ranks * in_3d)

    def beside_s(self, scenario: Scenario) -> float:
        """Time that does not grow with the grains: measuring, and the pattern a pass or a step."""
        return (MEASURING_3D_S if scenario.dimension == 3 else 0.0) + self._of_pattern_s(scenario)

    def _of_pattern_s(self, scenario: Scenario) -> float:
        if scenario.pattern is None:
            return 0.0
        loop = scenario.pattern.loop
        if loop.scheme == "in_step":
            components = _stepped_components(scenario)
            entry_s = STEPPED_CACHED_S if components <= STEPPED_CACHED else STEPPED_ENTRY_S
            return self.planned_steps(scenario) * components**2 * entry_s
        if not loop.has_windows:
            return 0.0
        return min(loop.most_passes, PASSES) * self.planned_s(scenario) / loop.window_s * PASS_S

    def planned_s(self, scenario: Scenario) -> float:
        """Fill, estimated, discharge, vibration and rest."""
        return run_s(build_program(scenario))

    def planned_steps(self, scenario: Scenario) -> int:
        """Time steps of a run: its fill and its rests, estimated, and its vibration."""
        return sum(map(math.ceil, stage_steps(build_program(scenario))))

    def speed_class(self, scenario: Scenario) -> SpeedClass:
        """Engine and dimension."""
        return scenario.engine.name, scenario.dimension

    def plan_cells(self, scenario: Scenario) -> Mapping[str, str]:
        """Grains, time step and steps."""
        step_s, shaken_s = scenario.step_s, shaken_step_s(scenario)
        changes = bool(scenario.vibrations) and shaken_s != step_s
        then = f", then about {shaken_s:.2g} s" if changes else ""
        return {
            "grains": f"{sum(plan_counts(scenario)):,}",
            "time step": f"{step_s:.3g} s{then}",
            "steps": f"{self.planned_steps(scenario):,}",
        }

    def notes(self, scenario: Scenario) -> tuple[Note, ...]:
        """Stiffness, narrow places, thin walls, and what is hardly meant."""
        box_m = np.array(scenario.box.size_m(scenario.dimension))
        places = {"obstacles": scenario.obstacles, "cavities": scenario.cavities}
        drawn = {
            f"{key}.{n}": drawn_part(it, box_m)
            for key, solids in places.items()
            for n, it in enumerate(solids)
            if isinstance(it, SolidMesh) and not getattr(it, "hollow", None)
        }
        return notes(
            "plan_sand.j2",
            grains_m=[each.diameter_m for each in scenario.sand.classes(scenario.dimension)],
            scale=scenario.sand.size_scale,
            hardness=bed_hardness(scenario),
            least=LEAST_KAPPA,
            narrow=narrow_spaces(scenario),
            compiles=registry.calls_our_kernels(scenario) and not are_compiled("dem"),
            compile_s=COMPILE_S,
            beyond_reason=[
                stage
                for stage in scenario.vibrations
                if stage.unbalance is None and stage.peak_acceleration_g > HIGH_ACCELERATION_G
            ],
            walls=thin_walls(scenario),
            drawings=drawn,
            hollows={
                f"cavities.{n}": scenario.scene.cavities[n].space
                for n, it in enumerate(scenario.cavities)
                if isinstance(it, MeshCavity) and it.hollow
            },
            edges=scenario.engine.name == "liggghts" and bool(scenario.scene.meshes),
            **_of_pattern(scenario),
        )

    def settings_lines(self, scenarios: Iterable[Scenario]) -> list[str]:
        """What is asked of the vibrating table."""
        return table_lines(scenarios)


def _hashed(body: Body) -> Body:
    """A body of foam with the hash of the file that it names, if any."""
    if not isinstance(body.shape, MeshFile | PatternDrawing):
        return body
    return body.model_copy(update={"shape": with_hash(body.shape)})


def _foam_mb(scenario: Scenario) -> int:
    """Memory for the equations of a pattern in 3D; in 2D it is lost in the rest."""
    if scenario.pattern is None or scenario.dimension == 2:
        return 0
    from sandmould.pattern_fe.scene import pattern_of  # see resolved

    numbers = pattern_of(scenario).factor_numbers
    if scenario.pattern.loop.scheme == "in_step":
        numbers += STEPPED_COPIES * _stepped_components(scenario) ** 2
    return 12 * numbers // 1_000_000


def _stepped_components(scenario: Scenario) -> int:
    """Components of the surface of a scenario's pattern."""
    from sandmould.pattern_fe.scene import pattern_of  # see resolved

    return pattern_of(scenario).surface.vertices_m.size


def _of_pattern(scenario: Scenario) -> dict[str, Any]:
    """What a drawn pattern measures, and how good its mesh is."""
    if scenario.pattern is None or not isinstance(scenario.pattern.shape, PatternDrawing):
        return {"pattern": None}
    from sandmould.pattern_fe.nearest import nearest_on_facets
    from sandmould.pattern_fe.quality import mesh_sentence
    from sandmould.pattern_fe.scene import pattern_of

    pattern = pattern_of(scenario)
    drawn_m, _ = drawn_surface(scenario.pattern.shape, "pattern.shape")
    drawn_m = drawn_m + np.array(scenario.pattern.position_m)
    _, _, place_m = nearest_on_facets(drawn_m, pattern.surface.vertices_m[pattern.surface.facets])
    return {
        "pattern": drawn_part(scenario.pattern.shape, np.array(scenario.box.size_m(3))),
        "pattern_mesh": mesh_sentence(scenario, pattern),
        "off_mm": 1e3 * float(np.linalg.norm(place_m - drawn_m, axis=1).max()),
    }
