"""Shipped studies with one thing changed: the message names the key that changed and no other."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.refusing import refused

STAGE = "frequency_hz: 50, duration_s: 1"
MUTATIONS: list[tuple[str, str, str]] = [
    # shape
    ("l_pattern", "pattern: {shape: {kind: bar, width_m: 0.1}}", "pattern.shape.height_m"),
    ("l_pattern", "pattern: {shape: {kind: l_form}}", "pattern.shape"),
    ("l_pattern", "pattern: {shape: {width_m: 0.1}}", "pattern.shape.width_m"),
    ("l_pattern", "pattern: {shape: {kind: bar, width_m: 0.6, height_m: 0.1}}", "pattern.shape"),
    ("l_deflection", "pattern: null", "pattern"),
    ("plates_small", "shapes: [{kind: circle}]", "shapes.0"),
    # case
    ("tank_small", "case: {kind: shoulder}", "case"),
    ("tank_small", "case: {width_m: -1}", "case.width_m"),
    ("tank_small", "case: {rate_kg_s: 0.1}", "case.rate_kg_s"),
    ("shoulder_pour", "case: {kind: tank, particle_m: 0.004}", "case"),
    # hold
    ("tube_demo", "vibration: [{hold: velocity, acceleration_g: 1.5}]", "vibration.0"),
    ("tube_law_hold", "vibration: [{kind: rest, longest_s: 1}]", "vibration"),
    (
        "tube_pouring",
        f"fill: {{vibration: {{hold: velocity, velocity_m_s: 0.1, {STAGE}}}}}",
        "fill.vibration",
    ),
    ("tube_certified", "vibration: []", "vibration"),
    # engine
    ("pressed_bed", "engine: {name: lammps}", "engine.name"),
    ("gate_time", "engine: {name: liggghts}", "engine.name"),
    ("bracket_foam_small", "engine: {name: liggghts}", "engine.name"),
    ("tube_3d_opens", "engine: {name: liggghts}", "engine.name"),
    ("l_schemes", "engine: {name: liggghts}", "engine.name"),
    ("tube_demo", "engine: liggghts", "engine"),
    # obstacle
    ("calibrate_sand", "discharge: null", "discharge"),
    ("hopper", "obstacles: []", "obstacles"),
    ("blind_cavity", "obstacles: [{kind: tube, length: 0.02}]", "obstacles.0"),
    ("tube_demo", "obstacles: {kind: tube, diameter_m: 0.02}", "obstacles"),
    (
        "column",
        "obstacles: [{kind: plate, name: gate, centre_m: [0.1, 0.05], size_m: [0.01, 0.1]}]",
        "obstacles",
    ),
]


@pytest.mark.parametrize(
    ("based_on", "scenario", "key"), MUTATIONS, ids=[f"{b}_{k}" for b, _, k in MUTATIONS]
)
def test_mutation(
    based_on: str, scenario: str, key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = f"based_on: {based_on}\nscenario: {{{scenario}}}"
    lines = refused(tmp_path, text, monkeypatch).split("\n")
    assert [line for line in lines if not line.startswith(f"trial.yaml: scenario.{key}")] == []


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("based_on: tube\nkind: flow", "kind"),
        ("based_on: tube_demo\nreplicates: 1", "replicates"),
        ("based_on: tube\nsweep: {keys: {engine.name: [lammps, gromacs]}}", "sweep.keys.engine"),
    ],
)
def test_mutation_beside_the_scene(
    text: str, key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (line,) = refused(tmp_path, text, monkeypatch).split("\n")
    assert line.startswith(f"trial.yaml: {key}")


def test_the_file_between_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study over a study of the user's that was wrong already."""
    (tmp_path / "middle.yaml").write_text("based_on: tube\nscenario: {box: {width_m: 0.1}}")
    line = refused(tmp_path, "based_on: middle\nscenario: {seed: 2}", monkeypatch)
    assert line.startswith("middle.yaml: scenario.box.width_m = 0.1 cannot be used: ")
