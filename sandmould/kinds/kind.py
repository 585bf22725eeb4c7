"""What makes a kind of study: its types, how its runs are planned, how they are computed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from sandmould import ROOT
from sandmould.bad_input import Problem
from sandmould.definition.run import Run
from sandmould.definition.study import Study
from sandmould.digest import code_identity
from sandmould.runs.measures import MeasureGroup
from sandmould.runs.products import Computed, Cost
from sandmould.scenario.quantity import Section

AnyScenario = Section
"""A scenario of any kind."""
ScenarioT = TypeVar("ScenarioT", bound=Section)
SpeedClass = tuple[str, int]
"""Engine and dimension: what the speed of a core depends on most."""
OF_SAND = ("cross_check", "calibration", "certificate")
"""Sections of a study that speak of sand."""


class Note(NamedTuple):
    """What a plan tells of a run beside its figures."""

    about: str
    """Notes of several points about one thing are told once."""
    text: str
    """One sentence or two, with figures."""
    head: str = "Note"
    """What the line begins with."""


def nothing_beside(scenario: Any) -> float:
    """No time beside the work."""
    return 0.0


def no_notes(scenario: Any) -> Sequence[Note]:
    """Nothing to tell."""
    return ()


def no_lines(scenarios: Any) -> Sequence[str]:
    """Nothing to list."""
    return ()


def no_state(scenario: Any) -> int:
    """Nothing on the disk."""
    return 0


def no_fill(scenario: Any) -> None:
    """Nothing that runs could share."""


CORE_SECONDS = "core-seconds"


@dataclass(frozen=True)
class MachineSpeed(Generic[ScenarioT]):
    """How fast a core of this machine is; of kinds whose engines differ from machine to machine.

    Both functions take a scenario and the folder of all results, and give work a second.
    """

    stored: Callable[[ScenarioT, Path], float | None]
    """As measured before; None where it was not. Starts nothing."""
    measured: Callable[[ScenarioT, Path], float | None]
    """As measured before, or measured now and stored; None where nothing could be measured.

    A program of the user's that stops with an error is a BadInputError.
    """
    basis: str = "at the speed measured on this machine"
    """What a price rests on that was reckoned with it."""


@dataclass(frozen=True)
class UserProgram(Generic[ScenarioT]):
    """What a kind says of programs of the user's that its runs execute."""

    shipped: Path
    """Folder of those that come with us."""
    files: Callable[[ScenarioT], Mapping[str, Path]]
    """Its files by key: they must lie in folders that the study allows."""
    foreign: Callable[[ScenarioT], str]
    """Why it is not one of those shipped, in a few words; empty where it is."""
    to_read: Callable[[Sequence[ScenarioT]], list[str]]
    """Lines of it that a person should read before running it."""


@dataclass(frozen=True)
class Planning(Generic[ScenarioT]):
    """What a kind says of a run before it starts. Functions take its scenario."""

    work_unit: str
    """Unit of ``planned_work``; ``CORE_SECONDS`` where work is time and is priced as such."""
    resolved: Callable[[ScenarioT], ScenarioT]
    """The scenario with the hashes of the files that it names."""
    problems: Callable[[ScenarioT], list[Problem]]
    """What keeps a well-typed scenario from being run."""
    engine_problem: Callable[[ScenarioT], Problem | None]
    """Why this machine cannot compute it."""
    measures: tuple[MeasureGroup[ScenarioT], ...]
    """All that its runs can be measured by: the one list of names, units and meanings."""
    vibration_s: Callable[[ScenarioT], float]
    """Time of vibration, over which measures are taken."""
    sources: Callable[[ScenarioT], list[Path]]
    """Files that its runs are computed again for when they change."""
    template_hash: Callable[[ScenarioT], str]
    """Hash of all that turns a scenario into a deck, and of our solver where it takes part."""
    computed_hash: Callable[[ScenarioT], str]
    """Hash of what is computed, whatever it is called."""
    threads: Callable[[ScenarioT], int]
    """Cores that a run keeps busy, as MPI ranks or as threads."""
    ranks: Callable[[ScenarioT], int]
    """MPI ranks of a run."""
    memory_mb: Callable[[ScenarioT], int]
    """Memory to ask for."""
    allowed_s: Callable[[ScenarioT], float]
    """Wall time to ask for, less what any job takes."""
    planned_work: Callable[[ScenarioT], float]
    """What a run costs, before it starts."""
    predicted_s: Callable[[ScenarioT], float]
    """Wall time of a run at speeds that are the same on every machine."""
    planned_s: Callable[[ScenarioT], float]
    """Simulated time of a whole run."""
    speed_class: Callable[[ScenarioT], SpeedClass]
    """Scenarios of one class are computed at one speed."""
    plan_cells: Callable[[ScenarioT], Mapping[str, str]]
    """What the plan says of a run, by heading."""
    fill: Callable[[ScenarioT], ScenarioT | None] = no_fill
    """The part that comes first, as a scene of its own: runs with equal ones share it."""
    state_bytes: Callable[[ScenarioT], int] = no_state
    """Disk that the state at the end of a scene takes."""
    beside_s: Callable[[ScenarioT], float] = nothing_beside
    """Wall time of a run that does not grow with its work."""
    notes: Callable[[ScenarioT], Sequence[Note]] = no_notes
    """What a user should know of a run before it starts, though it can be run."""
    settings_lines: Callable[[Iterable[ScenarioT]], Sequence[str]] = no_lines
    """What the settings of a study ask of a machine, as lines; of one scenario a setting."""
    guess: str = "an estimate"
    """What a price by ``predicted_s`` rests on."""
    speed: MachineSpeed[ScenarioT] | None = None
    """None where ``predicted_s`` is all that is known."""
    program: UserProgram[ScenarioT] | None = None
    """None where all that a run executes is shipped."""
    measuring: tuple[str, ...] = ()
    """Files, from the root of the house, whose code takes the measures; what draws is left out."""

    @property
    def measuring_hash(self) -> str:
        """State of the code that takes the measures: runs measured by another one are so again."""
        return _hash_of(self.measuring)


@cache
def _hash_of(files: tuple[str, ...]) -> str:
    return code_identity([[ROOT / file for file in files]])


@dataclass(frozen=True)
class Execution(Generic[ScenarioT]):
    """How a kind computes a run. Functions of a run take its folder too."""

    products: tuple[str, ...]
    """What a run leaves beside outcome, cost and provenance."""
    render: Callable[[Run, Path], None]
    """Write the deck of a run into its folder."""
    compute: Callable[[Run, Path], Computed]
    """Compute a run from its newest checkpoint, or from its beginning."""
    complete: Callable[[ScenarioT, Path], None]
    """Make the products in a work folder that a broken run never wrote."""
    no_cost: Callable[[ScenarioT], Cost]
    """Cost of a run that has not begun."""
    measure: Callable[[Run, Path], None]
    """Measure what a run left behind; the picture last."""
    load_computing: Callable[[ScenarioT], None] = lambda scenario: None
    load_measuring: Callable[[ScenarioT], None] = lambda scenario: None
    """Import what computing or measuring needs, for a worker that forks for each run: what starts
    threads, MPI or an engine must stay for the run's own process."""


def _nothing() -> dict[str, Any]:
    return {}


@dataclass(frozen=True)
class Kind(Generic[ScenarioT]):
    """One kind of study.

    Planning and execution are imported when they are first asked for: opening a study of sand
    must not wait for the solvers of casting, and no plan for what draws pictures.
    """

    name: str
    """As ``kind`` in a study's file."""
    scenario: type[ScenarioT]
    study: type[Study]
    open_planning: Callable[[], Planning[ScenarioT]]
    open_execution: Callable[[], Execution[ScenarioT]]
    material: type[Section] | None = None
    """What a material file holds for it; None where it has none."""
    absent: tuple[str, ...] = OF_SAND
    """Sections that a study of this kind does not have."""
    draws_by_lot: bool = False
    """Whether runs of other seeds differ, so that replicates tell something."""
    labels_have_units: bool = True
    """Whether the unit in a swept key's name stands in names of runs: those of sand have none."""
    defaults: Callable[[], dict[str, Any]] = _nothing
    """Scenario of a study that states nothing."""

    @cached_property
    def planning(self) -> Planning[ScenarioT]:
        """What it says of a run before it starts."""
        return self.open_planning()

    @cached_property
    def execution(self) -> Execution[ScenarioT]:
        """How it computes a run."""
        return self.open_execution()
