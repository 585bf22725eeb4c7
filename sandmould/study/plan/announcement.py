"""A plan written and told before its runs start, with their price at this machine's speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Literal

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.run import FILL
from sandmould.kinds.kind import AnyScenario, SpeedClass, StoredSpeed
from sandmould.runs.parent import say
from sandmould.runs.progress import duration_text
from sandmould.study.plan.batches import Batch, mark_done
from sandmould.study.plan.build_plan import Plan, writing
from sandmould.study.plan.lacking import WHOLE, Lack, Need, note_lacks
from sandmould.study.plan.ownership import write_owner
from sandmould.study.plan.plan_files import (
    beyond_line,
    later_lines,
    plan_table,
    write_plan,
    write_study,
)
from sandmould.study.plan.price import Prices, computed_wall_s, ratios_of, study_s
from sandmould.study.plan.stand_ins import stand_in_line
from sandmould.study.plan.trust import may_run

MEASURING_S = 10.0
"""What the measurement of one engine takes on an idle machine, about."""


def announce(
    plan: Plan, results: Path, cores: int, measure: Literal["nothing", "engines", "all"] = "nothing"
) -> str:
    """Write the plan to disk and say what it will take.

    ``measure``: what is measured first where this machine's speed is not known, which takes seconds
    an engine. With "nothing" no engine starts, and the price is an estimate there. With "engines" a
    program of the user's is not started: that is left to the start of its runs, "all".
    """
    write_files(plan, results)
    if measure == "all" or (measure == "engines" and plan.kind.planning.program is None):
        measure_speeds(plan, results)
    title = plan.study.study.title or plan.study.name
    return f"\n{title}\n{price(plan, results, cores)}{left_line(plan, results, cores)}"


def write_files(plan: Plan, results: Path) -> None:
    """Write the plan to disk, what differs of it."""
    folder = results / plan.study.name
    with writing(folder):
        write_owner(plan.study.path, folder)
        write_plan([*plan.fills, *plan.runs], folder)
        write_study(plan.study.study, folder)


def prepare(
    plan: Plan,
    results: Path,
    batches: Sequence[Batch] = (),
    found: dict[str, Lack] | None = None,
) -> str:
    """Note for Snakemake what each run lacks, and which batches lack nothing.

    ``found``: what runs lack; ``plan.lacks`` says so unless it is given.

    Says which runs are computed or measured again, and why.
    """
    folder = results / plan.study.name
    with writing(folder):
        found = plan.lacks(results) if found is None else found
        said = note_lacks([*plan.fills, *plan.runs], found, folder)
        mark_done(batches, found, folder)
        return said


def price(plan: Plan, results: Path, cores: int) -> str:
    """Say what the runs will take, as far as the machine's speed is known at what was measured."""
    prices = known_prices(plan, results)
    return (
        plan_table([*plan.fills, *plan.runs], prices, cores)
        + beyond_line(plan.beyond_table, plan.study.study.table_limits)
        + stand_in_line(plan.runs[0])
        + later_lines(plan.later, prices, cores)
    )


def left_line(plan: Plan, results: Path, cores: int) -> str:
    """How many runs have ended here, and what the others take; empty where all are to come."""
    if not (results / plan.study.name / "runs").is_dir():
        return ""
    found, runs = plan.lacks(results), [*plan.fills, *plan.runs]
    left = [run for run in runs if found.get(run.run, WHOLE).need is Need.COMPUTE]
    ended = len(plan.runs) - sum(run.part != FILL for run in left)
    if not left:
        again = f"; {len(found)} are to be measured" if found else ""
        return f"All runs have ended here: {ended}{again}.\n"
    prices = known_prices(plan, results)
    pieces = [prices.piece(run) for run in left]
    takes = f"the others take about {duration_text(study_s(pieces, cores))}"
    return f"{ended} of {len(plan.runs)} runs have ended here; {takes}.\n" if ended else ""


def known_prices(plan: Plan, results: Path) -> Prices:
    """What runs take, as far as it is known here; starts nothing.

    The plan knows nothing of a program of the user's: its finished runs count, where there are any.
    """
    rates = stored_speeds(plan)
    if plan.kind.planning.program is None:
        return Prices(rates)
    folder = results / plan.study.name
    taken = [(run, computed_wall_s(folder / run.place)) for run in plan.runs]
    return Prices(rates, ratios_of([(run, s) for run, s in taken if s > 0.0], rates))


def stored_speeds(plan: Plan) -> dict[SpeedClass, float]:
    """Work a second of a core of this machine by class, as far as it was measured before."""
    speed = plan.kind.planning.speed
    if speed is None:
        return {}
    stored = {
        each: [rate for rate in (speed.stored(s) for s in scenarios) if rate is not None]
        for each, scenarios in plan.classes.items()
    }
    return {each: min(rates) for each, rates in stored.items() if rates}


def measure_speeds(plan: Plan, results: Path) -> None:
    """Measure and store how fast this machine is where that is not known: seconds an engine.

    A program that the user has not allowed to run is not started for that either.

    Raises
    ------
    BadInputError
        Where the user's program fails at each point that was tried, as all runs then would. A
        point that fails alone is a run that fails: it is said, and the others are computed.
    """
    speed = plan.kind.planning.speed
    if speed is None or not may_run(plan.study, plan.runs):
        return
    if to_measure := _to_measure(plan, speed):
        say(to_measure)
    failures = dict[str, Problem]()
    runs_somewhere = False
    tried: list[AnyScenario] = []
    for scenario in chain.from_iterable(plan.classes.values()):
        if scenario in tried:
            continue
        tried.append(scenario)
        try:
            speed.measured(scenario, results)
            runs_somewhere = True
        except BadInputError as error:
            failures |= {str(problem): problem for problem in error.problems}
    if failures and not runs_somewhere:
        first = next(iter(failures.values()))
        raise BadInputError([replace(first, sentence=f"{first.sentence}. No run was begun")])
    for said in failures:
        say(f"{said} The other points are computed.")


def _to_measure(plan: Plan, speed: StoredSpeed[AnyScenario]) -> str:
    """Say what is not known yet and how long finding it out takes; empty where all is known."""
    unknown = [[s for s in alike if speed.stored(s) is None] for alike in plan.classes.values()]
    program = plan.kind.planning.program
    if program is not None:
        # one of several ranks has no pilot
        alone = [s for s in chain.from_iterable(unknown) if plan.kind.planning.ranks(s) == 1]
        decks = [s for n, s in enumerate(alone) if s not in alone[:n]]
        names = {next(iter(program.files(s).values())).name for s in decks}
        times = f" at {len(decks)} points, each" if len(decks) > 1 else ""
        return f"Trying {', '.join(sorted(names))}{times} for some seconds." if decks else ""
    if not (slow := sum(map(bool, unknown))):
        return ""
    return (
        f"Measuring the speed of this machine, once: about {slow * MEASURING_S:g} s, and up "
        "to 2 min where code is compiled first."
    )
