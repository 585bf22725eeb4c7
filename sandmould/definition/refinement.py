"""What a study asks of its rounds, and what keeps it from having any."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from sandmould.bad_input import Problem
from sandmould.definition.sweep import Point, Range, Sweep, points
from sandmould.limits import RUNS
from sandmould.runs.formatting import is_number
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED
from sandmould.statistics.config import fewest_points


class Refinement(Section):
    """Rounds of further runs where the optimum may lie, after those of the sweep."""

    rounds: int = quantity(
        0,
        "Most rounds after the sweep; none computes the sweep alone.",
        source=ARGUED,
        ge=0,
        le=100,
    )
    runs: int = quantity(
        6,
        "Runs of a round, shared among new points and further replicates as the spread asks.",
        source=ARGUED,
        ge=1,
        le=1000,
    )
    adds: Literal["points", "replicates"] = quantity(
        "points",
        "What rounds add. points: points where the optimum may lie, and replicates where the "
        "spread hides it. replicates: replicates alone, for the settings that are not ruled out "
        "yet.",
        source=ARGUED,
    )
    half_width: float | None = quantity(
        None,
        "For rounds of replicates: half width of the 95 % interval of the difference between the "
        "two best settings, in the unit of the objective. Rounds end once it is this small.",
        source=ARGUED,
        gt=0,
    )
    interval: dict[str, Annotated[float, Field(gt=0)]] = Field(
        {},
        description="Swept keys, each with a width of the optimum's 95 % interval in the unit of "
        "the key. Rounds end once all intervals are as narrow.",
    )
    budget_core_h: float | None = quantity(
        None,
        "Processor time that all runs may take: rounds end before it is exceeded.",
        unit="h",
        source=ARGUED,
        gt=0,
    )

    @property
    def adds_points(self) -> bool:
        """Whether there are rounds that look for the optimum between the points of the sweep."""
        return self.rounds > 0 and self.adds == "points"


def problems(
    refine: Refinement, sweep: Sweep, scenario: Section, better: str, replicates: int
) -> Iterator[Problem]:
    """List what is wrong with the rounds of a study whose sweep has no problems."""
    if not refine.rounds:
        if refine.interval or refine.budget_core_h is not None or refine.half_width is not None:
            yield Problem("refine.rounds", 0, "at least 1 where refine says when rounds end")
        return
    if better == "neither":
        yield Problem("refine.rounds", refine.rounds, "0 where objective.better is neither")
    if not sweep.swept:
        yield Problem("refine.rounds", refine.rounds, "0 in a study that sweeps nothing")
        return
    swept = points(sweep, scenario)
    yield from RUNS.problems("refine.rounds", len(swept) + refine.rounds * refine.runs)
    if refine.adds == "replicates":
        yield from _problems_of_replicates(refine, len(swept), replicates)
    else:
        yield from _problems_of_points(refine, sweep, swept)


def _problems_of_replicates(
    refine: Refinement, number_of_points: int, replicates: int
) -> Iterator[Problem]:
    if refine.interval:
        valid = "absent where refine.adds is replicates: refine.half_width says when those end"
        yield Problem("refine.interval", refine.interval, valid)
    if replicates < 2:
        valid = "at least 2 where refine.adds is replicates: one tells nothing of the spread"
        yield Problem("replicates", replicates, valid)
    if number_of_points < 2:
        yield Problem("sweep", "1 point", "two points or more where refine.adds is replicates")


def _problems_of_points(refine: Refinement, sweep: Sweep, swept: list[Point]) -> Iterator[Problem]:
    if refine.half_width is not None:
        valid = "absent unless refine.adds is replicates: refine.interval says when rounds end"
        yield Problem("refine.half_width", refine.half_width, valid)
    keys = sweep.swept
    for key in keys:
        values = [p[key] for p in swept]
        if isinstance(sweep.keys.get(key), Range) or all(map(is_number, values)):
            if len(set(values)) == 1:
                yield Problem(f"sweep.keys.{key}", values[0], "two values or more, with rounds")
            continue
        yield Problem(f"sweep.keys.{key}", values[0], "numbers, in a study with rounds")
    for key in refine.interval:
        if key not in keys:
            yield Problem("refine.interval", key, f"a swept key, {' or '.join(keys)}")
    fewest = fewest_points(len(keys))
    if len(swept) < fewest:
        valid = f"at least {fewest} points for rounds to begin with"
        yield Problem("sweep", f"{len(swept)} points", valid)
