"""How a study of sand was computed, in terms and sentences for the end of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from sandmould.definition.study import Objective
from sandmould.runs.columns import (
    BED_LIMIT_S,
    ENGINE,
    LEAST_LIMIT_S,
    LIMIT_MOMENTS,
    RANKS,
    REPLICATE,
    SEED,
    TIME_STEP_FRACTION,
    TIME_STEP_S,
    VERSION,
)
from sandmould.runs.formatting import listed, name_of, number, seconds, value_text
from sandmould.runs.templates import worded
from sandmould.scenario.contact import ContactLaw
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.rest import Rest
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.unbalance import Unbalance
from sandmould.scenario.vibration import VibrationStage

_NO_TENSION = {
    "total": "the total normal force, spring and dashpot together, is never allowed to pull",
    "elastic": "only the spring is kept from pulling; the dashpot may pull as grains part",
}
_DAMPING = {
    "viscous": "viscous, Rojek 2004, eqs. (36) and (37)",
    "nonviscous_isotropic": "non-viscous and isotropic, Rojek 2004, eqs. (38) and (39)",
    "nonviscous_componentwise": "non-viscous, each component of force by itself; the paper's own "
    "form, Rojek 2004, eq. (38), is isotropic",
}


@dataclass(frozen=True)
class Row:
    """A term and what holds for it."""

    term: str
    text: str


def sand_method(scenario: Scenario, keys: Sequence[str], summary: pd.DataFrame) -> tuple[Row, ...]:
    """How the runs were computed: model, laws, vibration, time step, seeds.

    ``scenario``: of one run; what the study sweeps is said apart.
    """
    sand, contact = scenario.sand, scenario.laws
    hardness = bed_hardness(scenario)
    sizes = sand.classes(scenario.dimension)
    low, high = (1e3 * sizes[i].diameter_m for i in (0, -1))
    return (
        Row("Engine", _engines(summary)),
        Row("Model", _model(scenario)),
        Row(
            "Sand",
            f"grains of {number(low, 2)} to {number(high, 2)} mm in {len(sizes)} size classes, "
            f"{number(sand.size_scale, 2)} times the size of the real sand; material density "
            f"{number(sand.density_kg_m3, 4)} kg/m³",
        ),
        Row("Grain on grain", _law(contact.grain_grain)),
        Row("Grain on wall", _law(contact.grain_wall)),
        *([Row("Stiffness", worded("stiffness.j2", it=hardness))] if hardness else []),
        Row("No tension, Rojek 2004, eq. (18)", _NO_TENSION[contact.no_tension]),
        Row("Background damping", _damping(scenario)),
        Row("Filling", _filling(scenario)),
        *(Row("Vibration", _vibration(s, scenario, keys)) for s in scenario.vibrations),
        *([Row("Measured", _measured(scenario))] if scenario.vibrations else []),
        Row("Time step", _time_step(scenario, summary)),
        Row("Swept", listed([name_of(k) for k in keys], most=20) or "nothing"),
        Row("Seeds", _seeds(summary)),
    )


def deck_method(scenario: OwnDeck, keys: Sequence[str], summary: pd.DataFrame) -> tuple[Row, ...]:
    """What is known of the runs of a user's deck; see ``sand_method``."""
    read = [f"{name_of(name)} from {taken.text}" for name, taken in scenario.taken.items()]
    given = [f"{name} = {value}" for name, value in scenario.values.items() if
             f"values.{name}" not in keys]  # fmt: skip
    template, fixed = Path(scenario.template).name, listed(given, most=20) or "no fixed values"
    return (
        Row("Engine", _engines(summary)),
        Row("Deck", f"{template}, with {fixed}"),
        Row("Measures", listed(read, most=20) or "none"),
        Row("Swept", listed([name_of(k) for k in keys], most=20) or "nothing"),
        Row("Seeds", _seeds(summary)),
    )


def statistics_method(objective: Objective, ends: str, draws_by_lot: bool) -> Row:
    """How the verdict was reached."""
    compared = f"{name_of(objective.measure)} at {ends}, {objective.better} is better"
    if not draws_by_lot:
        return Row("Statistics", f"{compared}. Nothing is drawn by lot, so a setting is one run.")
    return Row(
        "Statistics",
        f"{compared}. A setting's ± is the 95 % interval of its mean (Student). Settings are "
        "compared by the spread that all share (analysis of variance), or by their own where it is "
        "larger. What a replicate shifts in all of them drops out of their differences, unless "
        "that takes more than half of the degrees of freedom. Intervals and p values hold for all "
        "pairs of settings together (Tukey).",
    )


def own_measures_method(own_measures: Mapping[str, str]) -> tuple[Row, ...]:
    """Formulas of the user's own measures; no row without any."""
    formulas = [f"{name} = {formula}" for name, formula in own_measures.items()]
    return (Row("Own measures", "; ".join(formulas)),) if formulas else ()


def _engines(summary: pd.DataFrame) -> str:
    if ENGINE not in summary or not summary[ENGINE].notna().any():
        return "no run says which"
    rows = summary[[ENGINE, VERSION, RANKS]].dropna().drop_duplicates()
    return "; ".join(
        f"{engine} {version}, {int(ranks)} rank{'s' if ranks > 1 else ''}"
        for engine, version, ranks in rows.itertuples(index=False)
    )


def _model(scenario: Scenario) -> str:
    gravity = f"gravity {number(scenario.gravity_m_s2, 4)} m/s²"
    if scenario.dimension == 3:
        return f"distinct elements in 3D: spheres; {gravity}"
    return (
        f"distinct elements in 2D: discs {number(1e3 * scenario.sand.thickness_m)} mm long across "
        f"the plane; {gravity}. The paper leaves this length open: only stiffness over thickness "
        "matters"
    )


def _law(law: ContactLaw) -> str:
    return (
        f"springs {value_text('normal_stiffness_n_m', law.normal_stiffness_n_m)} (normal) and "
        f"{value_text('tangential_stiffness_n_m', law.tangential_stiffness_n_m)} (tangential), "
        f"friction {law.friction:g}, damping ratio {law.damping_ratio:g}, "
        f"rolling arm {law.rolling_arm_fraction:g} of the smaller radius"
    )


def _damping(scenario: Scenario) -> str:
    damping = scenario.background_damping
    if damping.form == "none":
        return "none"
    if damping.form == "viscous":
        values = (damping.viscous_translation_per_s, damping.viscous_rotation_per_s)
        unit = " 1/s"
    else:
        values, unit = (damping.nonviscous_translation, damping.nonviscous_rotation), ""
    return (
        f"{_DAMPING[damping.form]}: {values[0]:g}{unit} for translation, {values[1]:g}{unit} for "
        "rotation"
    )


def _filling(scenario: Scenario) -> str:
    fill = scenario.fill
    layers = len(fill.each_layer())
    between = ", vibrated in between" if fill.vibration_between_layers else ""
    plural = "s" if layers > 1 else ""
    placed = len(fill.grains)
    by_hand = f"{placed} grain{'s' if placed > 1 else ''} placed by hand" if placed else ""
    if not layers:
        return by_hand
    dropped = f"{by_hand}{', ' if by_hand else ''}{layers} layer{plural} dropped "
    dropped += f"{1e3 * fill.drop_height_m:g} mm"
    if (spout := fill.spout) is not None:
        dropped += f" in {spout.portions} portions out of a spout {1e3 * spout.width_m:g} mm wide"
        dropped += f" that moves over the box in {spout.time_s:g} s"
    if (shaken := fill.vibration) is not None:
        return (
            f"{dropped}, one every {shaken.layer_s:g} s, while the box vibrates at "
            f"{shaken.frequency_hz:g} Hz and {shaken.peak_acceleration_g:.3g} g until "
            f"{shaken.after_s:g} s after the last has fallen; then {_rest(scenario.rest)}"
        )
    return f"{dropped}{between}; the next comes when {_rest(scenario.rest)}"


def _rest(rest: Rest) -> str:
    share = rest.load_tolerance
    loads = "" if share is None else f" and surfaces bear its weight within {100 * share:g} %"
    return (
        f"the grains' rms speed is below {rest.rms_speed_m_s:g} m/s{loads}, "
        f"in {rest.checks} checks of {1e3 * rest.check_every_s:g} ms in a row"
    )


def _vibration(stage: VibrationStage, scenario: Scenario, keys: Sequence[str]) -> str:
    swept = any(k.startswith("vibration.") for k in keys)
    where = stage.direction if isinstance(stage.direction, str) else f"along {stage.direction}"
    frame = (
        "the box's own frame: a body force on the grains"
        if scenario.frame == "box"
        else "the laboratory frame: moving walls"
    )
    if stage.unbalance is not None:
        what = _table(stage.unbalance) + ("" if swept else f", {stage.frequency_hz:g} Hz")
    elif swept:
        what = f"{stage.hold} held constant while the frequency changes"
    else:
        what = f"{stage.frequency_hz:g} Hz, {stage.peak_acceleration_g:.3g} g"
    ramp = f", ramp {seconds(stage.ramp_s)}" if stage.ramp_s else ""
    return f"{where}, sinusoidal, {what}; {seconds(stage.whole_duration_s)}{ramp}; in {frame}"


def _table(unbalance: Unbalance) -> str:
    depth_m = unbalance.flask_depth_m
    depth = "" if depth_m is None else f", the sand counted over a depth of {depth_m:g} m"
    return (
        f"an unbalance of {unbalance.moment_kg_m:g} kg m moves a table of "
        f"{unbalance.moving_mass_kg:g} kg on mounts of {unbalance.mount_frequency_hz:g} Hz with "
        f"{100 * unbalance.mount_damping_ratio:g} % of the critical damping{depth}"
    )


def measured_when(scenario: Scenario) -> str:
    """When measures are taken without a time: at the end of a run."""
    if not scenario.vibrations:
        return "the end"
    return "rest after vibration" if scenario.ends_at_rest else "the end of vibration"


def _measured(scenario: Scenario) -> str:
    if not scenario.ends_at_rest:
        return "at the end of vibration, at full speed: measure_at_rest is false"
    stop = "the box stops smoothly"
    if scenario.vibrations[-1].ramp_s:
        stop = "the box stands"
    return f"at rest after vibration: {stop} and the sand comes to rest as after a layer"


def _time_step(scenario: Scenario, summary: pd.DataFrame) -> str:
    said = ""
    if {TIME_STEP_S, TIME_STEP_FRACTION} <= set(summary.columns):
        steps, shares = summary[TIME_STEP_S].dropna(), summary[TIME_STEP_FRACTION].dropna()
        if len(steps) and len(shares):
            said = f"{_range(1e6 * steps)} µs, {_range(shares)} of the critical one; "
    said += f"the critical step is set by the {scenario.critical_step.cause}"
    return said + _step_of_bed(summary)


def _step_of_bed(summary: pd.DataFrame) -> str:
    """What is known of runs that took their step from the filled bed."""
    columns = [TIME_STEP_S, BED_LIMIT_S, LEAST_LIMIT_S, LIMIT_MOMENTS]
    if not set(columns) <= set(summary.columns):
        return ""
    found = summary[columns].dropna()
    if found.empty:
        return ""
    step_s, bed_s, least_s, moments = (found[column] for column in columns)
    return (
        f". After the fill, {len(found)} runs take {_range(step_s / bed_s)} of the exact limit of "
        f"the filled bed, {_range(1e6 * bed_s)} µs. The least limit of the shaken bed, over "
        f"{_range(moments)} moments of a run, is {_range(1e6 * least_s)} µs: "
        f"{_range(least_s / step_s)} times the step"
    )


def _range(values: pd.Series[float]) -> str:
    low, high = number(values.min()), number(values.max())
    return low if low == high else f"{low} to {high}"


def _seeds(summary: pd.DataFrame) -> str:
    if not {REPLICATE, SEED} <= set(summary.columns):
        return "no seeds given"
    if (summary.groupby(REPLICATE)[SEED].nunique() == 1).all():
        return (
            "a replicate has the same seed at every setting, so that settings are compared on the "
            "same sand. Other replicates have other seeds"
        )
    return "every run has a seed of its own"


def provenance_rows(all_runs: Sequence[Mapping[str, Any]]) -> tuple[Row, ...]:
    """What the runs say of their origin; what is another one in every run tells nothing of them.

    ``all_runs``: the origin of each run, of its ``products.json``.
    """
    flat = [dict(_flatten(p)) for p in all_runs if p]
    rows = []
    for key in dict.fromkeys(k for p in flat for k in p):
        values = list(dict.fromkeys(p[key] for p in flat if key in p))
        if len(values) == len(flat) > 1:
            continue
        more = f" and {len(values) - 1} others" if len(values) > 1 else ""
        rows.append(Row(key.replace("_", " ").replace(".", ": "), f"{values[0]}{more}"))
    return tuple(rows)


def _flatten(values: Mapping[str, Any], above: str = "") -> list[tuple[str, str]]:
    pairs = []
    for name, value in values.items():
        key = f"{above}.{name}" if above else str(name)
        if isinstance(value, Mapping):
            pairs += _flatten(value, key)
        elif isinstance(value, list):
            pairs.append((key, " ".join(map(str, value))))
        else:
            pairs.append((key, str(value)))
    return pairs
