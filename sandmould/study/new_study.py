"""A first study from a few answers: what ``sandmould new`` asks, and the file that it writes."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Literal

from sandmould.scenario.bad_input import BadInputError, Problem
from sandmould.scenario.quantity import NAME, Section, quantity
from sandmould.study.plan.build_plan import Plan, open_plan

WHY_HELD = (
    "What is held decides most: at 1.5 g held the shipped tube fills best at 76 Hz; with the "
    "amplitude (half of peak to peak) held it is full from 120 Hz on; with the velocity held 60 "
    "to 240 Hz fill alike."
)
HELD = {
    "acceleration": "that of a shaker under control",
    "velocity": "that of a shaker under control",
    "displacement": "the amplitude (half of peak to peak) of a crank or cam",
    "unbalance": "rotating masses on a table that stands on mounts",
}
_TUBE = "config/scenarios/tube.yaml"
_TABLE = "config/studies/tube_unbalance.yaml"
_DEMO = "config/studies/tube_demo.yaml"
_LAW = "config/studies/tube_law_hold.yaml"
_HOLE = "config/studies/blind_cavity.yaml"


class NewStudy(Section):
    """Answers; each description is a question."""

    hold: Literal["acceleration", "velocity", "displacement", "unbalance"] = quantity(
        "acceleration",
        "What stays the same when the frequency changes",
        source=_TUBE,
    )
    acceleration_g: float = quantity(
        1.5, "Acceleration, to either side", unit="g", source=_TUBE, gt=0
    )
    velocity_m_s: float = quantity(0.047, "Velocity, to either side", unit="m/s", source=_LAW, gt=0)
    displacement_m: float = quantity(
        0.00015, "Displacement, to either side", unit="m", source=_LAW, gt=0
    )
    moment_kg_m: float = quantity(
        0.006, "Rotating mass times its eccentricity", unit="kg m", source=_TABLE, gt=0
    )
    moving_mass_kg: float = quantity(
        30.0, "Mass of table, motors and empty flask", unit="kg", source=_TABLE, gt=0
    )
    mount_frequency_hz: float = quantity(
        6.0, "Natural frequency of that mass on its mounts", unit="Hz", source=_TABLE, gt=0
    )
    flask_depth_m: float = quantity(
        0.5, "Depth of the flask across the plane", unit="m", source=_TABLE, gt=0
    )
    lowest_hz: float = quantity(25.0, "Lowest frequency", unit="Hz", source=_DEMO, gt=0)
    highest_hz: float = quantity(140.0, "Highest frequency", unit="Hz", source=_DEMO, gt=0)
    settings: int = quantity(4, "Number of frequencies from one to the other", source=_DEMO, ge=2)
    duration_s: float = quantity(2.0, "Duration of the vibration", unit="s", source=_TUBE, gt=0)
    width_m: float = quantity(0.12, "Inner width of the box", unit="m", source=_TUBE, gt=0)
    height_m: float = quantity(0.11, "Inner height of the box", unit="m", source=_TUBE, gt=0)
    cavity: Literal["tube", "hole_up", "hole_down", "none"] = quantity(
        "tube",
        "Cavity to fill: a level blind tube, a blind hole that opens upwards or downwards, or none "
        "(how densely the sand packs)",
        source=_TUBE,
    )
    opening_m: float = quantity(0.024, "Width of its opening", unit="m", source=_TUBE, gt=0)
    cavity_depth_m: float = quantity(
        0.04, "Depth of the cavity from its opening", unit="m", source=_HOLE, gt=0
    )
    material: str = quantity(
        "rojek_2004", "Sand, a name in config/materials", source=_TUBE, pattern=NAME
    )
    size_scale: float = quantity(
        6.0, "How much larger than real grains those computed are; 6 is coarse and quick",
        source=_DEMO, gt=0,
    )  # fmt: skip
    wave_speed_m_s: float | None = quantity(
        None,
        "Wave speed of the sand, which its best frequency follows; the springs of the sand's file "
        "unless given",
        unit="m/s",
        source="docs/hard_sand.md",
        gt=0,
    )
    engine: Literal["reference", "lammps"] = quantity(
        "reference", "Engine: reference is the faster one", source=_DEMO
    )
    replicates: int = quantity(
        4, "Fillings of each setting; more tell smaller differences apart", source=_LAW, ge=1
    )


_OF_HOLD = {
    "acceleration": ("acceleration_g",),
    "velocity": ("velocity_m_s",),
    "displacement": ("displacement_m",),
    "unbalance": ("moment_kg_m", "moving_mass_kg", "mount_frequency_hz", "flask_depth_m"),
}
_OF_CAVITY = ("opening_m", "cavity_depth_m")


def applies(name: str, hold: str, cavity: str) -> bool:
    """Whether a question is asked after the answers to what is held and which cavity.

    Parameters
    ----------
    name : str
        A field of ``NewStudy``.
    hold, cavity : str
    """
    if name == "engine" and hold == "unbalance":
        return False  # a table on mounts moves on the reference engine alone
    of_others = {n for held, names in _OF_HOLD.items() if held != hold for n in names}
    return name not in of_others and (cavity != "none" or name not in _OF_CAVITY)


def refuse_present(path: Path) -> None:
    """Refuse to write where there is a file.

    Parameters
    ----------
    path : Path

    Raises
    ------
    BadInputError
    """
    if path.exists():
        raise BadInputError([Problem("FILE", str(path), "a new file, or --overwrite beside it")])


def write_new_study(path: Path, answers: NewStudy) -> Plan:
    """Write a study's file, and check it as the plan does.

    Parameters
    ----------
    path : Path
    answers : NewStudy

    Raises
    ------
    BadInputError
        Where answers do not go together. The sentence names the key in the file, which stays.
    """
    path.write_text(study_text(answers), encoding="utf-8")
    return open_plan(path)


def study_text(a: NewStudy) -> str:
    """The file of a study.

    Parameters
    ----------
    a : NewStudy
    """
    waves = f"  contact: {{wave_speed_m_s: {a.wave_speed_m_s:g}}}\n" if a.wave_speed_m_s else ""
    layer_m = 0.245 * a.height_m
    return f"""\
# Written by sandmould new. sandmould keys explains each key; sandmould plan prints the price.
title: At which frequency does {_QUESTIONS[a.cavity]}?
material: {a.material}
scenario:
  engine: {{name: {a.engine}}}
  sand: {{size_scale: {a.size_scale:g}}}
{waves}  time_step: {{fraction: 0.8}}
  box: {{width_m: {a.width_m:g}, height_m: {a.height_m:g}}}
{_cavity_text(a)}  fill: {{layers: [{{height_m: {layer_m:.4g}, repeat: 3}}]}}
  rest: {{rms_speed_m_s: 0.02}}
{textwrap.indent(textwrap.fill(WHY_HELD, 96), "  # ")}
  vibration:
    - hold: {a.hold}
      frequency_hz: {a.lowest_hz:g}
{_amplitude_text(a)}      duration_s: {a.duration_s:g}
sweep:
  keys:
    vibration.0.frequency_hz: {_frequencies_text(a)}
replicates: {a.replicates}
objective: {{measure: {_OBJECTIVES[a.cavity]}}}
"""


_QUESTIONS = {
    "tube": "sand fill a blind tube best",
    "hole_up": "sand fill a blind hole that opens upwards best",
    "hole_down": "sand fill a blind hole that opens downwards best",
    "none": "sand pack most densely",
}
_OBJECTIVES = {
    "tube": "tube_fill_fraction",
    "hole_up": "hole_fill_of_bed_fraction",
    "hole_down": "hole_fill_of_bed_fraction",
    "none": "solid_fraction",
}
_WALL_M = 0.003


def _frequencies_text(a: NewStudy) -> str:
    """Frequencies in equal ratios, to three digits."""
    ratio = (a.highest_hz / a.lowest_hz) ** (1 / (a.settings - 1))
    inner = [a.lowest_hz * ratio**i for i in range(1, a.settings - 1)]
    return f"[{', '.join([f'{a.lowest_hz:g}', *(f'{f:.3g}' for f in inner), f'{a.highest_hz:g}'])}]"


def _amplitude_text(a: NewStudy) -> str:
    values = {name: getattr(a, name) for name in _OF_HOLD[a.hold]}
    if a.hold != "unbalance":
        return "".join(f"      {name}: {value:g}\n" for name, value in values.items())
    rows = "".join(f"        {name}: {value:g}\n" for name, value in values.items())
    return f"      unbalance:\n{rows}      ramp_s: {0.1 * a.duration_s:g}\n"


def _cavity_text(a: NewStudy) -> str:
    if a.cavity == "none":
        return ""
    if a.cavity == "tube":
        return (
            "  obstacles:\n"
            "    - kind: tube\n"
            "      name: tube\n"
            f"      diameter_m: {a.opening_m:g}\n"
            f"      length_m: {a.cavity_depth_m:g}\n"
            f"      left_end_x_m: {a.width_m - a.cavity_depth_m:.6g}\n"
            f"      axis_height_m: {0.32 * a.height_m:.4g}\n"
            "      closed_end: right\n"
        )
    side = 1.0 if a.cavity == "hole_up" else -1.0
    x_m, z_m, half_m = a.width_m / 2, 0.4 * a.height_m, a.opening_m / 2
    tall_m, middle_m = a.cavity_depth_m + _WALL_M, z_m - side * _WALL_M / 2
    plates = (
        ("left_side", x_m - half_m - _WALL_M / 2, middle_m, _WALL_M, tall_m),
        ("right_side", x_m + half_m + _WALL_M / 2, middle_m, _WALL_M, tall_m),
        ("closed_end", x_m, z_m - side * tall_m / 2, a.opening_m, _WALL_M),
    )
    walls = "".join(
        f"    - {{kind: plate, name: {name}, centre_m: [{at_x_m:.6g}, {at_z_m:.6g}], "
        f"size_m: [{wide_m:.6g}, {high_m:.6g}]}}\n"
        for name, at_x_m, at_z_m, wide_m, high_m in plates
    )
    return (
        f"  obstacles:\n{walls}"
        "  cavities:\n"
        f"    - {{kind: box, name: hole, centre_m: [{x_m:.6g}, {z_m:.6g}], "
        f"size_m: [{a.opening_m:g}, {a.cavity_depth_m:g}], opens: {a.cavity[5:]}}}\n"
    )
