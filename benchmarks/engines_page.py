"""The page docs/speed.md, written from what was measured."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from benchmarks.engines_rates import TARGETS
from benchmarks.engines_roofline import (
    CHAINED_PER_CONTACT,
    FLOPS_PER_CONTACT,
    FLOPS_PER_GRAIN,
    FLOPS_PER_LISTED,
    QUOTIENTS_PER_GRAIN,
    ROOTS_PER_CONTACT,
)
from benchmarks.engines_scale import SCALE_TARGET, THREADS_TARGET

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
_LIMIT = """\
## Limits of the core

Measured in the same process. The bandwidth is that of STREAM's triad over arrays as large together
as those of the bed, 24 bytes counted a number (the line that is read before it is written is not);
so a bed in the cache has that of the cache. The traffic counts each array of the step loop once as
it is read and once as it is written, and no reuse between steps. Operations are counted by hand in
`benchmarks/engines_roofline.py`; square roots and quotients stand apart, since they share one unit
that takes several cycles for each.
"""
_PARTS = """\
### Where a step goes

ns per grain-step. Each part is a step with it less a step without it, so a small part may come out
below zero; the rest is the whole step less all parts. Guessing is what the list of pairs takes
beyond the lists of the touching pairs alone and of the others alone: wrong guesses at the branch
whether a pair touches.
"""
_VECTORS = """\
LLVM does not make vectors across contacts: which pairs touch is known one by one, and forces are
added to grains that several contacts share. Tried once in a prototype and not taken: touching pairs
gathered in blocks of 64 for which the law is compiled to vectors. In 3D it took 96 ns per
grain-step where the plain loop of then took 114, which does not pay for a second way through the
contact law. What did pay, in paired runs: one table of what the law makes of two kinds of grain,
a clamp instead of a root in 2D (together 1.2 in 2D, 1.04 in 3D), indices that need no question
whether they count from the end (1.1 in both), and functions that begin lines of the cache (1.2 for
2 500 discs, where kernels loaded from the disk were slower than the same ones freshly compiled).
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


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _with_range(spread: dict[str, float], form: str = ".1f", unit: float = 1.0) -> str:
    median, least, most = (format(spread[key] / unit, form) for key in ("median", "least", "most"))
    return f"{median} ({least} to {most})"


def _number(value: int) -> str:
    return f"{value:,}".replace(",", " ")


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
            yield what, f"at least {least:g}", _with_range(over, ".2f"), met


def _threads_target(threads: dict[str, Any]) -> tuple[str, str, str, str]:
    what = "two threads over two processes of one thread each, at the same time"
    target = f"at least {THREADS_TARGET:.0%}"
    if "missing" in threads:
        return what, target, threads["missing"], "not measured"
    over = threads["threads_over_processes"]
    met = _verdict(over["median"] >= THREADS_TARGET)
    return f"{threads['bed']}: {what}", target, _with_range(over, ".2f"), met


def _scale_target(scale: dict[str, Any], kind: str) -> tuple[str, str, str, str]:
    smallest, largest = (_number(scale["sizes"][i]) for i in (0, -1))
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
    return "## Targets\n\n" + _table(["what", "target", "measured", ""], rows)


def _machine(found: dict[str, Any]) -> str:
    known = found["machine"]
    rows = [
        ["processor", f"{known['processor']}, {known['cores']} cores, {known['caches']}"],
        ["system", known["system"]],
        ["commit", found["commit"]],
        *([name, text] for name, text in found["compiled"].items()),
        ["others", ", ".join(f"{k} {v}" for k, v in found["versions"].items())],
    ]
    return "## Machine and builds\n\n" + _table(["", ""], rows)


def _rates(found: dict[str, Any]) -> str:
    rows = []
    for row in found["rates"]:
        for name, one in row["engines"].items():
            over = row["reference_over"].get(name)
            rows.append([
                row["bed"],
                name,
                _with_range(one["grain_steps_per_s"], ".2f", 1e6),
                _with_range(over, ".2f") if over else "",
                f"{one['contacts_per_grain']:.2f}",
                f"{one['listed_per_grain']:.2f}",
                f"{one['skin_m'] * 1e3:.2f}",
                f"{one['farthest_moved_m'] * 1e3:.2f}",
            ])  # fmt: skip
    head = ["bed", "engine", "million grain-steps/s", "reference over it", "contacts per grain",
            "listed per grain", "skin, mm", "farthest moved, mm"]  # fmt: skip
    missing = {n: text for row in found["rates"] for n, text in row["missing"].items()}
    lines = [f"\nNot measured: {name}. {text}\n" for name, text in missing.items()]
    return _SIDE_BY_SIDE + "\n" + _table(head, rows) + "".join(lines)


def _threads(threads: dict[str, Any]) -> str:
    if "missing" in threads:
        return f"## Two threads\n\nNot measured: {threads['missing']}.\n"
    rates = threads["grain_steps_per_s"]
    return (
        f"## Two threads\n\n{threads['bed']}, {threads['steps']} steps a turn. Two threads on one "
        f"bed: {_with_range(rates['threads'], '.1f', 1e6)} million grain-steps/s. Two processes at "
        "the same time, one thread, one bed and one core each: "
        f"{_with_range(rates['processes'], '.1f', 1e6)} together. The first over the second: "
        f"{_with_range(threads['threads_over_processes'], '.2f')}.\n"
    )


def _sizes(scale: dict[str, Any]) -> str:
    rows = []
    for dimension, kind in (("2", "discs"), ("3", "spheres")):
        one = scale[dimension]
        for size, cost, memory in zip(
            one["sizes"], one["ns_per_grain_step"], one["memory"], strict=True
        ):
            rows.append([
                f"{_number(size)} {kind}",
                _with_range(cost),
                f"{sum(memory['bytes_per_grain'].values()):.0f}",
                f"{memory['contacts_per_grain']:.2f}",
                f"{memory['listed_per_grain']:.2f}",
            ])  # fmt: skip
    head = ["bed", "ns per grain-step", "bytes per grain", "contacts per grain", "listed per grain"]
    words = [
        f"{kind.capitalize()}: dearest over cheapest {scale[d]['dearest_over_cheapest']:.2f}, "
        f"largest over smallest {_with_range(scale[d]['largest_over_smallest'], '.2f')}."
        for d, kind in (("2", "discs"), ("3", "spheres"))
    ]
    return _SIZE + "\n" + _table(head, rows) + "\n" + "\n".join(words) + "\n"


def _bytes(scale: dict[str, Any]) -> str:
    discs, spheres = (scale[d]["memory"][-1] for d in ("2", "3"))
    rows = [
        [name, f"{size:.1f}", f"{spheres['bytes_per_grain'][name]:.1f}"]
        for name, size in discs["bytes_per_grain"].items()
    ]
    totals = (sum(m["bytes_per_grain"].values()) for m in (discs, spheres))
    rows.append(["all", *(f"{total:.1f}" for total in totals)])
    head = ["array", f"{_number(discs['grains'])} discs", f"{_number(spheres['grains'])} spheres"]
    return _BYTES + "\n" + _table(head, rows)


def _peaks(peaks: dict[str, Any]) -> str:
    rows = [
        [f"triad over {row['bytes'] / 1e6:g} MB", _with_range(row), "GB/s"] for row in peaks["gb_s"]
    ]
    for name, key in (("scalar", "scalar_ns_per_flop"), ("vector", "vector_ns_per_flop")):
        bits = f" of {peaks['vector_bits']} bits" if name == "vector" else ""
        flops = {k: 1.0 / peaks[key][v] for k, v in
                 (("median", "median"), ("least", "most"), ("most", "least"))}  # fmt: skip
        rows.append([f"multiply-add, {name}{bits}", _with_range(flops), "Gflop/s"])
    for name, key in (
        ("quotient", "ns_per_quotient"),
        ("square root", "ns_per_root"),
        ("square root and quotient, waiting for each other", "ns_per_chained_root_and_quotient"),
    ):
        rows.append([name, _with_range(peaks[key], ".2f"), "ns"])
    return _LIMIT + "\n" + _table(["one core", "measured", ""], rows)


def _nearest(bed: dict[str, Any]) -> str:
    """The highest of the limits that the loop cannot pass as it is compiled."""
    names = [name for name in bed["bounds_ns"] if name != "vector arithmetic"]
    best = max(names, key=lambda name: bed["bounds_ns"][name])
    return f"{best}, {bed['fractions'][best]:.0%}"


def _bounds(beds: list[dict[str, Any]]) -> str:
    limits = list(beds[0]["bounds_ns"])
    rows = [
        [
            bed["bed"],
            _with_range(bed["ns_per_grain_step"]),
            f"{bed['bytes_per_grain_step']:.0f}",
            f"{bed['gb_s']['median']:.1f}",
            f"{bed['flops_per_grain_step']:.0f}",
            *(f"{bed['bounds_ns'][name]:.1f} ({bed['fractions'][name]:.0%})" for name in limits),
            _nearest(bed),
        ]
        for bed in beds
    ]
    head = ["bed", "measured ns per grain-step", "bytes", "GB/s there", "operations",
            *(f"{name}, ns (share)" for name in limits), "nearest limit"]  # fmt: skip
    return (
        "### The step against the limits\n\nPer grain-step: the least time by each limit, and what "
        "share of the measured time that is. The vector limit would need contacts side by side in "
        "vectors.\n\n" + _table(head, rows)
    )


def _operations() -> str:
    rows = [
        [name, per, str(discs), str(spheres)]
        for per, counted in (
            ("listed pair", FLOPS_PER_LISTED),
            ("contact", FLOPS_PER_CONTACT),
            ("grain", FLOPS_PER_GRAIN),
        )
        for name, discs, spheres in counted
    ]
    words = (
        f"Beside these a contact has {ROOTS_PER_CONTACT[2]} square root and quotient in 2D and "
        f"{ROOTS_PER_CONTACT[3]} of each in 3D, of which {CHAINED_PER_CONTACT[3]} pairs wait for "
        f"each other, and a grain {QUOTIENTS_PER_GRAIN} quotients. Contacts with walls are not "
        "counted.\n"
    )
    return (
        "### Operations counted\n\nA multiply-add is two.\n\n"
        + _table(["what", "per", "discs", "spheres"], rows) + "\n" + words
    )  # fmt: skip


def _parts(beds: list[dict[str, Any]]) -> str:
    shown = [bed for bed in beds if "parts" in bed]
    rows = []
    for group, name, title in (
        ("within_pairs", "the loop over grains", "pairs: the loop over grains"),
        ("within_pairs", "pairs apart", "pairs: listed pairs that do not touch"),
        ("within_pairs", "contacts", "pairs: contacts"),
        ("within_pairs", "guessing which", "pairs: guessing which touch"),
        ("parts", "surfaces", "walls"),
        ("parts", "gather", "sums from other chunks"),
        ("parts", "kick", "velocities (kick)"),
        ("parts", "drift", "positions (drift)"),
        ("parts", "rest", "rest"),
    ):
        rows.append([title, *(_with_range(bed[group][name]) for bed in shown)])
    rows.append(["whole step", *(_with_range(bed["ns_per_grain_step"]) for bed in shown)])
    chain = "contacts, if each waited for the one before: its chained roots and quotients alone"
    rows.append([chain, *(f"{bed['waiting_ns']:.1f}" for bed in shown)])
    listing = (_with_range(bed["listing_ns_per_grain"]) for bed in shown)
    rows.append(["one listing of neighbours, ns per grain", *listing])
    head = ["part", *(bed["bed"] for bed in shown)]
    return _PARTS + "\n" + _table(head, rows) + "\n" + _VECTORS


def _accuracy(rows: list[dict[str, Any]]) -> str:
    table = [
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
    return _ACCURACY + "\n" + _table(head, table)


def page(found: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    found : dict
        What ``benchmarks.engines`` measured.
    """
    beds = found["roofline"]["beds"]
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
        _peaks(found["roofline"]["peaks"]),
        _bounds(beds),
        _parts(beds),
        _operations(),
        _accuracy(found["accuracy"]),
        _NOT_MEASURED,
    ]
    return "\n".join(parts)
