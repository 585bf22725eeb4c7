"""The part of docs/speed.md on one core: its limits, where a step goes, and the operations."""

from __future__ import annotations

from typing import Any

from benchmarks.engines_roofline import (
    CHAINED_PER_CONTACT,
    FLOPS_PER_CONTACT,
    FLOPS_PER_GRAIN,
    FLOPS_PER_LISTED,
    QUOTIENTS_PER_GRAIN,
    ROOTS_PER_CONTACT,
)
from benchmarks.tables import table, with_range

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


def _peaks(peaks: dict[str, Any]) -> str:
    rows = [
        [f"triad over {row['bytes'] / 1e6:g} MB", with_range(row), "GB/s"] for row in peaks["gb_s"]
    ]
    for name, key in (("scalar", "scalar_ns_per_flop"), ("vector", "vector_ns_per_flop")):
        bits = f" of {peaks['vector_bits']} bits" if name == "vector" else ""
        flops = {k: 1.0 / peaks[key][v] for k, v in
                 (("median", "median"), ("least", "most"), ("most", "least"))}  # fmt: skip
        rows.append([f"multiply-add, {name}{bits}", with_range(flops), "Gflop/s"])
    for name, key in (
        ("quotient", "ns_per_quotient"),
        ("square root", "ns_per_root"),
        ("square root and quotient, waiting for each other", "ns_per_chained_root_and_quotient"),
    ):
        rows.append([name, with_range(peaks[key], ".2f"), "ns"])
    return _LIMIT + "\n" + table(["one core", "measured", ""], rows)


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
            with_range(bed["ns_per_grain_step"]),
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
        "vectors.\n\n" + table(head, rows)
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
        + table(["what", "per", "discs", "spheres"], rows) + "\n" + words
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
        rows.append([title, *(with_range(bed[group][name]) for bed in shown)])
    rows.append(["whole step", *(with_range(bed["ns_per_grain_step"]) for bed in shown)])
    chain = "contacts, if each waited for the one before: its chained roots and quotients alone"
    rows.append([chain, *(f"{bed['waiting_ns']:.1f}" for bed in shown)])
    listing = (with_range(bed["listing_ns_per_grain"]) for bed in shown)
    rows.append(["one listing of neighbours, ns per grain", *listing])
    head = ["part", *(bed["bed"] for bed in shown)]
    return _PARTS + "\n" + table(head, rows) + "\n" + _VECTORS


def core(roofline: dict[str, Any]) -> list[str]:
    """Write the sections on one core.

    Parameters
    ----------
    roofline : dict
        What ``benchmarks.engines_roofline`` measured.
    """
    beds = roofline["beds"]
    return [_peaks(roofline["peaks"]), _bounds(beds), _parts(beds), _operations()]
