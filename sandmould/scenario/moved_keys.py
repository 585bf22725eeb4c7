"""Keys that stand elsewhere since or are no more, and other names of values: what is valid now."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

MOVED = {
    "scenario.fill.settling.rms_speed_m_s": "rest.rms_speed_m_s",
    "scenario.record.load_every_steps": "rest.load_every_steps",
}

_CONTROLS = {
    "controls": [], "ratio": 1.41, "replicates": 4, "engine": "lammps", "sand_wave_speed": None,
}  # fmt: skip
_ABSENT = "absent: only studies of sand have this section"
_SCHEME = {
    "source": "density", "gradient": "least", "laplacian": "lattice", "surface": 0.985,
    "courant": 0.1, "tolerance": 3e-3, "tension": False, "shifting": 0.0, "restitution": 0.2,
}  # fmt: skip
_TURNED = "absent: only a plate is turned; turn what a file draws in the drawing"
_CYLINDER = "absent: the cylinder is the paper's, 180 mm high, 40 mm wide below and 25 mm above"
REMOVED: dict[str, tuple[Any, str]] = {
    "cross_check": (None, _ABSENT),
    "calibration": ({"sands": [], "also": []}, _ABSENT),
    "certificate": (_CONTROLS, _ABSENT),
    "material": (None, "absent: a study of this kind states all that it needs in its scenario"),
    "replicates": (1, "1: nothing in a run is drawn by lot"),
    "certificate.replicates": (4, "absent: every control is computed with four seeds"),
    "certificate.ratio": (1.41, "absent: controls run at the best frequency, and 1.41 times it"),
    "certificate.engine": (
        "lammps",
        "absent: the control engine is lammps, and reference where the study is on lammps",
    ),
    "equivalence.confidence": (0.9, "absent: it is 0.9, which makes two one-sided tests at 5 %"),
    "objective.at_vibration_s": (
        None,
        "absent: shake only so long, by scenario.vibration.0.duration_s and measure_at_rest; "
        "curves.tsv has the measures at all times",
    ),
    "scenario.obstacles.axis_y_m": (
        None,
        "absent: a tube lies in the middle of the box's depth; elsewhere, draw one of kind mesh",
    ),
    "scenario.cavities.angle_deg": (
        0.0,
        "absent: a cavity that leans is of kind polygon in 2D and drawn so, of kind mesh, in 3D",
    ),
    "scenario.obstacles.angle_deg": (0.0, _TURNED),
    "scenario.shapes.angle_deg": (0.0, _TURNED),
    "scenario.pattern.shape.angle_deg": (0.0, _TURNED),
    "scenario.pattern.loop.limit_share": (0.5, "absent: it is 0.5 in the scheme measured"),
    "scenario.pattern.loop.exchange": (
        "memory",
        "absent: sand and pattern always exchange loads and displacements in memory",
    ),
    "scenario.pattern.loop.predicts": (
        False,
        "absent: shorter windows (pattern.loop.window_s) follow a surface that moves",
    ),
    "scenario.pattern.shape.t_shape": (None, "kind: file, with a T of a mesh file"),
    "scenario.discharge.settling": (
        {"shortest_s": 0.2, "longest_s": 20.0},
        "absent: state discharge.duration_s for another end than rest, which is judged by "
        "rest.discharge_rms_speed_m_s",
    ),
    "scenario.fill.nominal_solid_fraction": (
        None,
        "absent: state a layer by mass_kg or count for another amount of sand",
    ),
    "scenario.guard.kinetic_energy_factor": (
        5.0,
        "absent: a run is stopped at five times the energy that fall and vibration can give",
    ),
    "scenario.record.export": (
        "moments",
        "absent: sandmould export writes the snapshots at 0, 1/8, 1/2 and 1 of the vibration, "
        "and every one lies in snapshots",
    ),
    **{
        f"scenario.{key}": (
            value,
            f"absent: it is {value} in a flow; dt_max_s, relaxations, source_share and "
            "collision_distance make it calm",
        )
        for key, value in _SCHEME.items()
    },
    "scenario.quiet_pa": (200.0, "absent: metal counts as calm below 200 Pa"),
    "scenario.noise_window_s": (0.01, "absent: means are taken over 10 ms"),
    "scenario.probes": (
        [],
        "absent: pressure is recorded at the places of the paper, and fields.npz has all of it",
    ),
    "scenario.case.starts": ("empty", "absent: metal at rest is a case of kind tank"),
    "scenario.case.height_m": (0.18, _CYLINDER),
    "scenario.case.lower_m": (0.04, _CYLINDER),
    "scenario.case.upper_m": (0.025, _CYLINDER),
    "scenario.metal.name": ("pure aluminium", "absent: density and viscosity tell the metal"),
    "scenario.metal.gravity_m_s2": (9.8, "absent: it is the paper's 9.8 m/s2"),
    "scenario.stepping": (
        "local",
        "absent: elements step locally, which takes the fewest steps; differences have one step",
    ),
    "scenario.step_share": (0.95, "absent: steps are 0.95 of the longest stable ones"),
    "scenario.refuse_ratio": (
        True,
        "absent: layers keep the rule of 1/c_k, by a larger kernel_size or by exchange: faces",
    ),
    "scenario.shapes.low_m": (
        [0.0, 0.0],
        "absent: a picture's lower left corner is at 0, 0; move the corners of the box instead",
    ),
    "scenario.time_step.coordination": (
        None,
        "absent: time_step.fraction makes steps shorter, and bed_fraction sets them by the bed",
    ),
}
"""Keys that are no more, by path without places in lists, and kinds by section and name: the value
that holds now, with which a key counts as not stated, and what to write instead."""

CALLED = {("hold", "stroke"): "displacement", ("hold", "amplitude"): "displacement"}
"""Other names of values, by key."""


def called(key: str, value: str) -> str:
    """What a value is called here; empty where no other name is known."""
    return CALLED.get((key, value.lower()), "")


def instead_of(parts: Sequence[str]) -> str:
    """What is valid instead of a key that has moved or is no more; empty for any other path."""
    path = _path(parts)
    if path in MOVED:
        return f"the key {MOVED[path]}, where this one has moved"
    return REMOVED[path][1] if path in REMOVED else ""


def holds_anyway(parts: Sequence[str], value: Any) -> bool:
    """Whether a key that is no more states what holds without it."""
    removed = REMOVED.get(_path(parts))
    return removed is not None and _says(value, removed[0])


def _path(parts: Sequence[str]) -> str:
    return ".".join(part for part in parts if part and not part.isdecimal())


def _says(value: Any, known: Any) -> bool:
    """Whether a value is the known one, or a part of a known section."""
    if isinstance(value, dict) and isinstance(known, dict):
        return all(key in known and _says(each, known[key]) for key, each in value.items())
    return bool(value == known)
