"""How near the reference solver's step comes to what the core can do, and where the rest goes."""

from __future__ import annotations

from typing import Any

from benchmarks.engines.beds import Bed, settled, solver_on, tiled
from benchmarks.engines.peaks import bandwidth, measure_peaks
from benchmarks.engines.phases import measure_phases
from benchmarks.engines.scale import advance, bytes_of, cost_of, near_of
from benchmarks.engines.timing import Extent, one_core, spread, steps_lasting
from sandmould.dem.solver import Solver

# Operations counted by hand in pairs.py, contact_law.py and motion.py; a multiply-add is two,
# comparisons, signs and what leaves the loop are none. Both grains compute each pair. First discs,
# then spheres.
FLOPS_PER_PAIR = (
    ("vector between the centres", 2, 3),
    ("its square", 3, 5),
    ("sum of the radii and its square", 2, 2),
)
FLOPS_PER_CONTACT = (
    ("overlap, unit normal, both arms", 6, 7),
    ("relative velocity", 2, 3),
    ("normal force, (16)-(21)", 6, 8),
    ("spin at the contact point", 3, 18),
    ("friction: advanced, turned, limited, (24)-(28)", 8, 33),
    ("force and moment on the grain", 5, 15),
    ("rolling moment: advanced, turned, limited, (29)-(33)", 7, 37),
    ("sums over the contacts of the grain", 3, 6),
)
FLOPS_PER_GRAIN = (
    ("sums stored", 3, 6),
    ("velocity and spin, (3)-(7)", 10, 18),
    ("position and largest speed", 8, 12),
)
ROOTS_PER_CONTACT = {2: 1, 3: 3}
"""Distance, and two limits in 3D; each is followed by a quotient."""
QUOTIENTS_PER_GRAIN = 2
"""dt/m and dt/I."""
TRAFFIC = {
    "grains position": 1, "grains velocity": 1, "grains spin": 1, "grains kind": 1,
    "grains force": 2, "grains moment": 2, "ahead": 2, "near grain": 1, "near first_row": 1,
    "near last_row": 1, "near other": 1, "near held": 2, "near history": 2,
    "walls candidates rows": 1,
    "walls candidates start": 1, "walls candidates part": 1, "walls history used": 2,
    "walls history normal": 2, "walls history friction": 2, "walls history rolling": 2,
}  # fmt: skip
"""How often a step takes an array from memory or gives it back: once read, once written; what is
written is read first."""


def flops(dimension: int, near: float, contacts: float) -> float:
    """Operations of a grain-step, square roots and quotients apart."""
    per_pair, per_contact, per_grain = (
        sum(row[1:][dimension - 2] for row in counted)
        for counted in (FLOPS_PER_PAIR, FLOPS_PER_CONTACT, FLOPS_PER_GRAIN)
    )
    return 2.0 * (near * per_pair + contacts * per_contact) + per_grain


def traffic_bytes(solver: Solver) -> float:
    """Bytes of a grain-step that cross into or out of the core's own cache, at most."""
    sizes = bytes_of(solver)
    return sum(times * sizes[name] for name, times in TRAFFIC.items()) / len(solver.grains.id)


def _bounds(
    solver: Solver, contacts: float, near: float, peaks: dict[str, Any], gb_s: float
) -> dict[str, float]:
    """Least time of a grain-step by each limit, ns."""
    operations = flops(solver.dimension, near, contacts)
    roots = 2.0 * contacts * ROOTS_PER_CONTACT[solver.dimension]
    return {
        "bandwidth": traffic_bytes(solver) / gb_s,
        "vector arithmetic": operations * peaks["vector_ns_per_flop"]["median"],
        "scalar arithmetic": operations * peaks["scalar_ns_per_flop"]["median"],
        "quotients and roots": (roots + QUOTIENTS_PER_GRAIN) * peaks["ns_per_quotient"]["median"]
        + roots * peaks["ns_per_root"]["median"],
    }


def _times(bed: Bed, extent: Extent, phases: bool) -> tuple[Solver, dict[str, Any]]:
    """Solver with the bed, and time of its steps with their parts where asked."""
    solver, block_s = solver_on(bed), extent.block_s
    if not phases:
        step = cost_of(solver, steps_lasting(lambda n: advance(solver, n), block_s))
        return solver, {"ns_per_grain_step": spread([step() for _ in range(extent.rounds)])}
    still = solver_on(bed)
    block_s /= 10
    step = cost_of(solver, steps_lasting(lambda n: advance(solver, n), block_s))
    return solver, measure_phases(still, step, 3 * extent.rounds, block_s)


def _measure_bed(bed: Bed, peaks: dict[str, Any], extent: Extent, phases: bool) -> dict[str, Any]:
    """Time of a step against its limits."""
    solver, times = _times(bed, extent, phases)
    step_ns = times["ns_per_grain_step"]["median"]
    contacts = len(solver.contacts.first) / bed.grains
    near = near_of(solver) / bed.grains
    held = sum(size for name, size in bytes_of(solver).items() if name in TRAFFIC)
    gb_s = bandwidth(held, extent.rounds)
    bounds = _bounds(solver, contacts, near, peaks, gb_s["median"])
    return {
        "bed": bed.name,
        "dimension": bed.dimension,
        "held_bytes": held,
        "gb_s": gb_s,
        "bytes_per_grain_step": traffic_bytes(solver),
        "flops_per_grain_step": flops(bed.dimension, near, contacts),
        "near_per_grain": near,
        "contacts_per_grain": contacts,
        "bounds_ns": bounds,
        "fractions": {name: ns / step_ns for name, ns in bounds.items()},
        **times,
    }


def measure_roofline(extent: Extent) -> dict[str, Any]:
    """Peaks of one core, and beds of several sizes against them."""
    beds = [settled(2, n) for n in extent.discs] + [settled(3, extent.spheres)]
    largest = tiled(settled(2, extent.tile), extent.scale_discs[-1])
    with one_core():
        peaks = measure_peaks(extent.rounds, max(1, round(2_000 * extent.block_s)))
        sizes = (500_000, 30_000_000, extent.far_bytes)
        peaks["gb_s"] = [{"bytes": size, **bandwidth(size, extent.rounds)} for size in sizes]
        rows = [_measure_bed(bed, peaks, extent, phases=True) for bed in beds]
        rows.append(_measure_bed(largest, peaks, extent, phases=False))
    return {"peaks": peaks, "beds": rows}
