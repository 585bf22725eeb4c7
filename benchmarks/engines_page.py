"""The page docs/speed.md, written from what was measured."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from benchmarks.engines_page_core import core
from benchmarks.engines_rates import TARGETS
from benchmarks.engines_scale import SCALE_TARGET, THREADS_TARGET
from benchmarks.tables import number, table, with_range

_HOW = """\
# Speed

Made by `make benchmarks` (`benchmarks/engines.py`) on a machine with nothing else to do; do not
edit. `make benchmarks QUICK=--quick` takes tiny scenes and writes to `results/benchmarks/`. What is
compared ran in turns (A B C, A B C, ...), {rounds} of about {block_s:g} s each. Given are medians
over the turns, of times and of ratios within a turn, and in brackets the least and the most. All of
it took {minutes:.0f} minutes; the load of the machine was {before:.1f} before and {after:.1f}
after. Ratios travel to other machines better than times.

![Rates, sizes, limits and accuracy](speed.png)
"""
_SIDE_BY_SIDE = """\
## Engines side by side

One process on one core, the default sand of five sizes (discs with the inertia of spheres, which
all engines know), friction and rolling on, no background damping, walls as stiff as the grains.
The reference settles a bed once; each engine is then given the same places and velocities, without
contact history, and computes its own deck with the neighbour skin that it takes by itself. At rest
hardly any neighbours are listed anew; the shaken bed, one period a turn, has that too. A pair
counts once, so contacts per grain are half the coordination number. All engines do the same number
of steps; how far the farthest grain moved meanwhile shows that the bed stayed what it was.
"""
_SIZE = """\
## Scene size

Reference engine on one core, bare solver without recording. The larger beds are copies of the
smallest side by side in one long box: equally high, with equal pressure and contacts.
"""
_BYTES = """\
### Bytes per grain, array by array

Read from the arrays themselves. Those of pairs go with the pairs listed, those of chunks and walls
with the few that cross or are near.
"""
_ACCURACY = """\
## Accuracy against cost

Each engine with several time steps: the wall time of one simulated second of the smaller bed of
discs, from the rate above, and the error of an impact with a closed form: two of the smallest
discs at critical damping, whose restitution is exp(-2) where contacts do not pull. The error is
relative, root mean square over eight places of the first touch within a step.
"""
_NOT_MEASURED = """\
## Not measured

LAMMPS and LIGGGHTS compiled from source for this processor: both are taken as they come, so a part
of the ratio is the compiler's and not the method's. Accelerated packages of LAMMPS, MPI runs, more
than two threads, other processors. Hardware counters, which a virtual machine hides: wrong guesses
are inferred from times alone. Square beds of a million discs, whose neighbours lie further apart in
memory than those of a long box. Error against cost of a filled and vibrated bed: a fill statistic
needs many seeds at each time step. One impact stands for it, which says nothing of an ensemble.
"""


def _verdict(met: bool) -> str:
    return "met" if met else "**not met**"


def _ratio_targets(found: dict[str, Any]) -> Iterable[tuple[str, str, str, str]]:
    for row in found["rates"]:
        for engine, least in TARGETS[row["dimension"]].items():
            over = row["reference_over"].get(engine)
            if not row["settled"] or over is None:
                continue
            what = f"{row['bed']}: reference over {engine}, one core"
            met = _verdict(over["median"] >= least)
            yield what, f"at least {least:g}", with_range(over, ".2f"), met


def _threads_target(threads: dict[str, Any]) -> tuple[str, str, str, str]:
    what = "two threads over two processes of one thread each, at the same time"
    target = f"at least {THREADS_TARGET:.0%}"
    if "missing" in threads:
        return what, target, threads["missing"], "not measured"
    over = threads["threads_over_processes"]
    met = _verdict(over["median"] >= THREADS_TARGET)
    return f"{threads['bed']}: {what}", target, with_range(over, ".2f"), met


def _scale_target(scale: dict[str, Any], kind: str) -> tuple[str, str, str, str]:
    smallest, largest = (number(scale["sizes"][i]) for i in (0, -1))
    over = scale["dearest_over_cheapest"]
    return (
        f"cost per grain-step from {smallest} to {largest} {kind}, dearest over cheapest",
        f"at most {SCALE_TARGET:g}",
        f"{over:.2f}",
        _verdict(over <= SCALE_TARGET),
    )


def _targets(found: dict[str, Any]) -> str:
    rows = [
        *_ratio_targets(found),
        _threads_target(found["threads"]),
        _scale_target(found["scale"]["2"], "discs"),
        _scale_target(found["scale"]["3"], "spheres"),
    ]
    return "## Targets\n\n" + table(["what", "target", "measured", ""], rows)


def _machine(found: dict[str, Any]) -> str:
    known = found["machine"]
    rows = [
        ["processor", f"{known['processor']}, {known['cores']} cores, {known['caches']}"],
        ["system", known["system"]],
        ["commit", found["commit"]],
        *([name, text] for name, text in found["compiled"].items()),
        ["others", ", ".join(f"{k} {v}" for k, v in found["versions"].items())],
    ]
    return "## Machine and builds\n\n" + table(["", ""], rows)


def _rates(found: dict[str, Any]) -> str:
    rows = []
    for row in found["rates"]:
        for name, one in row["engines"].items():
            over = row["reference_over"].get(name)
            rows.append([
                row["bed"],
                name,
                with_range(one["grain_steps_per_s"], ".2f", 1e6),
                with_range(over, ".2f") if over else "",
                f"{one['contacts_per_grain']:.2f}",
                f"{one['listed_per_grain']:.2f}",
                f"{one['skin_m'] * 1e3:.2f}",
                f"{one['farthest_moved_m'] * 1e3:.2f}",
            ])  # fmt: skip
    head = ["bed", "engine", "million grain-steps/s", "reference over it", "contacts per grain",
            "listed per grain", "skin, mm", "farthest moved, mm"]  # fmt: skip
    missing = {n: text for row in found["rates"] for n, text in row["missing"].items()}
    lines = [f"\nNot measured: {name}. {text}\n" for name, text in missing.items()]
    return _SIDE_BY_SIDE + "\n" + table(head, rows) + "".join(lines)


def _threads(threads: dict[str, Any]) -> str:
    if "missing" in threads:
        return f"## Two threads\n\nNot measured: {threads['missing']}.\n"
    rates = threads["grain_steps_per_s"]
    return (
        f"## Two threads\n\n{threads['bed']}, {threads['steps']} steps a turn. Two threads on one "
        f"bed: {with_range(rates['threads'], '.1f', 1e6)} million grain-steps/s. Two processes at "
        "the same time, one thread, one bed and one core each: "
        f"{with_range(rates['processes'], '.1f', 1e6)} together. The first over the second: "
        f"{with_range(threads['threads_over_processes'], '.2f')}.\n"
    )


def _sizes(scale: dict[str, Any]) -> str:
    rows = []
    for dimension, kind in (("2", "discs"), ("3", "spheres")):
        one = scale[dimension]
        for size, cost, memory in zip(
            one["sizes"], one["ns_per_grain_step"], one["memory"], strict=True
        ):
            rows.append([
                f"{number(size)} {kind}",
                with_range(cost),
                f"{sum(memory['bytes_per_grain'].values()):.0f}",
                f"{memory['contacts_per_grain']:.2f}",
                f"{memory['listed_per_grain']:.2f}",
            ])  # fmt: skip
    head = ["bed", "ns per grain-step", "bytes per grain", "contacts per grain", "listed per grain"]
    words = [
        f"{kind.capitalize()}: dearest over cheapest {scale[d]['dearest_over_cheapest']:.2f}, "
        f"largest over smallest {with_range(scale[d]['largest_over_smallest'], '.2f')}."
        for d, kind in (("2", "discs"), ("3", "spheres"))
    ]
    return _SIZE + "\n" + table(head, rows) + "\n" + "\n".join(words) + "\n"


def _bytes(scale: dict[str, Any]) -> str:
    discs, spheres = (scale[d]["memory"][-1] for d in ("2", "3"))
    rows = [
        [name, f"{size:.1f}", f"{spheres['bytes_per_grain'][name]:.1f}"]
        for name, size in discs["bytes_per_grain"].items()
    ]
    totals = (sum(m["bytes_per_grain"].values()) for m in (discs, spheres))
    rows.append(["all", *(f"{total:.1f}" for total in totals)])
    head = ["array", f"{number(discs['grains'])} discs", f"{number(spheres['grains'])} spheres"]
    return _BYTES + "\n" + table(head, rows)


def _accuracy(rows: list[dict[str, Any]]) -> str:
    cells = [
        [
            row["engine"],
            f"{row['fraction']:g}",
            f"{row['step_s'] * 1e6:.2f}",
            f"{row['wall_s_per_s']:.1f}",
            f"{row['error']:.2%}",
        ]
        for row in rows
    ]
    head = ["engine", "step over the critical one", "step, µs", "wall s per simulated s", "error"]
    return _ACCURACY + "\n" + table(head, cells)


def page(found: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    found : dict
        What ``benchmarks.engines`` measured.
    """
    parts = [
        _HOW.format(
            block_s=found["block_s"],
            rounds=found["rounds"],
            minutes=found["measured_s"] / 60,
            before=found["load_average"],
            after=found["load_average_after"],
        ),
        _targets(found),
        _machine(found),
        _rates(found),
        _threads(found["threads"]),
        _sizes(found["scale"]),
        _bytes(found["scale"]),
        *core(found["roofline"]),
        _accuracy(found["accuracy"]),
        _NOT_MEASURED,
    ]
    return "\n".join(parts)
