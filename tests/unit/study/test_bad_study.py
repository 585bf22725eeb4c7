"""A bad study, its file, bases and sweep: one sentence with file, key, value and what is valid."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.study.plan.load_study import open_study
from tests.unit.refusing import refused

SHIPPED = (ROOT / "config" / "studies", ROOT / "config" / "scenarios")
PLACES = " and ".join([".", "config/studies", "config/scenarios"])
"""Where what a study can be based on lies, as the messages list it."""
CASES: dict[str, tuple[str | bytes, str]] = {
    "yes for a number": (
        "based_on: tube\nreplicates: yes",
        "trial.yaml: replicates = 'yes' cannot be used: valid is a whole number.",
    ),
    "unknown key named like a type": (
        "based_on: tube\nstrength: 1",
        "trial.yaml: strength = 1 cannot be used: valid is one of the keys based_on, calibration, "
        "certificate, cross_check, equivalence, grain_check, kind, material, objective, "
        "own_measures, refine, replicates, scenario, sweep, table, title.",
    ),
    "swept mesh that is not there": (
        "based_on: bracket\nsweep: {keys: {obstacles.0.file: [absent.stl]}}",
        "trial.yaml: sweep.keys.obstacles.0.file = 'absent.stl' cannot be used: "
        "valid is a readable file (No such file or directory).",
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
    "key that is no more": (
        "based_on: l_pattern\nscenario: {pattern: {loop: {exchange: files}}}",
        "trial.yaml: scenario.pattern.loop.exchange = 'files' cannot be used: valid is absent: "
        "sand and pattern always exchange loads and displacements in memory.",
    ),
    "swept key that is no more": (
        "based_on: l_pattern\nsweep: {keys: {pattern.loop.predicts: [true, false]}}",
        "trial.yaml: sweep.keys.pattern.loop.predicts = [True, False] cannot be used: valid is "
        "absent: shorter windows (pattern.loop.window_s) "
        "follow a surface that moves.",
    ),
    "swept value": (
        "based_on: tube\nsweep: {keys: {vibration.0.frequency_hz: [0, 50]}}",
        "trial.yaml: sweep.keys.vibration.0.frequency_hz = 0 cannot be used: "
        "valid is a number of at least 0.1.",
    ),
    "title with a colon": (
        "based_on: tube\ntitle: Sand: how far?",
        "trial.yaml: line 2 cannot be read as YAML: no key can stand before its last colon: put a "
        "text that holds ': ' in quotes, or indent the line like those beside it.",
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
        "valid is a list or a mapping of keys to values: high, low, number, spacing.",
    ),
    "measure without its key": (
        "based_on: tube\nobjective: {beside: [solid_fraction]}",
        "trial.yaml: objective.beside.0 = 'solid_fraction' cannot be used: "
        "valid is a mapping of keys to values: better, measure, target, such as "
        "{measure: solid_fraction}.",
    ),
    "missing base": (
        "based_on: tuba",
        "trial.yaml: based_on = 'tuba' cannot be used: valid is the name of a study or scenario "
        f"(did you mean tube?); they lie in {PLACES}.",
    ),
    "base that is no name": (
        "based_on: [tube]",
        "trial.yaml: based_on = ['tube'] cannot be used: valid is the name of a study or "
        f"scenario (did you mean tube?); they lie in {PLACES}.",
    ),
    "based on itself": (
        "based_on: trial",
        "trial.yaml: based_on = 'trial' cannot be used: valid is a study that does not lead back "
        "here (trial on trial).",
    ),
    "missing material": (
        "based_on: tube\nmaterial: silica",
        "trial.yaml: material = 'silica' cannot be used: valid is the name of a material of "
        "kind sand: duck_beach, lbi_beach, rojek_2004.",
    ),
    "material of another kind": (
        "based_on: tube\nmaterial: hirata_2019",
        "trial.yaml: material = 'hirata_2019' cannot be used: valid is the name of a material of "
        "kind sand: duck_beach, lbi_beach, rojek_2004.",
    ),
    "material that no kind can use": (
        "based_on: plates\nmaterial: hirata_2019_aluminium",
        "trial.yaml: material = 'hirata_2019_aluminium' cannot be used: valid is the name of a "
        "material of kind solidification: a356_iron_die, a356_silica, ductile_iron_olivine, "
        "grey_iron_silica, gun_metal_zircon, hirata_2019, manganese_bronze_silica.",
    ),
    "swept range with a misspelt bound": (
        "based_on: tube\nsweep: {keys: {sand.size_scale: {low: 4, high: 5, nummer: 3}}}",
        "trial.yaml: sweep.keys.sand.size_scale.nummer = 3 cannot be used: valid is one of the "
        "keys high, low, number, spacing (did you mean number?).",
    ),
    "key twice": (
        "based_on: tube\nreplicates: 2\nreplicates: 3",
        "trial.yaml: line 3 cannot be read as YAML: key 'replicates' stands twice, first in "
        "line 2.",
    ),
    "tab": (
        "based_on: tube\n\treplicates: 3",
        "trial.yaml: line 2 cannot be read as YAML: a tab stands there; YAML is indented with "
        "spaces.",
    ),
    "number with a unit": (
        "based_on: tube\nscenario: {vibration: [{displacement_m: 0.15 mm}]}",
        "trial.yaml: scenario.vibration.0.displacement_m = '0.15 mm' cannot be used: valid is a "
        "number in m: write 0.00015 (m).",
    ),
    "number with a unit of another kind": (
        "based_on: tube\nscenario: {vibration: [{displacement_m: 3 bananas}]}",
        "trial.yaml: scenario.vibration.0.displacement_m = '3 bananas' cannot be used: valid is "
        "a number in m.",
    ),
    "unit of the same kind": (
        "based_on: tube\nscenario: {vibration: [{displacement_m: {value: 0.15, unit: mm, source: "
        "me}}]}",
        "trial.yaml: scenario.vibration.0.displacement_m.unit = 'mm' cannot be used: valid is the "
        "unit of the key, m: write 0.00015 (m).",
    ),
    "stroke": (
        "based_on: tube\nscenario: {vibration: [{hold: stroke}]}",
        "trial.yaml: scenario.vibration.0.hold = 'stroke' cannot be used: valid is one of "
        "'acceleration', 'velocity', 'displacement' or 'unbalance'; stroke is called displacement.",
    ),
    "key that is no text": (
        "based_on: tube\n5: 2",
        "trial.yaml: line 2 cannot be read as YAML: key 5 is no text: put it in quotes.",
    ),
    "broken YAML": (
        "based_on: tube\nscenario: {box: [",
        "trial.yaml: line 2 cannot be read as YAML: expected the node content, but found "
        "'<stream end>'.",
    ),
    "nested without end": (
        "[" * 1500,
        "trial.yaml: file = '51 levels of YAML' cannot be used: valid is at most 50 levels of "
        "YAML: fewer levels.",
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
        "trial.yaml: file = 'nothing' cannot be used: valid is a mapping of keys to values.",
    ),
}


@pytest.mark.parametrize("case", CASES, ids=[c.replace(" ", "_") for c in CASES])
def test_sentence(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text, sentence = CASES[case]
    assert refused(tmp_path, text, monkeypatch) == sentence


def test_a_base_that_is_missing_is_not_looked_for_among_other_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "notes.yaml").write_text("shopping: [milk]")
    (tmp_path / "Old Tube.yaml").write_text("based_on: tube")
    (tmp_path / "mine.yaml").write_text("based_on: tube")
    (tmp_path / "minde.yaml").write_text("based_on: [")
    told = refused(tmp_path, "based_on: minee", monkeypatch)
    assert "(did you mean mine?)" in told
    assert "notes" not in refused(tmp_path, "based_on: note", monkeypatch)
    assert "Old" not in refused(tmp_path, "based_on: old_tube", monkeypatch)


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
        "other.yaml: scenario.box.width_m = 'wide' cannot be used: valid is a number in m.",
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
