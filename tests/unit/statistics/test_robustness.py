"""The certificate: what each control changes, which runs it adds, and what they say together."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from analysis.spectrum import column_frequency_hz, first_resonance_hz, transfer
from sandmould import ROOT
from sandmould.scenario.bad_input import BadInputError
from sandmould.scenario.box import Tube
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.robustness import Robustness, assess_robustness
from sandmould.study.definition.certificate import RobustnessChecks, frequency_key
from sandmould.study.definition.study import Study
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import OpenStudy, open_study
from sandmould.study.robustness.controls import BY_FACTOR, SHAKEN_HZ, Case, cases
from sandmould.study.rounds.decide import choose_controls, next_round
from sandmould.study.rounds.round_log import RoundLog, basis_of, read_rounds, write_rounds

FREQUENCY = "vibration.0.frequency_hz"
FILL = "tube_fill_fraction"
BEST_HZ = 50.0
CERTIFIED_HZ = (35.7, 50.0, 70.0)
ALL = ["hold", "stiffness", "bed_depth", "grain_scale", "tube_length", "time_step", "engine",
       "spectrum"]  # fmt: skip
STUDY: dict[str, Any] = {
    "based_on": "tube",
    "scenario": {"engine": {"name": "reference"}},
    "sweep": {"keys": {FREQUENCY: [20, 35, 50, 70, 100]}},
    "replicates": 3,
    "equivalence": {"margins": {FILL: 0.03}},
    "certificate": {"controls": ALL},
}


def opened(folder: Path, **changes: Any) -> OpenStudy:
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(STUDY | changes), encoding="utf-8")
    return open_study(path)


def by_part(study: OpenStudy, best_hz: float = BEST_HZ) -> dict[str, Case]:
    scenario = study.study.scenario
    return {case.part: case for case in cases(study.study.certificate, scenario, best_hz)}


def test_what_is_held_changes_nothing_at_the_best_frequency(tmp_path: Path) -> None:
    study = opened(tmp_path)
    stage = study.study.scenario.vibration[0]
    found = by_part(study)
    assert {p for p in found if "hold" in p} == {
        "control: hold displacement", "control: hold velocity",
    }  # fmt: skip
    for power, held in ((1, "velocity"), (2, "displacement")):
        (new,) = found[f"control: hold {held}"].change(study.study.scenario).vibration
        for f in (25.0, 50.0, 100.0):
            was, now = (s.model_copy(update={"frequency_hz": f}) for s in (stage, new))
            ratio = now.peak_acceleration_g / was.peak_acceleration_g
            assert ratio == pytest.approx((f / BEST_HZ) ** power)


def test_a_sweep_with_an_unbalance_is_compared_with_motions_laid_down(tmp_path: Path) -> None:
    table = {
        "moment_kg_m": 0.006, "moving_mass_kg": 30, "mount_frequency_hz": 6, "flask_depth_m": 0.5,
    }  # fmt: skip
    stage = {"hold": "unbalance", "unbalance": table, "duration_s": 1}
    study = opened(tmp_path, scenario={"engine": {"name": "reference"}, "vibration": [stage]})
    found = {part: case for part, case in by_part(study).items() if "hold" in part}
    assert len(found) == 3
    swept = study.study.scenario.vibrations[0].model_copy(update={"frequency_hz": BEST_HZ})
    for case in found.values():
        (new,) = case.change(study.study.scenario).vibrations
        at_best = new.model_copy(update={"frequency_hz": BEST_HZ})
        assert new.unbalance is None
        assert at_best.amplitude_m == pytest.approx(swept.amplitude_m)
        # sand on a table changes its amplitude, so that the middle frequency differs too
        assert case.places == (0, 1, 2)


def test_each_control_changes_what_it_is_named_after(tmp_path: Path) -> None:
    study = opened(tmp_path)
    old = study.study.scenario

    def new(part: str) -> Scenario:
        return by_part(study)[f"control: {part}"].change(old)

    soft = new("stiffness x0.1").contact
    for pair in ("grain_grain", "grain_wall"):
        for key in ("normal", "tangential", "rolling"):
            name = f"{key}_stiffness_n_m"
            was, now = (getattr(getattr(c, pair), name) for c in (old.contact, soft))
            assert now == pytest.approx(0.1 * was)
    assert soft.grain_grain.friction == old.contact.grain_grain.friction
    allowed = {part: new(part).guard.largest_overlap_fraction
               for part in ("stiffness x0.1", "stiffness x10", "bed_depth x2")}  # fmt: skip
    root = math.sqrt(10.0)
    assert allowed == pytest.approx(
        {"stiffness x0.1": 0.5 * root, "stiffness x10": 0.5, "bed_depth x2": 0.5}
    )
    loose = old.model_copy(
        update={"guard": old.guard.model_copy(update={"largest_overlap_fraction": 0.9})}
    )
    softest = by_part(study)["control: stiffness x0.1"].change(loose)
    assert softest.guard.largest_overlap_fraction == 2.0
    deep = new("bed_depth x2")
    assert deep.fill.layers[0].height_m == 2 * old.fill.layers[0].height_m
    assert deep.box.height_m == 2 * old.box.height_m
    assert new("bed_depth x0.5").box.height_m == old.box.height_m
    assert new("grain_scale x1.5").sand.size_scale == 1.5 * old.sand.size_scale
    tube, longer = (next(o for o in s.obstacles if isinstance(o, Tube))
                    for s in (old, new("tube_length x1.5")))  # fmt: skip
    assert longer.length_m == pytest.approx(1.5 * tube.length_m)
    assert longer.right_end_x_m == pytest.approx(tube.right_end_x_m)
    assert new("time_step x0.5").step_s == pytest.approx(0.5 * old.step_s)
    assert new("engine lammps").engine.name == "lammps"
    shaken = new("spectrum small shake")
    assert [s.frequency_hz for s in shaken.vibration] == list(SHAKEN_HZ)
    assert all(s.peak_acceleration_g < 0.1 for s in shaken.vibration)


def test_sand_by_number_of_grains_stays_as_much(tmp_path: Path) -> None:
    study = opened(tmp_path, scenario={"engine": {"name": "reference"},
                                       "fill": {"layers": [{"count": 900}]}})  # fmt: skip
    coarse = by_part(study)["control: grain_scale x1.5"].change(study.study.scenario)
    assert coarse.fill.layers[0].count == 400


def test_runs_are_added_at_three_frequencies_and_share_their_seeds(tmp_path: Path) -> None:
    study = opened(tmp_path, certificate={"controls": ["hold", "stiffness", "spectrum"]})
    swept = expand(study)
    runs = expand(study, (), CERTIFIED_HZ)
    assert [r.run for r in runs[: len(swept)]] == [r.run for r in swept]
    count: dict[str, int] = {}
    for run in runs:
        count[run.part] = count.get(run.part, 0) + 1
    # 50 and 70 Hz are swept already... 35.7 Hz is not; what is held is not run at the best.
    assert count == {
        "sweep": 5 * 3 + 3,
        "control: hold velocity": 2 * 3, "control: hold displacement": 2 * 3,
        "control: stiffness x0.1": 9, "control: stiffness x10": 9,
        "control: spectrum small shake": 3,
    }  # fmt: skip
    assert len({r.run for r in runs}) == len(runs)
    assert {r.seed for r in runs} == {r.seed for r in swept}
    soft = next(r for r in runs if r.part == "control: stiffness x0.1")
    assert soft.run.startswith("control_stiffness_x0_1_frequency_35p7_r1_")


def test_a_control_that_cannot_be_run_is_told_before_anything_starts(tmp_path: Path) -> None:
    wide = {"engine": {"name": "reference"}, "obstacles": [
        {"kind": "tube", "diameter_m": 0.024, "length_m": 0.11, "left_end_x_m": 0.01,
         "axis_height_m": 0.035, "closed_end": "right"}]}  # fmt: skip
    study = opened(tmp_path, scenario=wide, certificate={"controls": ["tube_length"]})
    with pytest.raises(BadInputError, match=r"certificate.controls = 'tube_length x1.5' cannot"):
        expand(study, (), CERTIFIED_HZ)


def test_a_refused_control_is_told_before_the_first_run_not_after_the_rounds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    long = {"obstacles": [{"kind": "tube", "diameter_m": 0.024, "length_m": 0.11,
                           "left_end_x_m": 0.01, "axis_height_m": 0.035,
                           "closed_end": "right"}]}  # fmt: skip
    opened(tmp_path, scenario=STUDY["scenario"] | long, refine={"rounds": 2})
    with pytest.raises(BadInputError, match=r"certificate.controls = 'tube_length x1.5' cannot"):
        open_plan(tmp_path / "trial.yaml")
    # An engine that refuses a control's scene is told too: liggghts has no background damping (37).
    opened(tmp_path, certificate={"controls": ["engine"], "engine": "liggghts"})
    with pytest.raises(BadInputError, match=r"on engine liggghts"):
        open_plan(tmp_path / "trial.yaml")


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"sweep": {"keys": {"sand.size_scale": [6, 7, 8, 9]}}}, r"one swept key, a frequency"),
        ({"sweep": {"keys": {FREQUENCY: [20, 50]}}}, r"at least 4 frequencies to find the best"),
        ({"certificate": {"controls": ["hold", "hold"]}}, r"'hold' .* each control once"),
        (
            {"certificate": {"controls": ["engine"], "engine": "reference"}},
            r"certificate.engine = 'reference' .* another engine than the study's own",
        ),
        (
            {"scenario": {"obstacles": []}, "objective": {"measure": "solid_fraction"}},
            r"'tube_length' .* there is no tube",
        ),
    ],
)
def test_certificates_that_make_no_sense_are_told(
    tmp_path: Path, changes: dict[str, Any], told: str
) -> None:
    with pytest.raises(BadInputError, match=told):
        opened(tmp_path, **changes)


def planted(fill: Callable[[str, float], float], parts: list[str], sd: float) -> pd.DataFrame:
    """A summary of the sweep and its controls; the fill is given by part and frequency."""
    noise = np.random.default_rng(3)
    rows = []
    for part in ("sweep", *(f"control: {p}" for p in parts)):
        swept = (20.0, *CERTIFIED_HZ, 100.0) if part == "sweep" else CERTIFIED_HZ
        for f in swept:
            for replicate in (1, 2, 3):
                value = fill(part.removeprefix("control: "), f) + noise.normal(0.0, sd)
                rows.append({"part": part, FREQUENCY: f, "replicate": replicate,
                             "outcome_code": 0, "cpu_s": 10.0, FILL: value})  # fmt: skip
    return pd.DataFrame(rows)


def hill(frequency_hz: float, best_hz: float) -> float:
    return 0.6 - 0.3 * float(np.log(frequency_hz / best_hz)) ** 2


PARTS = ["hold velocity", "hold displacement", "stiffness x0.1", "stiffness x10", "bed_depth x0.5",
         "bed_depth x2", "time_step x0.5", "engine lammps"]  # fmt: skip


def assess_study(table: pd.DataFrame, study: Study) -> Robustness:
    """Assess the controls of a study by its own objective and margin."""
    margin = study.equivalence.margins.get(study.objective.measure)
    controlled = tuple(cases(study.certificate, study.scenario, CERTIFIED_HZ[1]))
    return assess_robustness(table, FREQUENCY, CERTIFIED_HZ, study.objective, margin, controlled)


def assessed(
    tmp_path: Path, moved: dict[str, float], sd: float = 0.004, parts: list[str] = PARTS
) -> Robustness:
    """Assess controls of which some move the optimum to another frequency."""
    table = planted(lambda part, f: hill(f, moved.get(part, BEST_HZ)), parts, sd)
    return assess_study(table, opened(tmp_path).study)


def test_an_optimum_that_nothing_moves_belongs_to_the_sand(tmp_path: Path) -> None:
    found = assessed(tmp_path, {})
    assert found.cause == "rearrangement of grains"
    assert not found.is_artefact
    assert {m.verdict for m in found.shifts} == {"held"}
    assert found.sentences[0].startswith("The optimum at 50 Hz belongs to the sand: neither")


def test_an_optimum_that_goes_with_the_springs_is_theirs(tmp_path: Path) -> None:
    root = 10**0.5
    moved = {"stiffness x0.1": 50 / root, "stiffness x10": 50 * root,
             "bed_depth x0.5": 100.0, "bed_depth x2": 25.0}  # fmt: skip
    found = assessed(tmp_path, moved)
    assert found.cause == "column resonance of the springs"
    assert found.is_artefact
    way = {m.name: m.verdict for m in found.shifts}
    assert (way["stiffness x10"], way["stiffness x0.1"]) == ("up", "down")
    # Stiffness alone is not enough to call it a column.
    alone = assessed(tmp_path, {k: v for k, v in moved.items() if "stiffness" in k})
    assert alone.cause == "unresolved"
    assert "stiffness x0.1 moves it and stiffness x10 moves it" in alone.sentences[0]


def test_other_factors_of_the_controls_reach_the_same_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a control multiplies by is passed on as a number: 8 stands for 10, and 3 for 2."""
    for control, factors in (("stiffness", (0.125, 8.0)), ("bed_depth", (0.5, 3.0))):
        monkeypatch.setitem(BY_FACTOR, control, (factors, BY_FACTOR[control][1]))
    moved = {"stiffness x0.125": 50 / 8**0.5, "stiffness x8": 50 * 8**0.5,
             "bed_depth x0.5": 100.0, "bed_depth x3": 50 / 3}  # fmt: skip
    found = assessed(tmp_path, moved, parts=["hold velocity", *moved])
    assert found.cause == "column resonance of the springs"
    assert all(s.follows_springs for s in found.shifts if s.case.factor is not None)
    against = assessed(tmp_path, moved | {"stiffness x8": 50 / 8**0.5}, parts=list(moved))
    assert [s.follows_springs for s in against.shifts] == [True, False, True, True]


def test_what_is_held_and_the_numerics_are_told_apart(tmp_path: Path) -> None:
    held = assessed(tmp_path, {"hold velocity": 70.0, "hold displacement": 100.0})
    assert held.cause == "artefact of what is held constant"
    assert "velocity held and displacement held" in held.sentences[0]
    step = assessed(tmp_path, {"hold velocity": 70.0, "time_step x0.5": 75.0})
    assert step.cause == "artefact of the numerics"
    assert "It moves up with velocity held and time step x0.5." in step.sentences[1]
    both = assessed(tmp_path, {"hold velocity": 30.0, "time_step x0.5": 75.0})
    assert both.sentences[1] == "It moves up with time step x0.5 and down with velocity held."


def test_noise_leaves_it_unresolved(tmp_path: Path) -> None:
    found = assessed(tmp_path, {}, sd=0.1)
    assert found.cause == "unresolved"
    assert "does not tell" in found.sentences[0]
    assert any(s.startswith("Not told: ") for s in found.sentences)


def test_controls_that_were_not_asked_or_failed_keep_it_unresolved(tmp_path: Path) -> None:
    table = planted(lambda part, f: hill(f, BEST_HZ), PARTS[2:6], 0.004)
    table.loc[table["part"] == "control: stiffness x10", "outcome_code"] = 311
    found = assess_study(table, opened(tmp_path).study)
    assert found.cause == "unresolved"
    for words in ("stiffness x10 does not tell", "hold was not asked", "engine was not asked"):
        assert words in found.sentences[0]


def test_frequencies_are_chosen_round_the_optimum_and_anew_after_more_rounds(
    tmp_path: Path,
) -> None:
    study = opened(tmp_path, refine={"rounds": 2, "runs": 3}).study
    table = planted(lambda part, f: hill(f, BEST_HZ), [], 0.002)
    log = choose_controls(RoundLog(basis_of(study)), study, table, [FREQUENCY])
    low, best, high = log.certified_hz
    assert best == pytest.approx(BEST_HZ, rel=0.06)
    assert (low, high) == pytest.approx((best / 1.4, best * 1.4), rel=0.01)
    write_rounds(log, tmp_path)
    assert read_rounds(tmp_path, study) == log
    assert next_round(log, study, table, [FREQUENCY]).certified_hz == ()


def test_a_swept_frequency_is_found() -> None:
    sweep = open_study(ROOT / "config" / "studies" / "tube_demo.yaml").study.sweep
    assert frequency_key(sweep) == FREQUENCY
    assert RobustnessChecks().controls == ()


def shaken_mass(frequency_hz: float, own_hz: float, damping: float) -> float:
    """Force amplitude of a mass on a spring over that of a rigid one: exact."""
    r = frequency_hz / own_hz
    passed = 1 + (2 * damping * r) ** 2
    return float(np.sqrt(passed / ((1 - r * r) ** 2 + (2 * damping * r) ** 2)))


def test_transfer_is_that_of_a_mass_on_a_spring() -> None:
    own_hz, damping, window_s, rigid_n = 80.0, 0.2, 3e-4, 2.5
    shaken = np.array(SHAKEN_HZ)
    found = []
    for f in SHAKEN_HZ:
        amplitude = rigid_n * shaken_mass(f, own_hz, damping)
        ends = np.arange(1, int(8 / f / window_s)) * window_s
        # The mean of a sine over each window, exactly.
        a, b = 2 * np.pi * f * (ends - window_s), 2 * np.pi * f * ends
        mean = amplitude * (np.cos(a + 0.3) - np.cos(b + 0.3)) / (b - a) + 40.0
        found.append(transfer(ends, mean, f, window_s, rigid_n))
        assert found[-1] == pytest.approx(shaken_mass(f, own_hz, damping), rel=1e-6)
    # The grid is coarse: 1.26 from frequency to frequency.
    assert first_resonance_hz(shaken, np.array(found)) == pytest.approx(own_hz, rel=0.1)
    assert np.isnan(first_resonance_hz(shaken, np.linspace(1.0, 0.1, len(shaken))))
    assert np.isnan(transfer(np.array([0.0, 1e-3]), np.zeros(2), 50.0, 1e-3, 1.0))


def test_column_of_springs_has_the_frequency_of_its_wave() -> None:
    # The numbers of the design notes: 2.25 mm spheres of 2400 kg/m3, 7e4 N/m, 0.3 m of bed.
    mass_kg = 2400 * np.pi / 6 * 2.25e-3**3
    assert column_frequency_hz(2.25e-3, mass_kg, 7e4, 0.3) == pytest.approx(131, abs=1)
