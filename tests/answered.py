"""Tables of studies with the twelve questions that a report must answer rightly."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.answer import Answer, Asked
from sandmould.statistics.config import FULL_SHARE, Better, Goal
from sandmould.statistics.decision import Evidence, decide

HZ = "vibration.0.frequency_hz"
G = "vibration.0.acceleration_g"
MM = "vibration.0.displacement_m"
FACTOR = "pattern.loop.factor"
GUARD = "guard.kinetic_energy_factor"
POCKET, HOLE = "pocket_fill_of_bed_fraction", "hole18_fill_of_bed_fraction"
FILL, SHARE = "tube_fill_fraction", "tube_fill_of_bed_fraction"
TIP, BENT = "pattern_tip_deflection_m", "pattern_distance_largest_m"
FREEZES = "solidification_time_s"
Values = Mapping[Any, Sequence[float]]


def table(key: str, **measures: Values) -> pd.DataFrame:
    """A summary: a row a replicate of each value of a key."""
    first = next(iter(measures.values()))
    rows = [
        {"run": f"r{n}_{r}", key: at, "replicate": r, "seed": r, "outcome_code": 0,
         **{name: values[at][r] for name, values in measures.items()}}
        for n, at in enumerate(first) for r in range(len(first[at]))
    ]  # fmt: skip
    return pd.DataFrame(rows)


def over_a_second(summary: pd.DataFrame, rises: float, *measures: str) -> pd.DataFrame:
    """Curves that rise by a share in the last quarter, or reach their end in a fifth of a second
    over what they hold."""
    rows = []
    for run in summary.to_dict("records"):
        for time_s in np.linspace(0.0, 1.0, 21):
            shape = 1 - 4 * rises * (1 - time_s) / (1 + rises) if rises else min(1.0, 2 * time_s)
            values = {name: run[name] * shape for name in measures}
            row = {"run": run["run"], "time_s": time_s, "vibration_time_s": time_s}
            rows.append({**row, "stage": "vibrate_1", **values})
    return pd.DataFrame(rows)


def answered(
    summary: pd.DataFrame, measure: str, keys: Sequence[str], better: Better = "larger",
    curves: pd.DataFrame | None = None, drives: Mapping[str, BoxDrive] | None = None,
    by_lot: bool = True, stand_ins: tuple[str, ...] = (),
) -> Answer:  # fmt: skip
    """The answer of a study; what is a share of what fits should be full."""
    space = measure.removesuffix("_fill_fraction").removesuffix("_fill_of_bed_fraction")
    goal = Goal(f"{space}_fill_of_bed_fraction", FULL_SHARE) if better == "larger" else None
    asked = Asked(measure, better, tuple(keys), goal, by_lot)
    curves = pd.DataFrame() if curves is None else curves
    return decide(asked, Evidence(summary, curves, drives or {}, stand_ins))


AT_04_MM = {f"{hz} Hz": BoxDrive(hz, 4e-4) for hz in (30, 45, 60)}
POCKETS = {30: (0.0, 0.0), 45: (0.016, 0.047), 60: (0.023, 0.096)}
APART = {30: (0.01, 0.0, 0.0), 45: (0.04, 0.05, 0.03), 60: (0.10, 0.09, 0.11)}
HOLES = {30: (0.97, 0.96, 0.98), 45: (0.90, 0.88, 0.91), 60: (0.87, 0.85, 0.84)}
FULL = {30: (0.9695, 0.9705), 45: (0.979, 0.981), 60: (0.994, 0.996)}
NEARLY = {30: (0.93, 0.98, 0.955), 45: (0.99, 1.0, 0.98), 60: (0.8, 0.85, 0.82)}
FILLS = {3.0: (0.4, 0.41, 0.42), 6.0: (0.56, 0.58, 0.57)}
ELEMENTS = {0.005: (61.6,), 0.0025: (54.3,), 0.00125: (52.4,)}


def none_reaches() -> Answer:
    """A pocket that no frequency fills, still rising."""
    summary = table(HZ, **{POCKET: POCKETS})
    return answered(summary, POCKET, [HZ], curves=over_a_second(summary, 0.14, POCKET),
                    drives=AT_04_MM)  # fmt: skip


def several_reach() -> Answer:
    """A pocket that every frequency fills, the higher the sooner."""
    summary = table(HZ, **{POCKET: FULL})
    return answered(summary, POCKET, [HZ], curves=over_a_second(summary, 0.0, POCKET),
                    drives=AT_04_MM)  # fmt: skip


def some_reach_on_average() -> Answer:
    """A pocket that one frequency is shown to fill, and another fills on average."""
    summary = table(HZ, **{POCKET: NEARLY})
    return answered(summary, POCKET, [HZ], drives=AT_04_MM)


def best_at_an_end() -> Answer:
    """A bed that is denser the more it is shaken."""
    fractions = {1.0: (0.50, 0.51, 0.52), 3.0: (0.54, 0.56, 0.55), 6.0: (0.60, 0.61, 0.63)}
    return answered(table(G, solid_fraction=fractions), "solid_fraction", [G])


def two_cavities() -> Answer:
    """A pocket that does not fill, and a hole that fills where the pocket is emptiest."""
    summary = table(HZ, **{POCKET: APART, HOLE: HOLES})
    curves = over_a_second(summary, 0.14, POCKET, HOLE)
    return answered(summary, POCKET, [HZ], curves=curves, drives=AT_04_MM)


def one_value() -> Answer:
    """How much of a hollow is full, by one run."""
    summary = table(HZ, **{TIP: {50: (0.0123,)}}).drop(columns=HZ)
    return answered(summary, TIP, [], "neither")


def no_chance() -> Answer:
    """Two castings, one run each."""
    summary = table("exchange", **{FREEZES: {"faces": (2046.76,), "difference": (2050.1,)}})
    return answered(summary, FREEZES, ["exchange"], "smaller", by_lot=False)


def finest() -> Answer:
    """Three regular sizes of elements."""
    summary = table("element_m", **{FREEZES: ELEMENTS})
    stand_ins = ("casting.density_kg_m3", "mould.conductivity_w_m_k")
    return answered(summary, FREEZES, ["element_m"], "neither", by_lot=False, stand_ins=stand_ins)


def no_effect() -> Answer:
    """Sixteen runs that are four, four times over."""
    fractions = dict.fromkeys((5, 6, 7, 8), (0.654, 0.679, 0.656, 0.668))
    return answered(table(GUARD, solid_fraction=fractions), "solid_fraction", [GUARD])


def smaller_while_rising() -> Answer:
    """A tube that should stay empty and goes on filling."""
    summary = table(G, **{FILL: FILLS})
    return answered(summary, FILL, [G], "smaller", curves=over_a_second(summary, 0.09, FILL))


def failing_loops() -> Answer:
    """Of four loops two do not hold, one of them at the value 0."""
    summary = table(FACTOR, **{TIP: {0.05: (0.011, 0.012), 1.0: (0.0, 0.09)}})
    summary = summary.assign(pattern_loop=["holds", "holds", "cycles", "diverged"])
    return answered(summary, TIP, [FACTOR], "smaller")


def amplitude_swept() -> Answer:
    """A tube that fills better at the larger of two amplitudes, and not wholly."""
    fills: Values = dict(zip((0.00015, 0.0006), FILLS.values(), strict=True))
    shares: Values = {at: tuple(v + 0.06 for v in own) for at, own in fills.items()}
    drives = {"0.15 mm": BoxDrive(50.0, 1.5e-4), "0.6 mm": BoxDrive(50.0, 6e-4)}
    return answered(table(MM, **{FILL: fills, SHARE: shares}), FILL, [MM], drives=drives)


def too_wide() -> Answer:
    """Two runs of each setting that differ by more than the settings."""
    fractions = {25: (0.1, 0.5), 50: (0.3, 0.45), 75: (0.2, 0.6)}
    return answered(table(HZ, solid_fraction=fractions), "solid_fraction", [HZ])


HEIGHTS = {0.1: (9.02, 8.99, 9.01), 0.3: (8.95, 8.93, 8.97), 0.5: (9.0, 8.96, 9.05),
           0.8: (9.05, 8.88, 9.19)}  # fmt: skip
"""Of a bed, mm."""


def by_chance() -> Answer:
    """The height of a bed over the friction, which changes it by no more than chance."""
    return _height(HEIGHTS)


def a_course() -> Answer:
    """The same where little friction leaves a higher bed."""
    return _height({0.05: (9.9, 9.95, 9.91), **HEIGHTS})


def _height(heights_mm: Values) -> Answer:
    heights: Values = {at: tuple(1e-3 * v for v in own) for at, own in heights_mm.items()}
    return answered(
        table("values.friction", bed_height_m=heights), "bed_height_m", ["values.friction"],
        "neither",
    )  # fmt: skip


ENERGIES_J = {1e5: (2.0e-7, 2.3e-7, 1.9e-7), 1e6: (3.1e-5, 2.6e-5, 2.9e-5), 1e7: (0.2, 0.26, 0.17)}
"""Over the modulus of the grains."""


def far_apart() -> Answer:
    """Kinetic energies of which each scatters by more than the next smaller one has."""
    return answered(
        table("values.modulus_pa", kinetic_j=ENERGIES_J),
        "kinetic_j",
        ["values.modulus_pa"],
        "neither",
    )


def far_apart_and_least() -> Answer:
    """The same where little of it is good."""
    return answered(
        table("values.modulus_pa", kinetic_j=ENERGIES_J),
        "kinetic_j",
        ["values.modulus_pa"],
        "smaller",
    )


def a_bent_part() -> Answer:
    """A part whose shaken surface swings and comes to rest farther from its drawing than passes."""
    rest = {"stage": "rest", "vibration_time_s": 0.1, BENT: 0.988e-3}
    shaken = [
        {"stage": "vibrate_1", "vibration_time_s": 0.025 * n, BENT: 1e-3 * mm}
        for n, mm in enumerate((1.119, 0.682, 0.684, 0.7, 1.145))
    ]
    curves = pd.DataFrame([*shaken, rest]).assign(run="r1")
    run = {"run": "r1", "replicate": 1, "seed": 1, "outcome_code": 0, BENT: 0.988e-3}
    summary = pd.DataFrame([run | {"pattern_outside_tolerance_fraction": 0.124}])
    asked = Asked(BENT, "smaller", (), Goal(BENT, 5e-4))
    return decide(asked, Evidence(summary, curves))


def none_is_shown_to_reach() -> Answer:
    """A pocket and a hole that may be full at two settings of the table, at its limit."""
    at = [(28.0, 0.0012), (40.0, 0.00062), (15.0, 0.0012)]
    pocket = [(0.90, 0.93, 0.91), (0.92, 0.94, 0.90), (0.55, 0.6, 0.62)]
    hole = [(0.74, 0.70, 0.78), (0.70, 0.66, 0.75), (0.40, 0.42, 0.38)]
    rows = [
        {"run": f"r{n}_{r}", HZ: hz, MM: mm, "replicate": r, "seed": r, "outcome_code": 0,
         POCKET: pocket[n][r], HOLE: hole[n][r]}
        for n, (hz, mm) in enumerate(at) for r in range(3)
    ]  # fmt: skip
    summary = pd.DataFrame(rows)
    drives = {f"frequency {hz:g} Hz, amplitude {1e3 * mm:g} mm": BoxDrive(hz, mm) for hz, mm in at}
    return answered(summary, POCKET, [HZ, MM], curves=over_a_second(summary, 0.14, POCKET, HOLE),
                    drives=drives)  # fmt: skip


QUESTIONS: Mapping[str, Callable[[], Answer]] = {
    each.__name__: each
    for each in (none_reaches, several_reach, some_reach_on_average, best_at_an_end, two_cavities,
                 one_value, no_chance, finest, no_effect, smaller_while_rising, failing_loops,
                 amplitude_swept, too_wide, by_chance, a_course, far_apart, far_apart_and_least,
                 a_bent_part, none_is_shown_to_reach)
}  # fmt: skip
