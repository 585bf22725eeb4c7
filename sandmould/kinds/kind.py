"""What makes a kind of study: its types, how its runs are planned, how they are computed."""

from __future__ import annotations

import contextlib
import math
import os
import platform
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, Generic, TypeVar

from sandmould import ROOT
from sandmould.bad_input import Problem
from sandmould.definition.run import Run
from sandmould.definition.study import Study
from sandmould.digest import SHORT, code_identity, digest
from sandmould.runs.files import write_text
from sandmould.runs.hashing import solution_hash
from sandmould.runs.measures import MeasureGroup
from sandmould.runs.products import Computed, Cost
from sandmould.runs.provenance import processor
from sandmould.runs.templates import Note
from sandmould.scenario.quantity import Section
from sandmould.user_cache import user_cache

AnyScenario = Section
"""A scenario of any kind."""
ScenarioT = TypeVar("ScenarioT", bound=Section)
SpeedClass = tuple[str, int]
"""Engine and dimension: what the speed of a core depends on most."""
CORE_SECONDS = "core-seconds"
BASE_MEMORY_MB = 600
"""Python and its libraries."""


class UserProgram(ABC, Generic[ScenarioT]):
    """What a kind says of programs of the user's that its runs execute."""

    shipped: Path
    """Folder of those that come with us."""
    copied: str
    """Folder of a run that takes copies of its files."""

    @abstractmethod
    def files(self, scenario: ScenarioT) -> Mapping[str, Path]:
        """Its files by key: they must lie in folders that the study allows."""

    @abstractmethod
    def foreign(self, scenario: ScenarioT) -> str:
        """Why it is not one of those shipped, in a few words; empty where it is."""

    @abstractmethod
    def to_read(self, scenarios: Sequence[ScenarioT]) -> list[str]:
        """Lines of it that a person should read before running it."""


class StoredSpeed(ABC, Generic[ScenarioT]):
    """How fast a core of this machine is: measured once for all scenarios that run at one speed.

    A kind says what they have in common, and how the speed is measured.
    """

    basis = "at the speed measured on this machine"
    """What a price rests on that was reckoned with it."""

    @abstractmethod
    def computed_by(self, scenario: ScenarioT) -> str:
        """Name what is the same for all that run at one speed: engine, version, dimension."""

    @abstractmethod
    def trial(self, scenario: ScenarioT, results: Path) -> float | None:
        """Measure what is stored: work a second of one core; None where that failed."""

    def rate(self, scenario: ScenarioT, stored: float) -> float:
        """Work a second of one core by what is stored."""
        return stored

    def stored(self, scenario: ScenarioT) -> float | None:
        """Work a second of one core as measured before; None where it was not. Starts nothing."""
        try:
            found = float(self.file(scenario).read_text(encoding="utf-8"))
        except (OSError, ValueError):  # it was not measured, or the file is damaged
            return None
        return self.rate(scenario, found) if 0.0 < found < math.inf else None

    def measured(self, scenario: ScenarioT, results: Path) -> float | None:
        """The same, measured now and stored where it was not before; None where it cannot be.

        Raises
        ------
        BadInputError
            Where a program of the user's stops with an error.
        """
        rate = self.stored(scenario)
        if rate is None and (found := self.trial(scenario, results)) is not None:
            file = self.file(scenario)
            partial = file.with_suffix(f".{os.getpid()}")  # another start may write its own
            with contextlib.suppress(OSError):  # it is measured anew where nothing can be kept
                file.parent.mkdir(parents=True, exist_ok=True)
                partial.write_text(str(found), encoding="utf-8")
                partial.replace(file)
            rate = self.rate(scenario, found)
        return rate

    def file(self, scenario: ScenarioT) -> Path:
        """Where the speed of a scenario is kept, by all that it depends on."""
        machine = f"{platform.node()} {processor()} numba {version('numba')}"
        key = digest(f"{machine} {self.computed_by(scenario)}")[:SHORT]
        return user_cache() / "speeds" / f"{key}.txt"


class Planning(ABC, Generic[ScenarioT]):
    """What a kind says of a run before it starts.

    A kind states its measures, the files that compute its runs, and how long they take. The rest
    is as here: runs of one process, whose work is time, computed by our own code.
    """

    work_unit = CORE_SECONDS
    """Unit of ``planned_work``; ``CORE_SECONDS`` where work is time and is priced as such."""
    slower = 10.0
    """Than predicted a machine may be, and a run longer than expected."""
    guess = "an estimate"
    """What a price by ``predicted_s`` rests on."""
    speed: StoredSpeed[ScenarioT] | None = None
    """None where ``predicted_s`` is all that is known."""
    program: UserProgram[ScenarioT] | None = None
    """None where all that a run executes is shipped."""
    measuring: tuple[str, ...] = ()
    """Files, from the root of the house, whose code takes the measures; what draws is left out."""

    @property
    @abstractmethod
    def measures(self) -> tuple[MeasureGroup[ScenarioT], ...]:
        """All that its runs can be measured by: the one list of names, units and meanings."""

    @abstractmethod
    def sources(self, scenario: ScenarioT) -> list[Path]:
        """Files that its runs are computed again for when they change."""

    @abstractmethod
    def predicted_s(self, scenario: ScenarioT) -> float:
        """Wall time of a run at speeds that are the same on every machine."""

    @cached_property
    def measuring_hash(self) -> str:
        """State of the code that takes the measures: runs measured by another one are so again."""
        return code_identity([[ROOT / file for file in self.measuring]])

    def measured_by(self, scenario: ScenarioT) -> str:
        """State of all that says how a run is measured."""
        return self.measuring_hash

    def unmeasurable(self, scenario: ScenarioT, folder: Path) -> list[str]:
        """Names of ``measures`` of a scenario that what its run left cannot give."""
        return []

    def resolved(self, scenario: ScenarioT) -> ScenarioT:
        """The scenario with the hashes of the files that it names."""
        return scenario

    def seeded(self, scenario: ScenarioT, seed: int) -> ScenarioT:
        """A resolved scenario with another seed."""
        return scenario.model_copy(update={"seed": seed})

    def takes_seed(self, scenario: ScenarioT) -> bool:
        """Whether replicates, which differ in their seeds, can differ at all."""
        return True

    def problems(self, scenario: ScenarioT) -> list[Problem]:
        """What keeps a well-typed scenario from being run."""
        return []

    def engine_problem(self, scenario: ScenarioT) -> Problem | None:
        """Why this machine cannot compute it."""
        return None

    def template_hash(self, scenario: ScenarioT) -> str:
        """Hash of all that turns a scenario into a deck, and of our solver where it takes part."""
        return code_identity([self.sources(scenario)])

    def computed_hash(self, scenario: ScenarioT) -> str:
        """Hash of what is computed, whatever it is called."""
        return solution_hash(scenario, self.template_hash(scenario))

    def threads(self, scenario: ScenarioT) -> int:
        """Cores that a run keeps busy, as MPI ranks or as threads."""
        return 1

    def ranks(self, scenario: ScenarioT) -> int:
        """MPI ranks of a run."""
        return 1

    def memory_mb(self, scenario: ScenarioT) -> int:
        """Memory to ask for."""
        return BASE_MEMORY_MB

    def allowed_s(self, scenario: ScenarioT) -> float:
        """Wall time to ask for, less what any job takes."""
        return self.slower * self.predicted_s(scenario)

    def planned_work(self, scenario: ScenarioT) -> float:
        """What a run costs, before it starts."""
        return self.threads(scenario) * self.predicted_s(scenario)

    def planned_s(self, scenario: ScenarioT) -> float:
        """Simulated time of a whole run; 0 where nobody knows it before."""
        return 0.0

    def speed_class(self, scenario: ScenarioT) -> SpeedClass:
        """Scenarios of one class are computed at one speed."""
        return type(scenario).__name__.lower(), 0

    def plan_cells(self, scenario: ScenarioT) -> Mapping[str, str]:
        """What the plan says of a run, by heading."""
        return {}

    def fill(self, scenario: ScenarioT) -> ScenarioT | None:
        """The part that comes first, as a scene of its own: runs with equal ones share it."""
        return None

    def state_bytes(self, scenario: ScenarioT) -> int:
        """Disk that the state at the end of a scene takes."""
        return 0

    def beside_s(self, scenario: ScenarioT) -> float:
        """Wall time of a run that does not grow with its work."""
        return 0.0

    def notes(self, scenario: ScenarioT) -> Sequence[Note]:
        """What a user should know of a run before it starts; several runs tell one thing once."""
        return ()

    def settings_lines(self, scenarios: Iterable[ScenarioT]) -> Sequence[str]:
        """What the settings of a study ask of a machine, as lines; of one scenario a setting."""
        return ()


class Execution(ABC, Generic[ScenarioT]):
    """How a kind computes a run.

    A kind states what its runs leave and cost, computes them and measures what they left.
    """

    @property
    @abstractmethod
    def products(self) -> tuple[str, ...]:
        """What a run leaves beside outcome, cost and provenance."""

    @abstractmethod
    def compute(self, run: Run, folder: Path) -> Computed:
        """Compute a run from its newest checkpoint, or from its beginning."""

    @abstractmethod
    def no_cost(self, scenario: ScenarioT) -> Cost:
        """Cost of a run that has not begun."""

    @abstractmethod
    def measure(self, run: Run, folder: Path) -> None:
        """Measure what a run left behind; ``measures.tsv`` last."""

    def export(self, run: Run, folder: Path) -> None:
        """Draw the end of a measured run, and write what other programs read: ``EXPORTED``."""

    def render(self, run: Run, folder: Path) -> None:
        """Write the deck of a run into its folder: every value of its scenario, with its source."""
        solver = self.no_cost(run.scenario).version
        lines = [
            f"# Study {run.study}, run {run.run}: what the solver {solver} is given",
            *_value_lines(run.scenario.model_dump(mode="json"), run.sources),
        ]
        write_text(folder / "deck.in", "\n".join(lines) + "\n")

    def complete(self, scenario: ScenarioT, work: Path) -> None:
        """Make the products in a work folder that a broken run never wrote, if others read them."""

    def load_computing(self, scenario: ScenarioT) -> None:
        """Import what computing needs, for a process that forks for each run.

        What starts threads, MPI or an engine must stay for the run's own process.
        """

    def load_measuring(self, scenario: ScenarioT) -> None:
        """Import what measuring needs, as ``load_computing`` does."""


def _value_lines(tree: Any, sources: Mapping[str, str], key: str = "") -> list[str]:
    """One line a value; a list with one source stays together."""
    if key in sources or not isinstance(tree, dict | list):
        return [f"{key} = {tree}".ljust(60) + f" # {sources.get(key, 'not stated')}"]
    each = tree.items() if isinstance(tree, dict) else enumerate(tree)
    return [
        line for n, v in each for line in _value_lines(v, sources, f"{key}.{n}" if key else str(n))
    ]


def opened_later(module: str, name: str) -> Callable[[], Any]:
    """Open a class of a module that is imported when it is first asked for."""
    return lambda: getattr(import_module(module), name)()


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
    draws_by_lot: bool = False
    """Whether runs of other seeds differ, so that replicates tell something."""
    labels_have_units: bool = True
    """Whether the unit in a swept key's name stands in names of runs: those of sand have none."""

    @property
    def defaults(self) -> dict[str, Any]:
        """Scenario of a study that states nothing."""
        field = self.study.model_fields["scenario"]
        return {} if field.is_required() else field.default.model_dump(mode="json")

    @cached_property
    def planning(self) -> Planning[ScenarioT]:
        """What it says of a run before it starts."""
        return self.open_planning()

    @cached_property
    def execution(self) -> Execution[ScenarioT]:
        """How it computes a run."""
        return self.open_execution()
