"""Measures and times that a study asks for and its scenes will not have: told before any run."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.kinds.registry import KINDS
from sandmould.reference.reference import measures_text, pages
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.unit.refusing import refused

POLYGON = "{kind: polygon, vertices_m: [[0.05, 0.01], [0.1, 0.01], [0.1, 0.03]]}"
SAND = "{name: wet, targets: {heap_angle_dg: {value: 30, sd: 1}}}"
MATERIAL_SWEEP = (
    "{keys: {sand.density_kg_m3: [2000, 2400, 2600], contact.grain_grain.friction: [0.3, 0.6]}}"
)
CASES: dict[str, tuple[str, str]] = {
    "misspelt": (
        "based_on: tube\nobjective: {measure: tube_fil_fraction}",
        "trial.yaml: objective.measure = 'tube_fil_fraction' cannot be used: valid is a measure "
        "that this scene will have: nearest are tube_fill_fraction, "
        "tube_fill_of_bed_fraction, bed_solid_fraction; sandmould measures lists all.",
    ),
    "of a tube that was replaced, by default": (
        f"based_on: tube\nscenario: {{obstacles: [{POLYGON}]}}",
        "trial.yaml: state an objective, such as objective: {measure: grains}: this study measures "
        "grains, bed_height_m, solid_fraction, bed_solid_fraction, apparent_density_raw_kg_m3, "
        "apparent_density_corrected_kg_m3, coordination and 8 others.",
    ),
    "of a tube that was replaced": (
        f"based_on: tube\nscenario: {{obstacles: [{POLYGON}]}}\n"
        "objective: {measure: tube_front_depth_m}",
        "trial.yaml: objective.measure = 'tube_front_depth_m' cannot be used: valid is a measure "
        "that this scene will have (tube_front_depth_m: with a tube, by its name): such as "
        "grains, bed_height_m, solid_fraction; sandmould measures lists all.",
    ),
    "words": (
        "based_on: l_pattern\nobjective: {measure: pattern_loop}",
        "trial.yaml: objective.measure = 'pattern_loop' cannot be used: valid is a measure that "
        "this scene will have (pattern_loop: words cannot be compared): nearest are "
        "pattern_work_j, pattern_passes, pattern_factor; sandmould measures lists all.",
    ),
    "of another kind of study": (
        "based_on: plates\nobjective: {measure: niyama}",
        "trial.yaml: objective.measure = 'niyama' cannot be used: valid is a measure that this "
        "scene will have: such as solidified_fraction, enthalpy_drift_fraction, "
        "solidification_time_s; sandmould measures lists all.",
    ),
    "of a probe that is elsewhere": (
        "based_on: tank\nobjective: {measure: h50_sd_p}",
        "trial.yaml: objective.measure = 'h50_sd_p' cannot be used: valid is a measure that this "
        "scene will have: nearest are h50_sd_pa, h70_sd_pa, h30_sd_pa; sandmould measures lists "
        "all.",
    ),
    "margin": (
        "based_on: tube\nequivalence: {margins: {solid_fractn: 0.01}}",
        "trial.yaml: equivalence.margins = 'solid_fractn' cannot be used: valid is a measure that "
        "this scene will have: nearest are solid_fraction, bed_solid_fraction, bearing_fraction; "
        "sandmould measures lists all.",
    ),
    "target of a calibration": (
        f"based_on: hopper\nsweep: {MATERIAL_SWEEP}\ncalibration: {{sands: [{SAND}]}}",
        "trial.yaml: calibration.sands.0.targets = 'heap_angle_dg' cannot be used: valid is a "
        "measure that this scene will have: nearest are heap_angle_deg, heap_angle_se_deg, "
        "heap_angle_left_deg; sandmould measures lists all.",
    ),
    "at one point of the sweep": (
        "based_on: l_pattern\nsweep: {keys: {pattern.loop.scheme: [aitken, monolithic]}}\n"
        "objective: {measure: pattern_residual_fraction}\n"
        "scenario: {vibration: [], engine: {name: reference}}",
        "trial.yaml: sweep.keys.pattern.loop.scheme = 'monolithic' cannot be used: valid is one "
        "with which objective.measure, here pattern_residual_fraction, is a measure that this "
        "scene will have (pattern_residual_fraction: with a pattern, in all schemes but "
        "monolithic): nearest are pattern_stored_fraction, pattern_outside_fraction, "
        "pattern_frequency_fraction; sandmould measures lists all.",
    ),
}


@pytest.mark.parametrize("case", CASES, ids=[c.replace(" ", "_") for c in CASES])
def test_sentence(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text, sentence = CASES[case]
    assert refused(tmp_path, text, monkeypatch) == sentence


def test_measures_of_a_study_are_listed_with_unit_and_meaning(tmp_path: Path) -> None:
    path = tmp_path / "trial.yaml"
    # Though its objective cannot be used: this is how a better one is found.
    path.write_text(
        "based_on: l_pattern\nscenario: {vibration: [], engine: {name: reference}}\n"
        "sweep: {keys: {pattern.loop.scheme: [aitken, monolithic]}}\nobjective: {measure: nothing}"
    )
    lines = measures_text(open_study(path)).splitlines()
    head, *rows = [line.split(maxsplit=2) for line in lines if line]
    assert head == ["measure", "unit", "meaning"]
    told = {row[0]: row[1:] for row in rows}
    assert told["pattern_tip_deflection_m"] == ["m", "How far the pattern's tip has sunk."]
    assert told["pattern_windows"] == ["1", "Windows so far. At 1 of 2 points."]


def test_every_kind_says_what_each_measure_means() -> None:
    for kind in KINDS.values():
        measures = [m for group in kind.planning.measures for m in group.measures]
        assert measures
        assert all(m.meaning.endswith(".") for m in measures)
        assert len({m.name for m in measures}) == len(measures)


def test_pages_are_in_step_with_the_code() -> None:
    refresh = "run `python -m sandmould.cli.reference` and commit the pages"
    for path, text in pages().items():
        assert path.read_text(encoding="utf-8") == text, refresh


@pytest.mark.parametrize("path", sorted((ROOT / "config" / "scenarios").glob("*.yaml")))
def test_shipped_scenario_has_what_its_objective_names(path: Path) -> None:
    assert expand(open_study(path))


def test_target_in_the_results_of_another_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    sand = SAND.replace("heap_angle_dg", "other__heap_angle_dg")
    Path("trial.yaml").write_text(
        f"based_on: hopper\nsweep: {MATERIAL_SWEEP}\n"
        f"calibration: {{also: [other], sands: [{sand}]}}"
    )
    told = {
        None: "calibration.also.0 = 'other' cannot be used: valid is a study with results: "
        "sandmould run other comes first.",
        "run\theap_angle_deg\trun_out_m\n": "calibration.sands.0.targets = 'other__heap_angle_dg' "
        "cannot be used: valid is a column of the results of other: nearest are "
        "other__heap_angle_deg.",
    }
    for summary, sentence in told.items():
        if summary is not None:
            Path("results", "other").mkdir(parents=True)
            Path("results", "other", "summary.tsv").write_text(summary)
        with pytest.raises(BadInputError) as caught:
            open_plan(Path("trial.yaml"))
        assert str(caught.value) == f"trial.yaml: {sentence}"
