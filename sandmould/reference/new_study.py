"""The file of a first study, written from the answers to ``sandmould new``."""

from __future__ import annotations

import textwrap
from pathlib import Path

from sandmould.bad_input import BadInputError, Problem
from sandmould.reference.new_answers import WALL_MM, WHY_HELD, NewStudy
from sandmould.study.plan.build_plan import Plan, open_plan


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
        Where answers do not go together. The sentence names the key of the file, which is then as
        it was before.
    """
    before = path.read_bytes() if path.exists() else None
    path.write_text(study_text(answers), encoding="utf-8")
    try:
        return open_plan(path)
    except BadInputError:
        if before is None:
            path.unlink()
        else:
            path.write_bytes(before)
        raise


def study_text(a: NewStudy) -> str:
    """The file of a study.

    Parameters
    ----------
    a : NewStudy
    """
    waves = f"  contact: {{wave_speed_m_s: {a.wave_speed_m_s:g}}}\n" if a.wave_speed_m_s else ""
    layer_m = a.poured_mm / 3e3
    return f"""\
# Written by sandmould new. sandmould keys explains each key; sandmould plan prints the price.
title: At which frequency does {_QUESTIONS[a.cavity]}?
material: {a.material}
scenario:
  engine: {{name: {a.engine}}}
  sand: {{size_scale: {a.size_scale:g}}}
{waves}  time_step: {{fraction: 0.8}}
  box: {{width_m: {_m(a.width_mm)}, height_m: {_m(a.height_mm)}}}
{_cavity_text(a)}  fill: {{layers: [{{height_m: {layer_m:.5g}, repeat: 3}}]}}
  rest: {{rms_speed_m_s: 0.02}}
{textwrap.indent(textwrap.fill(WHY_HELD, 96), "  # ")}
  vibration:
    - hold: {a.hold}
      frequency_hz: {a.borne[0].frequency_hz:g}
{_amplitude_text(a)}      direction: {a.direction}
      duration_s: {a.duration_s:g}
sweep:
  keys:
    vibration.0.frequency_hz: [{", ".join(f"{s.frequency_hz:g}" for s in a.borne)}]
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


def _m(length_mm: float) -> str:
    """A length in m."""
    return f"{length_mm / 1e3:.6g}"


def _amplitude_text(a: NewStudy) -> str:
    if a.hold == "unbalance":
        return (
            "      unbalance:\n"
            f"        moment_kg_m: {a.moment_kg_m:g}\n"
            f"        moving_mass_kg: {a.moving_mass_kg:g}\n"
            f"        mount_frequency_hz: {a.mount_frequency_hz:g}\n"
            f"        flask_depth_m: {_m(a.flask_depth_mm)}\n"
            f"      ramp_s: {0.1 * a.duration_s:g}\n"
        )
    stated = {
        "acceleration": f"acceleration_g: {a.acceleration_g:g}",
        "velocity": f"velocity_m_s: {_m(a.velocity_mm_s)}",
        "displacement": f"displacement_m: {_m(a.amplitude_mm)}",
    }
    return f"      {stated[a.hold]}\n"


def _cavity_text(a: NewStudy) -> str:
    if a.cavity == "none":
        return ""
    if a.cavity == "tube":
        return (
            "  obstacles:\n"
            "    - kind: tube\n"
            "      name: tube\n"
            f"      diameter_m: {_m(a.opening_mm)}\n"
            f"      length_m: {_m(a.cavity_depth_mm)}\n"
            f"      left_end_x_m: {_m(a.width_mm - a.cavity_depth_mm)}\n"
            f"      axis_height_m: {_m(a.middle_mm)}\n"
            "      closed_end: right\n"
        )
    side = -1.0 if a.opens_down else 1.0
    x_mm, half_mm, deep_mm = a.width_mm / 2, a.opening_mm / 2, a.cavity_depth_mm
    tall_mm, middle_mm = deep_mm + WALL_MM, a.middle_mm - side * WALL_MM / 2
    end_mm = a.middle_mm - side * (deep_mm + WALL_MM) / 2
    plates = (
        ("left_side", x_mm - half_mm - WALL_MM / 2, middle_mm, WALL_MM, tall_mm),
        ("right_side", x_mm + half_mm + WALL_MM / 2, middle_mm, WALL_MM, tall_mm),
        ("closed_end", x_mm, end_mm, a.opening_mm, WALL_MM),
    )
    walls = "".join(
        f"    - {{kind: plate, name: {name}, centre_m: [{_m(at_x_mm)}, {_m(at_z_mm)}], "
        f"size_m: [{_m(wide_mm)}, {_m(high_mm)}]}}\n"
        for name, at_x_mm, at_z_mm, wide_mm, high_mm in plates
    )
    return (
        f"  obstacles:\n{walls}"
        "  cavities:\n"
        f"    - {{kind: box, name: hole, centre_m: [{_m(x_mm)}, {_m(a.middle_mm)}], "
        f"size_m: [{_m(a.opening_mm)}, {_m(a.cavity_depth_mm)}], opens: {a.cavity[5:]}}}\n"
    )
