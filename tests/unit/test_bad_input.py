"""Bad input: one sentence with file, key, value and what is valid."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould import ROOT
from sandmould.scenario.bad_input import BadInputError
from sandmould.study.expand import expand
from sandmould.study.opening import open_study


def refused(folder: Path, text: str | bytes, monkeypatch: pytest.MonkeyPatch) -> str:
    """Write a study as ``trial.yaml``, open and expand it, and give the message."""
    monkeypatch.chdir(folder)
    path = Path("trial.yaml")
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(BadInputError) as caught:
        expand(open_study(path))
    return str(caught.value)


SHIPPED = (ROOT / "config" / "studies", ROOT / "config" / "scenarios")
NAMES = ", ".join(sorted({"trial", *(p.stem for f in SHIPPED for p in f.glob("*.yaml"))}))
"""What a study can be based on, as the messages list it."""
CASES: dict[str, tuple[str | bytes, str]] = {
    "wrong type": (
        'based_on: tube\nscenario: {sand: {density_kg_m3: "heavy"}}',
        "trial.yaml: scenario.sand.density_kg_m3 = 'heavy' cannot be used: valid is a number.",
    ),
    "number in quotes": (
        'based_on: tube\nscenario: {box: {width_m: "0.2"}}',
        "trial.yaml: scenario.box.width_m = '0.2' cannot be used: valid is a number.",
    ),
    "yes for a number": (
        "based_on: tube\nreplicates: yes",
        "trial.yaml: replicates = True cannot be used: valid is a whole number.",
    ),
    "unknown key": (
        "based_on: tube\nscenario: {box: {widht_m: 0.2}}",
        "trial.yaml: scenario.box.widht_m = 0.2 cannot be used: "
        "valid is one of the keys depth_m, height_m, width_m (did you mean width_m?).",
    ),
    "unknown key named like a type": (
        "based_on: tube\nstrength: 1",
        "trial.yaml: strength = 1 cannot be used: valid is one of the keys based_on, "
        "cross_check, equivalence, kind, material, objective, replicates, scenario, sweep, title.",
    ),
    "negative size": (
        "based_on: tube\nscenario: {sand: {size_scale: -4}}",
        "trial.yaml: scenario.sand.size_scale = -4 cannot be used: "
        "valid is a number of at least 0.01.",
    ),
    "negative opening": (
        "based_on: tube\nscenario: {sand: {sieve: [{opening_m: -1e-3, passing_fraction: 0}, "
        "{opening_m: 1e-3, passing_fraction: 1}]}}",
        "trial.yaml: scenario.sand.sieve.0.opening_m = -0.001 cannot be used: "
        "valid is a number of at least 1e-06.",
    ),
    "empty sieve": (
        "based_on: tube\nscenario: {sand: {sieve: []}}",
        "trial.yaml: scenario.sand.sieve = [] cannot be used: valid is a list of at least 2 "
        "entries.",
    ),
    "tube outside the box": (
        "based_on: tube\nscenario: {box: {width_m: 0.1}}",
        "config/scenarios/tube.yaml: scenario.obstacles.0.length_m = 0.05 cannot be used: "
        "valid is at most 0.03, so that the tube ends in the box.",
    ),
    "tube beside the box": (
        "based_on: tube\nscenario: {box: {width_m: 0.06}}",
        "config/scenarios/tube.yaml: scenario.obstacles.0.left_end_x_m = 0.07 cannot be used: "
        "valid is less than box.width_m, 0.06 m.",
    ),
    "tube above the box": (
        "based_on: tube\nscenario: {obstacles: [{kind: tube, diameter_m: 0.024, length_m: 0.05, "
        "left_end_x_m: 0.07, axis_height_m: 0.1}]}",
        "trial.yaml: scenario.obstacles.0.axis_height_m = 0.1 cannot be used: "
        "valid is a tube inside the box, 0.12 x 0.11 m.",
    ),
    "polygon outside the box": (
        "based_on: tube\nscenario: {obstacles: [{kind: polygon, "
        "vertices_m: [[0, 0], [0.2, 0], [0, 0.05]]}]}",
        "trial.yaml: scenario.obstacles.0.vertices_m = [[0.0, 0.0], [0.2, 0.0], [0.0, 0.05]] "
        "cannot be used: valid is a polygon inside the box, 0.12 x 0.11 m.",
    ),
    "polygon that crosses itself": (
        "based_on: tube\nscenario: {obstacles: [{kind: polygon, "
        "vertices_m: [[0.01, 0.01], [0.05, 0.05], [0.05, 0.01], [0.01, 0.04]]}]}",
        "trial.yaml: scenario.obstacles.0.vertices_m = [[0.01, 0.01], [0.05, 0.05], [0.05, 0.01], "
        "[0.01, 0.04]] cannot be used: valid is edges that neither cross nor touch one another.",
    ),
    "polygon in 3D": (
        "based_on: bracket\nscenario: {obstacles: [{kind: polygon, "
        "vertices_m: [[0, 0], [0.1, 0], [0, 0.05]]}]}",
        "trial.yaml: scenario.obstacles.0.kind = 'polygon' cannot be used: "
        "valid is plate, tube, cylinder or mesh in 3D.",
    ),
    "cylinder in 2D": (
        "based_on: tube\nscenario: {obstacles: [{kind: cylinder, centre_m: [0, 0, 0], "
        "diameter_m: 0.01, length_m: 0.02}]}",
        "trial.yaml: scenario.obstacles.0.kind = 'cylinder' cannot be used: "
        "valid is plate, tube or polygon in 2D.",
    ),
    "cylinder outside the box": (
        "based_on: bracket\nscenario: {obstacles: [{kind: cylinder, centre_m: [0.07, 0.05, 0.02], "
        "axis: x, diameter_m: 0.05, length_m: 0.02}]}",
        "trial.yaml: scenario.obstacles.0.centre_m = [0.07, 0.05, 0.02] cannot be used: "
        "valid is a cylinder inside the box, 0.14 x 0.1 x 0.14 m.",
    ),
    "mesh that is not there": (
        "based_on: bracket\nscenario: {obstacles: [{kind: mesh, file: absent.stl}]}",
        "trial.yaml: scenario.obstacles.0.file = 'absent.stl' cannot be used: "
        "valid is a readable STL file (No such file or directory).",
    ),
    "mesh that is no STL": (
        "based_on: bracket\nscenario: {obstacles: [{kind: mesh, file: trial.yaml}]}",
        "trial.yaml: scenario.obstacles.0.file = 'trial.yaml' cannot be used: "
        "valid is an STL file, ASCII or binary.",
    ),
    "mesh outside the box": (
        "based_on: tube_3d_small\nscenario: {obstacles: [{kind: mesh, "
        f"file: {ROOT}/config/meshes/bracket.stl, position_m: [0, 0, 0.05]}}]}}",
        "trial.yaml: scenario.obstacles.0.position_m = [0.0, 0.0, 0.05] cannot be used: valid is "
        "one that puts the mesh, now from (-30, -30, -7.95) to (50, 30, 8.05) m, inside the box, "
        "0.18 x 0.12 x 0.18 m.",
    ),
    "swept mesh that is not there": (
        "based_on: bracket\nsweep: {keys: {obstacles.0.file: [absent.stl]}}",
        "trial.yaml: sweep.keys.obstacles.0.file = 'absent.stl' cannot be used: "
        "valid is a readable STL file (No such file or directory).",
    ),
    "grains larger than the tube": (
        "based_on: tube\nscenario: {sand: {size_scale: 30}}",
        "config/scenarios/tube.yaml: scenario.obstacles.0.diameter_m = 0.024 cannot be used: "
        "valid is more than the largest grain, 0.0290371 m.",
    ),
    "time step above critical": (
        "based_on: tube\nscenario: {time_step: {step_s: 1e-3}}",
        "trial.yaml: scenario.time_step.step_s = 0.001 cannot be used: valid is at most the "
        "critical step 1.32e-05 s, set by normal grain-grain contact.",
    ),
    "frequency 0": (
        "based_on: tube\nscenario: {vibration: [{frequency_hz: 0, acceleration_g: 1.5}]}",
        "trial.yaml: scenario.vibration.0.frequency_hz = 0 cannot be used: "
        "valid is a number of at least 0.1.",
    ),
    "swept key that does not exist": (
        "based_on: tube\nsweep: {keys: {vibration.0.frequenzy_hz: [25, 50]}}",
        "trial.yaml: sweep.keys.vibration.0.frequenzy_hz = [25, 50] cannot be used: valid is a "
        "key of the scenario; nearest are vibration.0.frequency_hz, "
        "vibration.0.reference_frequency_hz, vibration.0.ramp_s.",
    ),
    "swept stage that does not exist": (
        "based_on: tube\nsweep: {keys: {vibration.1.frequency_hz: [25, 50]}}",
        "trial.yaml: sweep.keys.vibration.1.frequency_hz = [25, 50] cannot be used: valid is a "
        "key of the scenario; nearest are vibration.0.frequency_hz, "
        "vibration.0.reference_frequency_hz, vibration.0.velocity_m_s.",
    ),
    "swept value": (
        "based_on: tube\nsweep: {keys: {vibration.0.frequency_hz: [0, 50]}}",
        "trial.yaml: sweep.keys.vibration.0.frequency_hz = 0 cannot be used: "
        "valid is a number of at least 0.1.",
    ),
    "swept range upside down": (
        "based_on: tube\nsweep: {keys: {sand.size_scale: {low: 6, high: 4, number: 3}}}",
        "trial.yaml: sweep.keys.sand.size_scale = {'low': 6, 'high': 4, 'number': 3} cannot be "
        "used: valid is a low smaller than high.",
    ),
    "swept range without a bound": (
        "based_on: tube\nsweep: {keys: {sand.size_scale: {low: 4, number: 3}}}",
        "trial.yaml: sweep.keys.sand.size_scale.high = None cannot be used: "
        "valid is a value: this key must be given.",
    ),
    "swept key without a list": (
        "based_on: tube\nsweep: {keys: {sand.size_scale: 4}}",
        "trial.yaml: sweep.keys.sand.size_scale = 4 cannot be used: "
        "valid is a list or a mapping of keys to values.",
    ),
    "direction that is no direction": (
        "based_on: tube\nscenario: {vibration: [{acceleration_g: 1.5, direction: up}]}",
        "trial.yaml: scenario.vibration.0.direction = 'up' cannot be used: "
        "valid is one of 'vertical' or 'horizontal' or a list.",
    ),
    "layer that cannot fit": (
        "based_on: tube\nscenario: {fill: {layers: [{height_m: 0.2}]}}",
        "trial.yaml: scenario.fill.layers = 'a bed about 0.2125 m high' cannot be used: "
        "valid is layers that fit into box.height_m, 0.11 m.",
    ),
    "layer of a count that no memory holds": (
        "based_on: tube\nscenario: {fill: {layers: [{count: 10000000, repeat: 100}]}}",
        "trial.yaml: scenario.fill.layers = '1000000000 grains' cannot be used: "
        "valid is at most 20 million grains.",
    ),
    "missing base": (
        "based_on: tuba",
        "trial.yaml: based_on = 'tuba' cannot be used: valid is the name of a study or scenario: "
        f"{NAMES}.",
    ),
    "base that is no name": (
        "based_on: [tube]",
        "trial.yaml: based_on = ['tube'] cannot be used: valid is the name of a study or "
        f"scenario: {NAMES}.",
    ),
    "based on itself": (
        "based_on: trial",
        "trial.yaml: based_on = 'trial' cannot be used: valid is a study that does not lead back "
        "here (trial on trial).",
    ),
    "missing material": (
        "based_on: tube\nmaterial: silica",
        "trial.yaml: material = 'silica' cannot be used: valid is the name of a material: "
        "rojek_2004.",
    ),
    "unit of another key": (
        "based_on: tube\nscenario: {sand: {density_kg_m3: {value: 2.4, unit: g/cm3, source: x}}}",
        "trial.yaml: scenario.sand.density_kg_m3.unit = 'g/cm3' cannot be used: "
        "valid is the unit of the key, kg/m3.",
    ),
    "kind of a later solver": (
        "based_on: tube\nkind: flow\nmetal: aluminium",
        "trial.yaml: kind = 'flow' cannot be used: "
        "valid is sand; solidification and flow come with their own solvers.",
    ),
    "measure after the end": (
        "based_on: tube\nobjective: {at_vibration_s: 60}",
        "trial.yaml: objective.at_vibration_s = 60.0 cannot be used: "
        "valid is at most 2 s, the end of the vibration.",
    ),
    "key twice": (
        "based_on: tube\nreplicates: 2\nreplicates: 3",
        "trial.yaml: file = \"line 1: key 'replicates' stands twice\" cannot be used: "
        "valid is YAML text.",
    ),
    "key that is no text": (
        "based_on: tube\n5: 2",
        "trial.yaml: file = 'line 1: key 5 is no text: put it in quotes' cannot be used: "
        "valid is YAML text.",
    ),
    "broken YAML": (
        "based_on: tube\nscenario: {box: [",
        "trial.yaml: file = \"line 2: expected the node content, but found '<stream end>'\" "
        "cannot be used: valid is YAML text.",
    ),
    "nested without end": (
        "[" * 1500,
        "trial.yaml: file = 'nested too deeply' cannot be used: valid is YAML text.",
    ),
    "not UTF-8": (
        b"title: Gr\xf6\xdfe",
        "trial.yaml: file = 'not UTF-8 text' cannot be used: valid is a readable YAML file.",
    ),
    "list instead of mapping": (
        "- based_on: tube",
        "trial.yaml: file = [{'based_on': 'tube'}] cannot be used: "
        "valid is a mapping of keys to values.",
    ),
    "empty file": (
        "",
        "trial.yaml: file = None cannot be used: valid is a mapping of keys to values.",
    ),
}


@pytest.mark.parametrize("case", CASES, ids=[c.replace(" ", "_") for c in CASES])
def test_sentence(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text, sentence = CASES[case]
    assert refused(tmp_path, text, monkeypatch) == sentence


def test_missing_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInputError) as caught:
        open_study(Path("absent.yaml"))
    assert str(caught.value) == (
        "absent.yaml: file = 'No such file or directory' cannot be used: "
        "valid is a readable YAML file."
    )


def test_file_name_is_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("Tube 2.yaml").write_text("based_on: tube", encoding="utf-8")
    with pytest.raises(BadInputError, match="small letters, digits and _, a letter first"):
        open_study(Path("Tube 2.yaml"))


def test_circle_of_bases_is_told_where_it_closes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "other.yaml").write_text("based_on: trial", encoding="utf-8")
    assert refused(tmp_path, "based_on: other", monkeypatch) == (
        "other.yaml: based_on = 'trial' cannot be used: "
        "valid is a study that does not lead back here (trial on other on trial)."
    )


def test_every_misfit_is_told_in_its_own_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "other.yaml").write_text(
        "based_on: tube\nmaterial: wet\nscenario: {box: {width_m: wide}}", encoding="utf-8"
    )
    (tmp_path / "wet.yaml").write_text("sand: {density_kg_m3: 2000}", encoding="utf-8")
    assert refused(tmp_path, "based_on: other\nreplicates: 0", monkeypatch).splitlines() == [
        "other.yaml: scenario.box.width_m = 'wide' cannot be used: valid is a number.",
        "trial.yaml: replicates = 0 cannot be used: valid is a number of at least 1.",
    ]


def test_material_is_told_with_its_own_keys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "wet.yaml").write_text("sand: {density_kg_m3: -1}", encoding="utf-8")
    assert refused(tmp_path, "based_on: tube\nmaterial: wet", monkeypatch) == (
        "wet.yaml: sand.density_kg_m3 = -1 cannot be used: valid is a number of at least 1."
    )


def test_line_break_in_a_key_stays_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    message = refused(tmp_path, 'based_on: tube\n"a\\nb": 1', monkeypatch)
    assert message.startswith("trial.yaml: 'a\\nb' = 1 cannot be used: valid is one of the keys")
    assert "\n" not in message
